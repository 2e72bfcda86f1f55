// Pictures, numbers and links to take away.

const [EXPORT_WIDTH, EXPORT_HEIGHT] = [1240, 640];

function captionOf({ spin, radius, inclination, velocity, theta, phi, size }) {
  const camera = `a = ${spin}, r = ${radius} M, inclination ${inclination}°, ${velocity}`;
  const disc = size ? `, radius ${short(size)}°` : "";
  return `${camera}; star at θ′ = ${short(theta, 6)}°, φ′ = ${short(phi, 6)}°${disc}`;
}

class Exports {
  constructor(explorer) {
    this.explorer = explorer;
    this.takers = [
      button("PNG", "Export a PNG picture", () => this.png()),
      button("SVG", "Export an SVG picture", () => this.svg()),
      button("JSON", "Export the numbers as JSON", () => this.json()),
    ];
    const link = button("Copy link", "Copy a link to this state", () => this.copyLink());
    const theme = button("◐", "Light or dark", () => explorer.screen.switchTheme());
    const hidden = !document.fullscreenEnabled;
    const screen = button("Full screen", "Full screen", () => this.fullScreen(), { hidden });
    this.element = h("div", { class: "kc-exports" }, ...this.takers, link, theme, screen);
  }
  // Only what belongs together is taken away.
  allow(isWhole) {
    for (const node of this.takers) node.disabled = !isWhole;
  }
  deliver(blob, ending) {
    const { spin, radius } = this.explorer.state;
    const link = h("a", { href: URL.createObjectURL(blob), download: `kerr_a${spin}_r${radius}.${ending}` });
    this.explorer.page.root.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
  picture(pen) {
    const { model, sky, source } = this.explorer;
    const look = { ...this.explorer.screen.look(), flashes: [], dragging: false };
    pen.text(20, 20, captionOf(model.state), { fill: look.colours.ink, size: 15, align: "left" });
    pen.group(10, 40, () => sky.draw(pen, 600, 590, model, look));
    pen.group(630, 40, () => source.draw(pen, 600, 590, model, look));
  }
  png() {
    const { canvas, draw } = this.paper(2);
    draw();
    canvas.toBlob((blob) => this.deliver(blob, "png"), "image/png");
  }
  // A canvas for the picture, as it is each time that it is drawn.
  paper(ratio) {
    const canvas = h("canvas");
    // Kept where pixels are read.
    canvas.getContext("2d", { willReadFrequently: true });
    const [w, height] = [EXPORT_WIDTH * ratio, EXPORT_HEIGHT * ratio];
    const draw = () => {
      const pen = sized(canvas, EXPORT_WIDTH, EXPORT_HEIGHT, ratio);
      const fill = this.explorer.screen.look().colours.paper;
      pen.line(box(0, 0, EXPORT_WIDTH, EXPORT_HEIGHT), { fill, closed: true });
      this.picture(pen);
      return pen;
    };
    return { canvas, w, height, draw, pixels: () => draw().c.getImageData(0, 0, w, height).data };
  }
  fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.explorer.page.root.requestFullscreen();
  }
  svg() {
    const pen = new SvgPen(EXPORT_WIDTH, EXPORT_HEIGHT, FONTS);
    this.picture(pen);
    this.deliver(new Blob([pen.whole(this.explorer.screen.look().colours.paper)], { type: "image/svg+xml" }), "svg");
  }
  json() {
    const text = JSON.stringify(recordOf(this.explorer), null, 1);
    this.deliver(new Blob([text], { type: "application/json" }), "json");
  }
  async copyLink() {
    const { channel, state, status } = this.explorer;
    const link = channel.link?.() ?? `#${fragmentOf(state)}`;
    try {
      await navigator.clipboard.writeText(link);
      status.notify("The link was copied.");
    } catch {
      status.notify(link);
    }
  }
}

function recordOf({ shown, state, model }) {
  const { arrays: _, id: __, want: ___, ...view } = shown.view.answer;
  const { images, commands, python, address } = shown.images.answer ?? {};
  const star = { state: { ...state }, images: images ?? model.images, commands, python, address };
  const curves = model.curves.map(({ order, sky, celestial }) => ({ order, sky, celestial_deg: celestial }));
  const { arrays: ____, limbs: _____, key: ______, ...seen } = model.shapes ?? {};
  const { arrays: _______, key: ________, ...heard } = model.waves ?? {};
  const light = { ...(model.shapes && { magnification: seen }), ...(model.waves && { amplification: heard }) };
  return { schema: "kerrcaustics/explorer/1", ...view, ...star, ...light, curves };
}
