// The elements of the page, and what users do with them.

const PRESET_TITLE = "Presets: figures of JTFT …";
const HELP =
  "Drag the star; drag or pinch elsewhere to move and zoom. Keys: arrows move the star (with Shift a tenth), [ and ] " +
  "change the spin, space plays. Filled images have even parity. Errors are estimates, and counts are certified when " +
  "the search and the winding of the caustics agree.";

class Page {
  constructor(explorer) {
    this.explorer = explorer;
    this.tip = new Tip();
    this.presets = [];
    this.preset = select("Presets", [["", PRESET_TITLE]], (name) => this.choosePreset(name));
    this.makePanels();
    this.root = this.layout();
  }
  makePanels() {
    const { explorer } = this;
    const charts = ["map", "unwrapped", "globe"].map((name) => [name, name]);
    this.charts = select("Chart of the celestial sphere", charts, (chart) => explorer.chooseChart(chart));
    const left = canvasOf("camera", "The camera sky");
    const right = canvasOf("celestial", "The celestial sphere, with the star");
    this.left = panelOf("camera", "Camera sky", left, this.zooms(explorer.sky, left));
    const tools = [this.charts, ...this.zooms(explorer.source, right)];
    this.right = panelOf("celestial", "Celestial sphere", right, tools);
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
    const { controls, tables, playback, exports, status } = this.explorer;
    const panels = h("div", { class: "kc-panels" }, status.work, this.left.element, this.right.element);
    const parts = [panels, playback.bar, playback.stripBox, tables.live, tables.element, tables.details];
    const stage = h("div", { class: "kc-stage" }, ...parts, h("p", { class: "kc-help" }, HELP));
    const title = h("h1", {}, "Kerr caustics");
    const head = h("header", { class: "kc-head" }, title, this.preset, status.badge, exports.element);
    const body = h("div", { class: "kc-body" }, controls.element, stage);
    return h("div", { class: "kc-explorer" }, head, status.banner, body, this.tip.element);
  }
  // Once the page is in the document.
  connect() {
    const { explorer } = this;
    new Pointers(explorer, this.left.canvas, explorer.sky, false);
    new Pointers(explorer, this.right.canvas, explorer.source, true);
    this.keys = new Keys(explorer, explorer.options.wholePage ? document : this.root);
    this.resized = new ResizeObserver(() => explorer.redraw());
    for (const { canvas } of [this.left, this.right, explorer.playback]) this.resized.observe(canvas);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => explorer.recolour();
    this.scheme.addEventListener("change", this.recolour);
  }
  leave() {
    this.resized.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
    this.keys.leave();
    this.explorer.status.leave();
  }
  offer(presets) {
    this.presets = presets;
    this.preset.hidden = !presets.length;
    const names = presets.map(({ name }) => h("option", { value: name }, name));
    this.preset.replaceChildren(h("option", { value: "" }, PRESET_TITLE), ...names);
  }
  choosePreset(name) {
    const chosen = this.presets.find((preset) => preset.name === name);
    if (chosen) this.explorer.show(chosen.state);
    this.preset.value = "";
  }
}
