// One orbit of the camera, played.

const ORBIT_SECONDS = 16;
const SPEEDS = [0.25, 0.5, 1, 2, 4];
const MOMENTS = 360;

function nearestFrame(frames, phi) {
  const gap = (frame) => Math.abs(mod(frame.phi - phi + 180, TURN) - 180);
  return frames.reduce((best, frame, i) => (gap(frame) < gap(frames[best]) ? i : best), 0);
}

class Playback {
  constructor(explorer) {
    this.explorer = explorer;
    Object.assign(this, { running: null, moment: 0, speed: 1, wanted: null });
    this.strip = new Strip();
    this.canvas = canvasOf("strip", "Brightness of the images over one orbit");
    this.button = button("▶ Play one orbit", "Play one orbit of the camera (space)", () => this.toggle(), {
      class: "kc-play",
    });
    this.clock = h("span", { class: "kc-clock" });
    const speeds = SPEEDS.map((speed) => [speed, `${speed} ×`]);
    this.speeds = select("Speed of the orbit", speeds, (speed) => this.setSpeed(Number(speed)));
    this.speeds.value = "1";
    const range = { type: "range", min: 0, max: MOMENTS - 1, step: 1, value: 0, "aria-label": "Moment of the orbit" };
    this.slider = h("input", { ...range, class: "kc-moment" });
    this.slider.addEventListener("input", () => this.choose(Number(this.slider.value) / MOMENTS));
    this.bar = h("div", { class: "kc-orbit" }, this.button, this.speeds, this.slider, this.clock);
    this.stripBox = h("section", { class: "kc-strip-box", hidden: true }, this.canvas);
    for (const name of ["pointerdown", "pointermove"]) this.canvas.addEventListener(name, (e) => this.scrub(e));
  }
  allow(hasOrbit) {
    const { recording } = this.explorer;
    for (const node of [this.button, this.slider, this.speeds, recording.button]) node.disabled = !hasOrbit;
    this.button.title = hasOrbit ? "Play one orbit of the camera (space)" : "This camera does not circle the spin axis";
  }
  show(orbit) {
    this.stripBox.hidden = false;
    if (this.wanted !== null) this.choose(this.wanted);
    if (!this.running) return;
    this.moment = this.nearestMoment(orbit);
    this.running.from = null;
  }
  drop() {
    this.stripBox.hidden = true;
    this.clock.textContent = "";
    this.explorer.recording.stop();
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
  get seconds() {
    return ORBIT_SECONDS / this.speed;
  }
  setSpeed(speed) {
    this.speed = speed;
    // From where it is.
    if (this.running) this.running.from = null;
  }
  stop() {
    this.wanted = null;
    if (!this.running) return;
    this.running = null;
    this.button.textContent = "▶ Play one orbit";
    if (!this.explorer.model.orbit) this.clock.textContent = "";
    this.explorer.settleStar();
  }
  // Whether somebody waits for the tracks.
  get isWaiting() {
    return !!this.running || this.wanted !== null || this.explorer.recording.wanted;
  }
  // While the tracks are to come.
  wait(progress, seconds) {
    if (!this.isWaiting || this.explorer.model.orbit) return;
    const work = progress ? `: ${progress.stage}` : "";
    this.clock.textContent = `finding the tracks … ${Math.floor(seconds)} s${work}`;
  }
  step(now) {
    const { running } = this;
    if (!running || !this.explorer.model.orbit) return;
    if (running.from === null) running.from = now - this.moment * this.seconds * 1000;
    const moment = mod((now - running.from) / 1000 / this.seconds, 1);
    running.part = (running.part ?? 0) + mod(moment - this.moment, 1);
    this.moment = moment;
    this.explorer.showMoment(this.moment);
    if (running.part >= 1) this.stop();
  }
  tell(part, period) {
    this.slider.value = Math.round(part * MOMENTS);
    this.slider.setAttribute("aria-valuetext", `${(100 * part).toFixed(1)} % of the orbit`);
    this.clock.textContent = `t = ${(part * period).toFixed(1)} M of ${period.toFixed(1)} M`;
  }
  scrub(event) {
    if (!this.explorer.model.orbit || !(event.buttons & 1)) return;
    const { left, width, height } = this.canvas.getBoundingClientRect();
    const f = this.strip.frame(width, height);
    this.choose(clamp((event.clientX - left - f.x) / f.w, 0, 0.9999));
  }
  // A moment that the user chooses; the tracks may have to be found first.
  choose(part) {
    const { orbit } = this.explorer.model;
    this.wanted = orbit ? null : part;
    if (!orbit) return this.explorer.ask("orbit");
    this.seek(part);
    if (!this.running) this.explorer.settleStar();
  }
  seek(part) {
    this.moment = part;
    if (this.running) this.running.from = null;
    this.explorer.showMoment(part);
    this.explorer.redraw();
  }
}
