// Pointers on a panel: they move the star, move and zoom what is shown, and read numbers.

// Moves wait for the next picture; where the browser tells them at once, the question leaves half a picture earlier.
const EARLY = typeof window !== "undefined" && "onpointerrawupdate" in window && isSecureContext;

class Pointers {
  constructor(explorer, canvas, panel, hasStar) {
    Object.assign(this, { explorer, canvas, panel, hasStar, mode: null, moved: 0, down: new Map() });
    const on = (name, act, more) => canvas.addEventListener(name, act, more);
    on("touchstart", (e) => this.touched(e), { passive: false });
    on("pointerdown", (e) => this.pressed(e));
    if (EARLY) on("pointerrawupdate", (e) => this.dragStar(e));
    on("pointermove", (e) => this.move(e));
    on("pointerup", (e) => this.up(e));
    on("pointercancel", (e) => this.up(e));
    on("pointerleave", () => explorer.page.tip.hide());
    on("dblclick", () => this.reset());
    on("wheel", (e) => this.wheel(e), { passive: false });
  }
  spot({ clientX, clientY }) {
    const { left, top } = this.canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }
  frame() {
    const { w, height } = sizeOf(this.canvas);
    return this.panel.frame(w, height);
  }
  isOnStar([x, y], reach) {
    if (!this.hasStar) return false;
    const isNear = ({ at, back }) => !back && Math.hypot(at[0] - x, at[1] - y) < reach;
    return this.panel.starSpots(this.explorer.state, this.frame()).some(isNear);
  }
  // A finger moves the page up and down, but for the star, and two fingers.
  touched(event) {
    if (event.touches.length > 1 || this.isOnStar(this.spot(event.touches[0]), 32)) event.preventDefault();
  }
  pressed(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    this.down.set(event.pointerId, this.spot(event));
    this.moved = 0;
    this.explorer.page.tip.hide();
    const onStar = this.isOnStar(this.spot(event), event.pointerType === "touch" ? 32 : 18);
    this.mode = this.down.size > 1 ? "pinch" : onStar ? "star" : "pan";
    this.explorer.drags(this.mode === "star");
  }
  dragStar(event) {
    if (this.mode === "star" && this.down.has(event.pointerId)) this.moveStar(event);
  }
  moveStar(event) {
    const celestial = this.panel.under(...this.spot(event), this.frame());
    if (celestial) this.explorer.moveStar(...celestial, event.timeStamp);
  }
  move(event) {
    const [x, y] = this.spot(event);
    const before = this.down.get(event.pointerId);
    if (!before) return this.hover(event);
    this.moved += Math.hypot(x - before[0], y - before[1]);
    if (this.mode === "star") {
      if (!EARLY) this.dragStar(event);
    } else {
      if (this.mode === "pinch" && this.down.size === 2) this.pinch(event.pointerId, [x, y], before);
      else if (this.mode === "pan") this.panel.pan(x - before[0], y - before[1], this.frame());
      this.explorer.redraw();
    }
    this.down.set(event.pointerId, [x, y]);
  }
  pinch(pointer, [x, y], before) {
    const [[, other]] = [...this.down].filter(([id]) => id !== pointer);
    const gap = ([a, b]) => Math.max(1, Math.hypot(a - other[0], b - other[1]));
    this.panel.zoom(gap([x, y]) / gap(before), (x + other[0]) / 2, (y + other[1]) / 2, this.frame());
  }
  up(event) {
    if (!this.down.delete(event.pointerId)) return;
    const isClick = this.mode === "pan" && this.moved < 4 && event.type === "pointerup";
    if (this.hasStar && isClick) this.moveStar(event);
    if (this.down.size) return;
    const wasStar = this.mode === "star";
    this.mode = null;
    this.explorer.drags(false);
    if (wasStar) this.explorer.settleStar();
  }
  reset() {
    this.panel.reset();
    this.explorer.redraw();
  }
  wheel(event) {
    if (!this.explorer.options.wholePage && !event.ctrlKey && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.panel.zoom(Math.exp(-clamp(event.deltaY, -120, 120) * 0.003), ...this.spot(event), this.frame());
    this.explorer.redraw();
  }
  hover(event) {
    const [x, y] = this.spot(event);
    const thing = nearest(this.panel, this.canvas, this.explorer.model, x, y, 9);
    this.canvas.style.cursor = thing?.star ? "grab" : thing ? "help" : "default";
    if (thing) this.explorer.page.tip.show(about(thing), event);
    else this.explorer.page.tip.hide();
  }
}

class Tip {
  constructor() {
    this.element = h("div", { class: "kc-tip", role: "tooltip", hidden: true });
  }
  hide() {
    this.element.hidden = true;
  }
  show(lines, { clientX, clientY }) {
    this.element.replaceChildren(...lines.map((line, i) => h(i ? "span" : "b", {}, line)));
    this.element.hidden = false;
    const { left, top, width } = this.element.offsetParent.getBoundingClientRect();
    this.element.style.left = `${clamp(clientX - left + 14, 4, Math.max(4, width - 250))}px`;
    this.element.style.top = `${clientY - top + 16}px`;
  }
}

// Keys of the page: arrows move the star, brackets change the spin, space plays.
class Keys {
  constructor(explorer, target) {
    this.explorer = explorer;
    this.target = target;
    this.handlers = { keydown: (e) => this.pressed(e), keyup: (e) => this.released(e) };
    for (const [name, act] of Object.entries(this.handlers)) this.target.addEventListener(name, act);
  }
  leave() {
    for (const [name, act] of Object.entries(this.handlers)) this.target.removeEventListener(name, act);
  }
  pressed(event) {
    const into = event.target.closest?.("input, select, textarea, button, summary, pre");
    if (into || event.ctrlKey || event.metaKey || event.altKey) return;
    if (this.acts(event)) event.preventDefault();
  }
  acts(event) {
    const size = event.shiftKey ? 0.1 : 1;
    const moves = { ArrowLeft: [0, -size], ArrowRight: [0, size], ArrowUp: [-size, 0], ArrowDown: [size, 0] };
    const move = moves[event.key];
    const { state } = this.explorer;
    if (move) this.explorer.moveStar(this.height(move[0]), state.phi + sideOf(state) * move[1], event.timeStamp);
    else if ("[]{}".includes(event.key)) this.turnSpin(event);
    else if (event.key === " ") this.explorer.playback.toggle();
    else return false;
    return true;
  }
  // The height of the star a step away, or the next one where there are few.
  height(step) {
    const { state, channel } = this.explorer;
    if (!channel.offered || !step) return state.theta + step;
    const beyond = channel.offered.thetas.filter((theta) => (theta - state.theta) * step > 0);
    return beyond.length ? (step > 0 ? Math.min(...beyond) : Math.max(...beyond)) : state.theta;
  }
  turnSpin({ key, repeat, timeStamp }) {
    const step = ("[{".includes(key) ? -1 : 1) * ("[]".includes(key) ? 0.05 : 0.005);
    if (this.explorer.channel.offered) return;
    const u = clamp(spinPlace(this.explorer.state.spin) + step, 0, SPIN_END);
    this.explorer.change({ spin: round(1 - 10 ** -u, 6) }, repeat ? "draft" : "full", timeStamp);
  }
  released(event) {
    if ("[]{}".includes(event.key) && !this.explorer.isWhole) this.explorer.ask("full");
  }
}
