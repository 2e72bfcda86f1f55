// The elements of the page, and what users do with them.

const PRESET_TITLE = "Presets …";
const HELP =
  "Drag the star; drag or pinch elsewhere to move and zoom. Keys: arrows move the star (with Shift, a tenth as far), " +
  "[ and ] change the spin, space plays. Filled images have even parity. Errors are estimates, and counts are " +
  "certified when the search and the winding of the caustics agree.";

class Page {
  constructor(explorer) {
    this.explorer = explorer;
    this.tip = new Tip();
    this.presets = [];
    this.help = h("p", { class: "kc-help" }, HELP);
    this.preset = select("Presets", [["", PRESET_TITLE]], (name) => this.choosePreset(name));
    this.makePanels();
    this.root = this.layout();
    this.terms = new Terms(this.root, this.tip);
  }
  makePanels() {
    const { explorer } = this;
    const charts = ["map", "unwrapped", "globe"].map((name) => [name, name]);
    this.charts = select("Chart of the celestial sphere", charts, (chart) => explorer.lookAt({ chart }));
    const left = canvasOf("camera", "The camera sky");
    const right = canvasOf("celestial", "The celestial sphere, with the star");
    this.left = panelOf("camera", term("camera sky", "Camera sky"), left, this.zooms(explorer.sky, left));
    const other = () => (explorer.state.sphere === "outside" ? "inside" : "outside");
    this.turn = button("⇄", "", () => explorer.lookAt({ sphere: other() }));
    const tools = [this.charts, this.turn, ...this.zooms(explorer.source, right)];
    this.spectrum = new Spectrum();
    const spectrum = canvasOf("spectrum", "Modulus of the star's waves, by frequency");
    this.spectrumBox = h("section", { class: "kc-strip-box", hidden: true }, spectrum);
    this.right = panelOf("celestial", term("celestial sphere", "Celestial sphere"), right, tools);
  }
  tellSide(state) {
    const label = `The sphere is ${seenFrom(state)}: turn it over`;
    Object.assign(this.turn, { title: label, ariaLabel: label });
  }
  zooms(panel, canvas) {
    const zoom = (factor) => () => {
      const { w, height } = sizeOf(canvas);
      panel.zoom(factor, w / 2, height / 2, panel.frame(w, height));
      this.explorer.redraw();
    };
    const all = () => {
      panel.reset();
      this.explorer.redraw();
    };
    return [button("−", "Zoom out", zoom(1 / 1.5)), button("+", "Zoom in", zoom(1.5)), button("⤢", "Show all", all)];
  }
  layout() {
    const { controls, tables, playback, exports, status, tour, quiz, recording } = this.explorer;
    playback.bar.append(recording.button);
    const panels = h("div", { class: "kc-panels" }, status.work, this.left.element, this.right.element);
    const words = [tables.live, tables.element, tables.details];
    const parts = [this.explorer.invitation.element, tour.element, quiz.element, panels, playback.bar, playback.stripBox, this.spectrumBox, ...words];
    const stage = h("div", { class: "kc-stage" }, ...parts, this.help);
    const title = h("h1", {}, "Kerr caustics");
    const teaching = [tour.button, quiz.button];
    const head = h("header", { class: "kc-head" }, title, this.preset, ...teaching, status.badge, exports.element);
    const body = h("div", { class: "kc-body" }, controls.element, stage);
    const embeds = this.explorer.options.embeds ? " kc-embed" : "";
    return h("div", { class: `kc-explorer${embeds}` }, head, status.banner, body, this.tip.element);
  }
  // Once the page is in the document.
  connect() {
    const { explorer } = this;
    new Pointers(explorer, this.left.canvas, explorer.sky, false);
    new Pointers(explorer, this.right.canvas, explorer.source, true);
    this.keys = new Keys(explorer, explorer.options.wholePage ? document : this.root);
    this.resized = new ResizeObserver(() => explorer.redraw());
    for (const { canvas } of [this.left, this.right, explorer.playback]) this.resized.observe(canvas);
    this.fitted = new ResizeObserver(([{ contentRect }]) => explorer.controls.fit(contentRect.width));
    this.fitted.observe(this.root);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => explorer.recolour();
    this.scheme.addEventListener("change", this.recolour);
  }
  leave() {
    this.resized.disconnect();
    this.fitted.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
    this.keys.leave();
    this.explorer.status.leave();
  }
  offer(presets, lessons) {
    this.presets = presets;
    this.preset.hidden = !presets.length && !lessons.length;
    const group = (label, list) => {
      const names = list.map(({ name }) => h("option", { value: name }, name));
      return list.length ? [h("optgroup", { label }, ...names)] : [];
    };
    const groups = [...group("Ideas", lessons), ...group("Cameras and stars", presets)];
    this.preset.replaceChildren(h("option", { value: "" }, PRESET_TITLE), ...groups);
  }
  explain(meanings) {
    this.terms.meanings = meanings;
    this.help.replaceChildren(...this.terms.marked(HELP));
  }
  choosePreset(name) {
    const { explorer, presets } = this;
    const step = explorer.tour.lessons.findIndex((lesson) => lesson.name === name);
    const chosen = presets.find((preset) => preset.name === name);
    this.preset.value = "";
    if (step >= 0) return explorer.tour.show(step);
    explorer.tour.close();
    explorer.invitation.close();
    if (chosen) explorer.visit(chosen.state);
  }
}
