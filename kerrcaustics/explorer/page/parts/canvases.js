// Panels on canvases: what does not move with the star is drawn when it changes, and kept.

function sizeOf(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  return { w: Math.max(60, width), height: Math.max(60, height) };
}

function sized(canvas, w, height, ratio) {
  const [wide, high] = [Math.round(w * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, w, height);
  return new CanvasPen(context, FONTS);
}

class Canvases {
  constructor() {
    this.layers = new Map();
  }
  paint(canvas, panel, model, look, version) {
    const { w, height } = sizeOf(canvas);
    const ratio = Math.min(3, devicePixelRatio || 1);
    const pen = sized(canvas, w, height, ratio);
    const key = [canvas.width, canvas.height, panel.key(), version, ...stillKey(model, look)].join("|");
    pen.c.drawImage(this.layer(panel, key, w, height, ratio, model, look), 0, 0, w, height);
    panel.live(pen, w, height, model, look);
  }
  layer(panel, key, ...rest) {
    const kept = this.layers.get(panel);
    if (kept?.key === key) return kept.canvas;
    const [w, height, ratio, model, look] = rest;
    const canvas = kept?.canvas ?? h("canvas");
    panel.still(sized(canvas, w, height, ratio), w, height, model, look);
    this.layers.set(panel, { key, canvas });
    return canvas;
  }
}

const stillKey = (model, look) => [
  look.dark,
  look.draft,
  look.backdrop,
  !!model.lensed,
  model.orbit && model.state.theta,
];

// What is nearest to a place of a panel, within reach.
function nearest(panel, canvas, model, x, y, reach) {
  const { w, height } = sizeOf(canvas);
  const size = ({ image, star, event, cusp }) => (image || star || event ? 8 : cusp ? 4 : 0);
  let [best, gap] = [null, reach];
  for (const thing of panel.things(model, w, height)) {
    const distance = Math.hypot(thing.at[0] - x, thing.at[1] - y) - size(thing);
    if (distance < gap) [best, gap] = [thing, distance];
  }
  return best;
}
