// Pictures, numbers and links to take away.

const [EXPORT_WIDTH, EXPORT_HEIGHT] = [1240, 720];
// Of the panels in it: the upper side, the height, and the left sides and widths.
const [PANELS_TOP, PANELS_HEIGHT] = [62, 590];
const PANELS = { sky: [10, 600], source: [630, 600] };

function captionOf({ spin, radius, inclination, velocity, theta, phi, size }) {
  const camera = `a = ${spin}, r = ${radius} M, inclination ${inclination}°, ${velocity}`;
  const disc = size ? `, radius ${short(size)}°` : "";
  return `${camera}; star at θ′ = ${short(theta, 6)}°, φ′ = ${short(phi, 6)}°${disc}`;
}

// The name of a file, by what is in it.
function fileNameOf({ spin, radius, theta, phi }, ending) {
  return `kerr_a${spin}_r${radius}_theta${round(theta, 7)}_phi${round(phi, 7)}.${ending}`;
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
    const link = h("a", { href: URL.createObjectURL(blob), download: fileNameOf(this.explorer.state, ending) });
    this.explorer.page.root.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
  picture(pen) {
    const { model, sky, source } = this.explorer;
    const look = { ...this.explorer.screen.look(), flashes: [], dragging: false, invites: false };
    const { ink, soft, edge } = look.colours;
    const words = (x, y, text, size, more) => pen.text(x, y, text, { fill: ink, size, align: "left", ...more });
    words(20, 20, captionOf(model.state), 15);
    words(20, 47, "Camera sky; circles: degrees from the middle of the shadow", 13, { weight: 600 });
    words(640, 47, "Celestial sphere", 13, { weight: 600 });
    for (const [panel, [x, w]] of [[sky, PANELS.sky], [source, PANELS.source]])
      pen.group(x, PANELS_TOP, () => panel.draw(pen, w, PANELS_HEIGHT, model, look));
    const [x, w] = PANELS.sky;
    pen.line(box(x, PANELS_TOP, w, PANELS_HEIGHT), { stroke: edge, width: 1, closed: true });
    const [counted, ...more] = this.explorer.lines;
    words(20, 672, counted, 14, { weight: 600 });
    more.forEach((line, i) => words(20, 691 + 16 * i, line, 11, { fill: soft }));
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
