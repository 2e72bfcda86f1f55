// When panels are drawn, and in which light: once a picture of the screen at most.

const FLASH = 1100;

class Screen {
  constructor(explorer) {
    Object.assign(this, { explorer, theme: "auto", flashes: [], drawn: 0, questions: [], pending: false });
    this.canvases = new Canvases();
    this.latencies = { star: [], draft: [], full: [] };
  }
  get isDark() {
    return this.theme === "auto" ? matchMedia("(prefers-color-scheme: dark)").matches : this.theme === "dark";
  }
  get colours() {
    return COLOURS[this.isDark ? "dark" : "light"];
  }
  switchTheme() {
    this.theme = this.isDark ? "light" : "dark";
    this.explorer.page.root.dataset.theme = this.theme;
    this.explorer.recolour();
  }
  look() {
    const { state, model, freshness, dragging, playback } = this.explorer;
    const draft = freshness.curves === "coarse";
    const backdrop = state.backdrop !== "none";
    const seen = { backdrop, hasPicture: !!model.lensed, draft, dragging, moment: playback.moment, invites: this.explorer.invitation.isOnStar && !!model.axes };
    return { colours: this.colours, dark: this.isDark, flashes: this.flashes, ...seen };
  }
  flash(pair, sky) {
    this.flashes.push({ ...pair, sky, since: performance.now(), part: 0 });
  }
  redraw(question) {
    if (question) this.questions.push(question);
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => this.draw(now));
  }
  draw(now) {
    this.pending = false;
    this.explorer.playback.step(now);
    this.fade(now);
    this.paint();
    this.drawn += 1;
    this.measure();
    if (this.explorer.playback.running || this.flashes.length) this.redraw();
  }
  fade(now) {
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.flashes = this.flashes.filter(({ since }) => now - since < FLASH);
    for (const flash of this.flashes) flash.part = still ? 0.3 : clamp((now - flash.since) / FLASH, 0, 1);
  }
  paint() {
    const { page, sky, source, playback, model, shown } = this.explorer;
    const look = this.look();
    if (this.skyKey !== sky.key()) this.zoomed();
    this.skyKey = sky.key();
    const paint = (canvas, panel) => this.canvases.paint(canvas, panel, model, look, shown.version);
    paint(page.left.canvas, sky);
    paint(page.right.canvas, source);
    if (!playback.stripBox.hidden) paint(playback.canvas, playback.strip);
    page.spectrumBox.hidden = !model.waves;
    if (model.waves) paint(page.spectrumBox.firstChild, page.spectrum);
  }
  // The camera sky was zoomed or moved: its picture follows when it stands still.
  zoomed() {
    clearTimeout(this.zooming);
    this.zooming = setTimeout(() => this.explorer.isWhole && this.explorer.backdrop.ask(), 300);
  }
  measure() {
    for (const { want, since } of this.questions) {
      const list = this.latencies[want];
      if (list?.push(performance.now() - since) > 1000) list.shift();
    }
    this.questions = [];
  }
}
