// One orbit of the camera, played.

const ORBIT_SECONDS = 16;

function nearestFrame(frames, phi) {
  const gap = (frame) => Math.abs(mod(frame.phi - phi + 180, TURN) - 180);
  return frames.reduce((best, frame, i) => (gap(frame) < gap(frames[best]) ? i : best), 0);
}

class Playback {
  constructor(explorer) {
    this.explorer = explorer;
    this.running = null;
    this.moment = 0;
    this.strip = new Strip();
    this.canvas = canvasOf("strip", "Brightness of the images over one orbit");
    this.button = button("▶ Play one orbit", "Play one orbit of the camera (space)", () => this.toggle(), {
      class: "kc-play",
    });
    this.clock = h("span", { class: "kc-clock" });
    this.bar = h("div", { class: "kc-orbit" }, this.button, this.clock);
    this.stripBox = h("section", { class: "kc-strip-box", hidden: true }, this.canvas);
    for (const name of ["pointerdown", "pointermove"]) this.canvas.addEventListener(name, (e) => this.scrub(e));
  }
  allow(hasOrbit) {
    this.button.disabled = !hasOrbit;
    this.button.title = hasOrbit ? "Play one orbit of the camera (space)" : "This camera does not circle the spin axis";
  }
  show(orbit) {
    this.stripBox.hidden = false;
    if (!this.running) return;
    this.moment = this.nearestMoment(orbit);
    this.running.from = null;
  }
  drop() {
    this.stripBox.hidden = true;
    this.clock.textContent = "";
    if (this.running) this.explorer.ask("orbit");
  }
  nearestMoment({ frames }) {
    return nearestFrame(frames, this.explorer.state.phi) / frames.length;
  }
  toggle() {
    if (this.running) return this.stop();
    if (this.button.disabled)
      return this.explorer.status.complain("This camera does not circle the spin axis: it has no orbit to play.");
    this.running = { from: null };
    this.button.textContent = "❚❚ Pause";
    const { orbit } = this.explorer.model;
    if (orbit) this.moment = this.nearestMoment(orbit);
    else this.explorer.ask("orbit");
    this.explorer.redraw();
  }
  stop() {
    if (!this.running) return;
    this.running = null;
    this.button.textContent = "▶ Play one orbit";
    if (!this.explorer.model.orbit) this.clock.textContent = "";
    this.explorer.settleStar();
  }
  // While the tracks are to come.
  wait(progress, seconds) {
    if (!this.running || this.explorer.model.orbit) return;
    const work = progress ? `: ${progress.stage}` : "";
    this.clock.textContent = `finding the tracks … ${Math.floor(seconds)} s${work}`;
  }
  step(now) {
    const { running } = this;
    if (!running || !this.explorer.model.orbit) return;
    if (running.from === null) [running.from, running.began] = [now - this.moment * ORBIT_SECONDS * 1000, now];
    this.moment = mod((now - running.from) / 1000 / ORBIT_SECONDS, 1);
    this.explorer.showMoment(this.moment);
    if (now - running.began >= ORBIT_SECONDS * 1000) this.stop();
  }
  tell(part, period) {
    this.clock.textContent = `t = ${(part * period).toFixed(1)} M of ${period.toFixed(1)} M`;
  }
  scrub(event) {
    if (!this.explorer.model.orbit || !(event.buttons & 1)) return;
    const { left, width, height } = this.canvas.getBoundingClientRect();
    const f = this.strip.frame(width, height);
    this.moment = clamp((event.clientX - left - f.x) / f.w, 0, 0.9999);
    if (this.running) this.running.from = null;
    this.explorer.showMoment(this.moment);
    if (!this.running) this.explorer.settleStar();
    this.explorer.redraw();
  }
}
