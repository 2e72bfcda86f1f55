// The explorer: draws what it is told of a state, and asks when the state changes. Loads nothing.
//
// mount(element, channel, options) shows it. A channel has
//   send(text)      asks a question {"id", "want", "state"};
//   listen(heard)   heard(bytes) is called with each answer (see Message.encoded in view.py);
//   state           values to begin with; remember(state), link(): optional.

const RAD = Math.PI / 180;
const TURN = 360;
const DEFAULTS = { spin: 0.999, radius: 6.03, inclination: 90, velocity: "circular", orders: 3, theta: 84, phi: 60, backdrop: "none", chart: "map" };
// Colours of Okabe and Ito: told apart by colour-blind readers. Index k has the colour of the critical curve of order k.
const COLOURS = {
  light: { order: ["#b07400", "#0072b2", "#c44e00", "#00795a", "#a8467d"], ink: "#1c2330", soft: "#68748a", grid: "#d8dee8", shadow: "#dfe3ea", edge: "#8791a3", paper: "#ffffff", star: "#e69f00", halo: "#ffffff" },
  dark: { order: ["#f2c14e", "#56b4e9", "#ff8a3d", "#2fd0a0", "#ec9fce"], ink: "#eef2f8", soft: "#97a3b8", grid: "#293142", shadow: "#04060a", edge: "#5c677c", paper: "#10151f", star: "#ffc83d", halo: "#10151f" },
};
const DASHES = [[], [], [9, 3], [2.5, 2.5], [9, 3, 2, 3]];
const NAMES = ["", "primary", "secondary", "tertiary", "4th order"];
const FLASH = 1100;
// Behind curves a picture is as bright as this, and curves have a dark outline.
const DIM = 0.72;
const OUTLINE = { stroke: "#000000", width: 4.5, alpha: 0.55 };
const ORBIT_SECONDS = 16;

// ---- small things ----------------------------------------------------------------------------------------------

const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
const mod = (x, y) => ((x % y) + y) % y;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const apart = (a, b) => Math.acos(clamp(dot(a, b), -1, 1)) / RAD;
const middle = (a, b) => { const s = a.map((x, i) => x + b[i]); const n = Math.hypot(...s) || 1; return s.map((x) => x / n); };
const place = (theta, phi) => [Math.sin(theta * RAD) * Math.cos(phi * RAD), Math.sin(theta * RAD) * Math.sin(phi * RAD), Math.cos(theta * RAD)];
const horizon = (a) => 1 + Math.sqrt(1 - a * a);
const photonOrbit = (a) => 2 * (1 + Math.cos((2 / 3) * Math.acos(-a)));

function short(x, digits = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  return size >= 1e-3 && size < 1e5 ? String(Number(x.toPrecision(digits))) : raised(x.toExponential(Math.max(0, digits - 2)));
}

const raised = (text) => text.replace(/e\+?(-?)(\d+)$/, (_, sign, power) => `×10${sign ? "⁻" : ""}${[...power].map((d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]).join("")}`);

export function stateOf(fragment) {
  const given = new URLSearchParams(String(fragment).replace(/^#/, ""));
  const state = {};
  for (const [name, usual] of Object.entries(DEFAULTS)) {
    if (!given.has(name)) continue;
    const value = typeof usual === "number" ? Number(given.get(name)) : given.get(name);
    if (typeof usual !== "number" || Number.isFinite(value)) state[name] = value;
  }
  return state;
}

export function fragmentOf(state) {
  return Object.keys(DEFAULTS).map((name) => `${name}=${encodeURIComponent(typeof state[name] === "number" ? Number(state[name].toPrecision(12)) : state[name])}`).join("&");
}

export function decoded(bytes) {
  const view = bytes instanceof ArrayBuffer ? new DataView(bytes) : new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const size = view.getUint32(4, true);
  const record = JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, view.byteOffset + 8, size)));
  const arrays = {};
  for (const [name, { offset, type, shape }] of Object.entries(record.arrays)) {
    const count = shape.reduce((a, b) => a * b, 1);
    const from = view.byteOffset + 8 + size + offset;
    // A copy: the place in the message need not be a multiple of four.
    const data = view.buffer.slice(from, from + count * (type === "f4" ? 4 : 1));
    arrays[name] = { data: type === "f4" ? new Float32Array(data) : new Uint8Array(data), shape };
  }
  return { ...record, arrays };
}

const rows = ({ data, shape }) => Array.from({ length: shape[0] }, (_, i) => Array.from(data.subarray(i * shape[1], (i + 1) * shape[1])));

function h(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false && value !== undefined) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children);
  return node;
}

function ticks(low, high, most) {
  const step = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360, 720].find((s) => (high - low) / s <= most) ?? 1800;
  const found = [];
  for (let i = Math.ceil(low / step); i * step <= high; i++) found.push(Number((i * step).toFixed(6)));
  return found;
}

// ---- two pens: one draws on a canvas, one writes SVG -----------------------------------------------------------

class CanvasPen {
  constructor(context, fonts) { this.c = context; this.fonts = fonts; }
  set({ stroke, fill, width = 1, dash = [], alpha = 1 }) {
    const c = this.c;
    c.globalAlpha = alpha; c.lineWidth = width; c.setLineDash(dash); c.lineJoin = "round"; c.lineCap = "round";
    if (stroke) c.strokeStyle = stroke;
    if (fill) c.fillStyle = fill;
  }
  finish({ stroke, fill }) { if (fill) this.c.fill(); if (stroke) this.c.stroke(); this.c.globalAlpha = 1; }
  line(points, style) {
    this.set(style); this.c.beginPath();
    let pen = false;
    for (const p of points) { if (!p) { pen = false; continue; } if (pen) this.c.lineTo(p[0], p[1]); else this.c.moveTo(p[0], p[1]); pen = true; }
    if (style.closed) this.c.closePath();
    this.finish(style);
  }
  disk(x, y, r, style) { this.set(style); this.c.beginPath(); this.c.arc(x, y, r, 0, 2 * Math.PI); this.finish(style); }
  text(x, y, words, { fill, size = 12, align = "center", weight = 400, halo }) {
    const c = this.c;
    c.font = `${weight} ${size}px ${this.fonts}`; c.textAlign = align; c.textBaseline = "middle"; c.globalAlpha = 1;
    if (halo) { c.strokeStyle = halo; c.lineWidth = 3; c.setLineDash([]); c.lineJoin = "round"; c.strokeText(words, x, y); }
    c.fillStyle = fill; c.fillText(words, x, y);
  }
  picture(image, x, y, w, height, alpha) { this.c.globalAlpha = alpha; this.c.drawImage(image, x, y, w, height); this.c.globalAlpha = 1; }
  within(x, y, w, height, draw) { const c = this.c; c.save(); c.beginPath(); c.rect(x, y, w, height); c.clip(); draw(); c.restore(); }
}

class SvgPen {
  constructor(width, height, fonts) { this.width = width; this.height = height; this.fonts = fonts; this.parts = []; this.clips = 0; this.at = [0, 0]; }
  paint({ stroke, fill, width = 1, dash = [], alpha = 1 }) {
    return `fill="${fill ?? "none"}"${stroke ? ` stroke="${stroke}" stroke-width="${width}" stroke-linejoin="round" stroke-linecap="round"` : ""}${dash.length ? ` stroke-dasharray="${dash}"` : ""}${alpha < 1 ? ` opacity="${alpha}"` : ""}`;
  }
  line(points, style) {
    let path = "", pen = false;
    for (const p of points) { if (!p) { pen = false; continue; } path += `${pen ? "L" : "M"}${p[0].toFixed(2)} ${p[1].toFixed(2)}`; pen = true; }
    if (path) this.parts.push(`<path d="${path}${style.closed ? "Z" : ""}" ${this.paint(style)}/>`);
  }
  disk(x, y, r, style) { this.parts.push(`<circle cx="${x.toFixed(2)}" cy="${y.toFixed(2)}" r="${r.toFixed(2)}" ${this.paint(style)}/>`); }
  text(x, y, words, { fill, size = 12, align = "center", weight = 400, halo }) {
    const anchor = { left: "start", center: "middle", right: "end" }[align];
    const safe = String(words).replace(/[&<>]/g, (s) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[s]);
    this.parts.push(`<text x="${x.toFixed(1)}" y="${(y + size * 0.35).toFixed(1)}" font-family="${this.fonts.replace(/"/g, "'")}" font-size="${size}" font-weight="${weight}" text-anchor="${anchor}" fill="${fill}"${halo ? ` stroke="${halo}" stroke-width="3" paint-order="stroke"` : ""}>${safe}</text>`);
  }
  picture(image, x, y, w, height, alpha) {
    const canvas = h("canvas"); canvas.width = image.width; canvas.height = image.height;
    canvas.getContext("2d").drawImage(image, 0, 0);
    this.parts.push(`<image href="${canvas.toDataURL("image/jpeg", 0.85)}" x="${x}" y="${y}" width="${w}" height="${height}" opacity="${alpha}" preserveAspectRatio="none"/>`);
  }
  within(x, y, w, height, draw) {
    const name = `c${this.clips++}`;
    this.parts.push(`<clipPath id="${name}"><rect x="${x}" y="${y}" width="${w}" height="${height}"/></clipPath><g clip-path="url(#${name})">`);
    draw(); this.parts.push("</g>");
  }
  group(x, y, draw) { this.parts.push(`<g transform="translate(${x} ${y})">`); draw(); this.parts.push("</g>"); }
  whole(paper) { return `<svg xmlns="http://www.w3.org/2000/svg" width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}"><rect width="100%" height="100%" fill="${paper}"/>${this.parts.join("\n")}</svg>\n`; }
}

// ---- what is drawn: one record of all that the panels need -------------------------------------------------------

function curvesOf(view) {
  return view.caustics.map((told) => ({ ...told, sky: rows(view.arrays[`critical${told.order}`]), celestial: rows(view.arrays[`caustic${told.order}`]) }));
}

export function orbitOf(answer) {
  const { arrays } = answer;
  const numbers = rows(arrays.frame_numbers), sky = rows(arrays.frame_sky), first = arrays.first.data;
  const frames = Array.from(arrays.phi.data, (phi, i) => {
    const images = [];
    for (let j = first[i]; j < first[i + 1]; j++) images.push({ sky: sky[j], index: numbers[j][0], magnification: numbers[j][1], error: numbers[j][2] });
    return { phi, images, certified: arrays.frame_certified.data[i] === 1 };
  });
  const tracks = answer.tracks.map((told, i) => ({ ...told, sky: rows(arrays[`track${i}`]), light: rows(arrays[`light${i}`]) }));
  return { ...answer, frames, tracks };
}

function imagesOf({ images }) {
  return images.index.map((index, i) => ({ index, sky: images.sky[i], magnification: images.magnification[i], redshift: images.redshift[i], error: images.error[i], azimuth: images.azimuth[i] }));
}

function countsOf(images, most) {
  const counts = Array(most).fill(0);
  images.forEach(({ index }) => { counts[index] += 1; });
  return counts;
}

// Pairs that one set of images has more than the other, with the places where they are: the two that are closest to each
// other; of the highest order, one is seen, the closest to the curve. Index k changes by pairs of orders k and k + 1.
function pairsBorn(before, after, orders, curves) {
  const old = countsOf(before, orders), now = countsOf(after, orders), born = [];
  let pairs = 0;
  for (let order = 1; order <= orders; order++) {
    pairs = now[order - 1] - old[order - 1] - pairs;
    if (pairs > 0) born.push({ order, sky: placeOfPair(after, order, order === orders ? curves.find((c) => c.order === order)?.sky ?? [] : null) });
  }
  return born.filter(({ sky }) => sky);
}

function placeOfPair(images, order, curve) {
  const others = curve ?? images.filter(({ index }) => index === order).map(({ sky }) => sky);
  let best = 200, found = null;
  for (const { index, sky } of images) if (index === order - 1) for (const other of others) {
    const gap = apart(sky, other);
    if (gap < best) { best = gap; found = middle(sky, other); }
  }
  return found;
}

// ---- the camera sky ----------------------------------------------------------------------------------------------

class SkyPanel {
  constructor() { this.centre = [0, 0]; this.field = null; this.auto = 60; }
  reset() { this.centre = [0, 0]; this.field = null; }
  fit(model) {
    const outer = model.curves[0]?.sky ?? model.edge;
    if (!outer) return;
    let far = 0;
    for (const n of outer) far = Math.max(far, Math.hypot(...this.flat(n, model.axes)));
    this.auto = clamp(1.55 * far, 0.02, model.state.backdrop === "none" ? 185 : 125);
  }
  flat(n, axes) {
    const along = dot(n, axes[0]), right = dot(n, axes[1]), up = dot(n, axes[2]), across = Math.hypot(right, up);
    const scale = across > 0 ? Math.atan2(across, along) / RAD / across : 0;
    return [right * scale, up * scale];
  }
  frame(w, height) { const scale = Math.min(w, height) / 2 / (this.field ?? this.auto); return { w, height, scale, x: w / 2 - this.centre[0] * scale, y: height / 2 + this.centre[1] * scale }; }
  spot(n, axes, f) { const [x, y] = this.flat(n, axes); return [f.x + x * f.scale, f.y - y * f.scale]; }
  zoom(factor, x, y, f) {
    const field = clamp((this.field ?? this.auto) / factor, 1e-4, 190), grown = (this.field ?? this.auto) / field;
    const at = [(x - f.x) / f.scale, (f.y - y) / f.scale];
    this.centre = this.centre.map((c, i) => at[i] + (c - at[i]) / grown);
    this.field = field;
  }
  pan(dx, dy, f) { this.field ??= this.auto; this.centre = [this.centre[0] - dx / f.scale, this.centre[1] + dy / f.scale]; }
  path(points, axes, f, closed) {
    const spots = points.map((n) => this.spot(n, axes, f));
    if (closed && spots.length) spots.push(spots[0]);
    const far = 90 * f.scale, line = [];
    spots.forEach((p, i) => { if (i && Math.hypot(p[0] - spots[i - 1][0], p[1] - spots[i - 1][1]) > far) line.push(null); line.push(p); });
    return line;
  }
  key() { return [this.centre, this.field ?? this.auto].join(); }
  draw(pen, w, height, model, look) { this.still(pen, w, height, model, look); this.live(pen, w, height, model, look); }
  still(pen, w, height, model, look) {
    const f = this.frame(w, height), { axes } = model;
    if (!axes) return;
    const colours = look.colours, bright = model.lensed && look.backdrop;
    pen.within(0, 0, w, height, () => {
      if (bright) {
        const side = model.backdropField * f.scale;
        pen.line([[0, 0], [w, 0], [w, height], [0, height]], { fill: "#000000", closed: true });
        pen.picture(model.lensed, f.x - side / 2, f.y - side / 2, side, side, DIM);
      } else this.rings(pen, f, colours);
      pen.line(this.path(model.edge, axes, f, true), { fill: bright ? undefined : colours.shadow, stroke: bright ? "#8b95a8" : colours.edge, width: 1, closed: true });
      if (model.orbit) for (const track of model.orbit.tracks) pen.line(this.path(track.sky, axes, f, track.closed), { stroke: colours.soft, width: 1, alpha: 0.6 });
      for (const curve of model.curves) this.curve(pen, curve, axes, f, look, bright);
      for (const event of model.orbit?.events ?? []) this.event(pen, event, axes, f, look);
      this.legend(pen, model, height, bright ? COLOURS.dark : colours, bright);
    });
  }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height), { axes } = model;
    if (!axes) return;
    pen.within(0, 0, w, height, () => {
      for (const flash of look.flashes) this.flash(pen, flash, axes, f, look);
      [...model.images].sort((a, b) => b.index - a.index).forEach((image) => this.image(pen, image, axes, f, look));
    });
  }
  legend(pen, model, height, colours, bright) {
    model.curves.forEach(({ order }, i) => {
      const y = height - 12 - 17 * (model.curves.length - 1 - i);
      if (bright) pen.line([[8, y], [30, y]], OUTLINE);
      pen.line([[8, y], [30, y]], { stroke: colours.order[order], width: 1.8, dash: DASHES[order] });
      pen.text(36, y, NAMES[order], { fill: colours.ink, size: 11.5, align: "left", halo: colours.halo });
    });
  }
  rings(pen, f, colours) {
    const wide = Math.max(f.w, f.height) / f.scale;
    for (const angle of ticks(0, Math.min(180, wide), 5).slice(1)) {
      pen.disk(f.x, f.y, angle * f.scale, { stroke: colours.grid, width: 1 });
      const y = f.y + angle * f.scale;
      if (y < f.height - 6) pen.text(f.x, y, `${angle}°`, { fill: colours.soft, size: 11, halo: colours.halo });
    }
  }
  curve(pen, curve, axes, f, look, bright) {
    const colours = bright ? COLOURS.dark : look.colours;
    const style = { stroke: colours.order[curve.order], width: look.draft ? 1.2 : 1.8, dash: DASHES[curve.order], alpha: look.draft ? 0.75 : 1 };
    const line = this.path(curve.sky, axes, f, true);
    if (bright) pen.line(line, OUTLINE);
    pen.line(line, style);
    for (const cusp of curve.cusps) pen.disk(...this.spot(cusp.sky, axes, f), 2.4, { fill: colours.order[curve.order] });
  }
  event(pen, event, axes, f, look) {
    const [x, y] = this.spot(event.sky, axes, f);
    pen.line([[x - 4, y - 4], [x + 4, y + 4], null, [x - 4, y + 4], [x + 4, y - 4]], { stroke: look.colours.ink, width: 1.6 });
  }
  flash(pen, flash, axes, f, look) {
    const [x, y] = this.spot(flash.sky, axes, f), part = flash.part;
    pen.disk(x, y, 5 + 34 * part, { stroke: look.colours.star, width: 4 * (1 - part) + 0.5, alpha: 1 - part });
    pen.disk(x, y, 3 + 14 * part, { fill: look.colours.star, alpha: 0.6 * (1 - part) });
  }
  image(pen, image, axes, f, look) {
    let [x, y] = this.spot(image.sky, axes, f);
    const colours = look.backdrop && look.hasPicture ? COLOURS.dark : look.colours, colour = colours.order[image.index];
    const inside = x > 8 && x < f.w - 8 && y > 8 && y < f.height - 8;
    if (!inside) { this.away(pen, image, x, y, f, colours); return; }
    const r = imageSize(image.magnification), even = image.index % 2 === 0;
    pen.disk(x, y, r + 1.5, { fill: colours.halo });
    pen.disk(x, y, r, { fill: even ? colour : colours.halo, stroke: colour, width: 2 });
    if (r >= 7) pen.text(x, y + 0.5, String(image.index), { fill: even ? colours.halo : colour, size: Math.min(13, r + 4), weight: 700 });
    else {
      const [ax, ay] = this.flat(image.sky, axes), far = Math.hypot(ax, ay) || 1;
      pen.text(x + (ax / far) * (r + 9), y - (ay / far) * (r + 9), String(image.index), { fill: colour, size: 11, weight: 700, halo: colours.halo });
    }
  }
  away(pen, image, x, y, f, colours) {
    // Outside of what is shown: an arrow at the rim, which points to it.
    const cx = f.w / 2, cy = f.height / 2, reach = Math.min((f.w / 2 - 16) / Math.max(1, Math.abs(x - cx)), (f.height / 2 - 16) / Math.max(1, Math.abs(y - cy)));
    const px = cx + (x - cx) * reach, py = cy + (y - cy) * reach, turn = Math.atan2(y - cy, x - cx);
    const corner = (a, r) => [px + r * Math.cos(turn + a), py + r * Math.sin(turn + a)];
    const colour = colours.order[image.index];
    pen.line([corner(0, 11), corner(2.4, 9), corner(-2.4, 9)], { fill: colour, closed: true });
    pen.text(...corner(Math.PI, 15), String(image.index), { fill: colour, size: 11, weight: 700, halo: colours.halo });
  }
  things(model, w, height) {
    const f = this.frame(w, height), found = [];
    if (!model.axes) return found;
    for (const image of model.images) found.push({ at: this.spot(image.sky, model.axes, f), image });
    for (const event of model.orbit?.events ?? []) found.push({ at: this.spot(event.sky, model.axes, f), event });
    for (const curve of model.curves) {
      for (const cusp of curve.cusps) found.push({ at: this.spot(cusp.sky, model.axes, f), cusp, curve });
      curve.sky.forEach((n, i) => found.push({ at: this.spot(n, model.axes, f), curve, point: curve.celestial[i] }));
    }
    return found;
  }
}

const imageSize = (magnification) => clamp(8 + 3 * Math.log10(magnification || 1e-9), 3.5, 17);

// ---- the celestial sphere -----------------------------------------------------------------------------------------

class CelestialPanel {
  constructor() { this.chart = "map"; this.window = null; this.auto = [0, 360, 0, 180]; this.globe = { lon: 40, lat: 20, zoom: 1 }; }
  reset() { this.window = null; this.globe = { lon: 40, lat: 20, zoom: 1 }; }
  fit(model, chart) {
    if (chart !== this.chart) { this.chart = chart; this.window = null; }
    this.auto = [0, 360, 0, 180];
    if (chart === "unwrapped" && model.curves.length) {
      let low = Infinity, high = -Infinity;
      for (const curve of model.curves) for (const [, phi] of curve.celestial) { low = Math.min(low, phi); high = Math.max(high, phi); }
      const room = Math.max(40, 0.04 * (high - low), (360 - (high - low)) / 2);
      this.auto = [low - room, high + room, 0, 180];
    }
  }
  look(curve) {
    // The window that shows one caustic.
    let [a, b, c, d] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [theta, phi] of curve.celestial) { a = Math.min(a, phi); b = Math.max(b, phi); c = Math.min(c, theta); d = Math.max(d, theta); }
    const across = Math.max(0.1 * (b - a), 1e-4), up = Math.max(0.15 * (d - c), 1e-4), turns = this.chart === "map" ? TURN * Math.floor((a + b) / 2 / TURN) : 0;
    this.window = [a - across - turns, b + across - turns, c - up, d + up];
  }
  get shown() { return this.window ?? this.auto; }
  frame(w, height) {
    const margin = { left: 38, right: 16, top: 8, bottom: 24 }, [a, b, c, d] = this.shown;
    const box = { x: margin.left, y: margin.top, w: w - margin.left - margin.right, h: height - margin.top - margin.bottom };
    return { ...box, sx: box.w / (b - a), sy: box.h / (d - c), a, c, R: 0.46 * Math.min(w, height) * this.globe.zoom, cx: w / 2, cy: height / 2 };
  }
  spot([theta, phi], f) { return [f.x + (phi - f.a) * f.sx, f.y + (theta - f.c) * f.sy]; }
  facing(n) {
    // Orthographic: right, up, toward the viewer.
    const { lon, lat } = this.globe, [cl, sl, cb, sb] = [Math.cos(lon * RAD), Math.sin(lon * RAD), Math.cos(lat * RAD), Math.sin(lat * RAD)];
    const east = -n[0] * sl + n[1] * cl, out = n[0] * cl + n[1] * sl;
    return [east, n[2] * cb - out * sb, out * cb + n[2] * sb];
  }
  onGlobe(theta, phi, f) { const [x, y, z] = this.facing(place(theta, phi)); return [f.cx + x * f.R, f.cy - y * f.R, z]; }
  under(x, y, f) {
    // theta', phi' under the pointer; null beside the globe.
    if (this.chart !== "globe") return [clamp(f.c + (y - f.y) / f.sy, 0, 180), f.a + (x - f.x) / f.sx];
    const u = (x - f.cx) / f.R, v = (f.cy - y) / f.R, square = u * u + v * v;
    if (square > 1) return null;
    const z = Math.sqrt(1 - square), { lon, lat } = this.globe, [cl, sl, cb, sb] = [Math.cos(lon * RAD), Math.sin(lon * RAD), Math.cos(lat * RAD), Math.sin(lat * RAD)];
    const out = z * cb - v * sb, up = v * cb + z * sb;
    return [Math.acos(clamp(up, -1, 1)) / RAD, Math.atan2(out * sl + u * cl, out * cl - u * sl) / RAD];
  }
  zoom(factor, x, y, f) {
    if (this.chart === "globe") { this.globe.zoom = clamp(this.globe.zoom * factor, 0.6, 40); return; }
    const [a, b, c, d] = this.shown, px = f.a + (x - f.x) / f.sx, py = f.c + (y - f.y) / f.sy;
    const k = clamp(factor, (d - c) / 180 / 1.2, (d - c) / 1e-4);
    this.window = [px + (a - px) / k, px + (b - px) / k, py + (c - py) / k, py + (d - py) / k];
  }
  pan(dx, dy, f) {
    if (this.chart === "globe") { this.globe.lon -= dx / f.R / RAD; this.globe.lat = clamp(this.globe.lat + dy / f.R / RAD, -89, 89); return; }
    const [a, b, c, d] = this.shown;
    this.window = [a - dx / f.sx, b - dx / f.sx, c - dy / f.sy, d - dy / f.sy];
  }
  copies(low, high) {
    // Whole turns by which what lies between two longitudes is shown.
    if (this.chart === "unwrapped") return [0];
    const [a, b] = this.shown, found = [];
    for (let k = Math.ceil((a - high) / TURN); k <= Math.floor((b - low) / TURN) && found.length < 40; k++) found.push(k * TURN);
    return found;
  }
  starSpots(star, f) {
    if (this.chart === "globe") { const [x, y, z] = this.onGlobe(star.theta, star.phi, f); return [{ at: [x, y], back: z < 0 }]; }
    const [a, b] = this.shown, found = [];
    for (let k = Math.ceil((a - star.phi) / TURN); star.phi + k * TURN <= b && found.length < 12; k++) found.push({ at: this.spot([star.theta, star.phi + k * TURN], f) });
    return found;
  }
  key() { return this.chart === "globe" ? Object.values(this.globe).join() : [this.chart, ...this.shown].join(); }
  draw(pen, w, height, model, look) { this.still(pen, w, height, model, look); this.live(pen, w, height, model, look); }
  still(pen, w, height, model, look) {
    const f = this.frame(w, height);
    if (this.chart === "globe") this.drawGlobe(pen, w, height, f, model, look);
    else this.drawMap(pen, f, model, look);
  }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height), [x, y, bw, bh] = this.chart === "globe" ? [0, 0, w, height] : [f.x, f.y, f.w, f.h];
    pen.within(x, y, bw, bh, () => this.starSpots(model.state, f).forEach(({ at, back }) => star(pen, at, { ...look, faint: back })));
  }
  drawMap(pen, f, model, look) {
    const colours = look.colours, [a, b, c, d] = this.shown;
    for (const phi of ticks(a, b, clamp(Math.floor(f.w / 56), 2, 12))) pen.text(this.spot([c, phi], f)[0], f.y + f.h + 13, `${this.chart === "map" ? Number(mod(phi, TURN).toFixed(4)) || (phi ? TURN : 0) : phi}°`, { fill: colours.soft, size: 11 });
    for (const theta of ticks(Math.max(0, c), Math.min(180, d), clamp(Math.floor(f.h / 34), 2, 12))) pen.text(f.x - 6, this.spot([theta, a], f)[1], `${theta}°`, { fill: colours.soft, size: 11, align: "right" });
    pen.within(f.x, f.y, f.w, f.h, () => {
      const bright = model.celestial && look.backdrop;
      if (bright) pen.line([[f.x, f.y], [f.x + f.w, f.y], [f.x + f.w, f.y + f.h], [f.x, f.y + f.h]], { fill: "#000000", closed: true });
      if (bright) for (let k = Math.floor(a / TURN); k * TURN < b; k++) { const [x, y] = this.spot([0, k * TURN], f); pen.picture(model.celestial, x, y, TURN * f.sx, 180 * f.sy, DIM); }
      for (const phi of ticks(a, b, clamp(Math.floor(f.w / 56), 2, 12))) { const x = this.spot([0, phi], f)[0]; pen.line([[x, f.y], [x, f.y + f.h]], { stroke: colours.grid, alpha: bright ? 0.25 : 1 }); }
      for (const theta of ticks(Math.max(0, c), Math.min(180, d), clamp(Math.floor(f.h / 34), 2, 12))) { const y = this.spot([theta, 0], f)[1]; pen.line([[f.x, y], [f.x + f.w, y]], { stroke: colours.grid, alpha: bright ? 0.25 : 1 }); }
      if (model.orbit) { const y = this.spot([model.state.theta, 0], f)[1]; pen.line([[f.x, y], [f.x + f.w, y]], { stroke: colours.star, width: 1.2, dash: [3, 4] }); }
      for (const curve of [...model.curves].reverse()) this.caustic(pen, curve, f, look, bright);
      for (const event of model.orbit?.events ?? []) for (const s of this.starSpots({ theta: model.state.theta, phi: event.phi }, f)) pen.line([[s.at[0] - 4, s.at[1] - 4], [s.at[0] + 4, s.at[1] + 4], null, [s.at[0] - 4, s.at[1] + 4], [s.at[0] + 4, s.at[1] - 4]], { stroke: bright ? "#fff" : colours.ink, width: 1.6 });
    });
    pen.line([[f.x, f.y], [f.x + f.w, f.y], [f.x + f.w, f.y + f.h], [f.x, f.y + f.h]], { stroke: colours.edge, width: 1, closed: true });
  }
  caustic(pen, curve, f, look, bright) {
    const colours = bright ? COLOURS.dark : look.colours, colour = colours.order[curve.order];
    let low = Infinity, high = -Infinity;
    for (const [, phi] of curve.celestial) { low = Math.min(low, phi); high = Math.max(high, phi); }
    const style = { stroke: colour, width: look.draft ? 1.1 : 1.6, dash: DASHES[curve.order], alpha: look.draft ? 0.75 : 1 };
    for (const turn of this.copies(low, high)) {
      const line = curve.celestial.map(([theta, phi]) => this.spot([theta, phi + turn], f));
      if (line.length) line.push(line[0]);
      if (bright) pen.line(line, OUTLINE);
      pen.line(line, style);
      // What is too small to be seen has a ring round it.
      if ((high - low) * f.sx < 9) pen.disk(...this.spot([curve.celestial[0][0], (low + high) / 2 + turn], f), 6, { stroke: colour, width: 1.2, alpha: 0.8 });
      else for (const cusp of curve.cusps) pen.disk(...this.spot([cusp.celestial[0], cusp.celestial[1] + turn], f), 2.6, { fill: colour });
    }
  }
  drawGlobe(pen, w, height, f, model, look) {
    const colours = look.colours;
    pen.disk(f.cx, f.cy, f.R, { fill: colours.shadow, alpha: 0.35 });
    pen.disk(f.cx, f.cy, f.R, { stroke: colours.edge, width: 1 });
    const both = (points, style) => {
      const spots = points.map(([theta, phi]) => this.onGlobe(theta, phi, f));
      for (const back of [true, false]) pen.line(spots.map((p, i) => ((p[2] < 0) === back || (spots[i - 1] && (spots[i - 1][2] < 0) === back) ? p : null)), { ...style, alpha: (style.alpha ?? 1) * (back ? 0.22 : 1) });
    };
    const arc = Array.from({ length: 91 }, (_, i) => i);
    pen.within(0, 0, w, height, () => {
      for (let phi = 0; phi < TURN; phi += 30) both(arc.map((i) => [i * 2, phi]), { stroke: colours.grid });
      for (let theta = 30; theta < 180; theta += 30) both(arc.map((i) => [theta, i * 4]), { stroke: theta === 90 ? colours.edge : colours.grid });
      for (const curve of [...model.curves].reverse()) {
        const closed = curve.celestial.length ? [...curve.celestial, curve.celestial[0]] : [];
        both(closed, { stroke: colours.order[curve.order], width: 1.6, dash: DASHES[curve.order] });
        for (const { celestial } of curve.cusps) { const [x, y, z] = this.onGlobe(...celestial, f); if (z >= 0) pen.disk(x, y, 2.6, { fill: colours.order[curve.order] }); }
      }
    });
  }
  things(model, w, height) {
    const f = this.frame(w, height), found = this.starSpots(model.state, f).map(({ at }) => ({ at, star: model.state }));
    const spots = ([theta, phi]) => (this.chart === "globe" ? [this.onGlobe(theta, phi, f)].filter((p) => p[2] >= 0) : this.copies(phi, phi).map((k) => this.spot([theta, phi + k], f)));
    for (const curve of model.curves) {
      for (const cusp of curve.cusps) spots(cusp.celestial).forEach((at) => found.push({ at, cusp, curve }));
      for (const point of curve.celestial) spots(point).forEach((at) => found.push({ at, curve, point }));
    }
    return found;
  }
}

function star(pen, [x, y], look) {
  const r = look.dragging ? 13 : 10, corners = [];
  for (let i = 0; i < 10; i++) { const a = (i * Math.PI) / 5 - Math.PI / 2, s = i % 2 ? 0.44 * r : r; corners.push([x + s * Math.cos(a), y + s * Math.sin(a)]); }
  if (look.dragging) pen.disk(x, y, 22, { fill: look.colours.star, alpha: 0.2 });
  for (const flash of look.flashes) pen.disk(x, y, 10 + 26 * flash.part, { stroke: look.colours.star, width: 2, alpha: 1 - flash.part });
  pen.line(corners, { fill: look.colours.star, stroke: look.colours.ink, width: 1.4, closed: true, alpha: look.faint ? 0.35 : 1 });
}

// ---- brightness over one orbit ------------------------------------------------------------------------------------

class Strip {
  frame(w, height) { return { x: 44, y: 8, w: w - 54, h: height - 32 }; }
  key() { return ""; }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height), x = f.x + f.w * look.moment;
    if (model.orbit) pen.line([[x, f.y], [x, f.y + f.h]], { stroke: look.colours.star, width: 2.5 });
  }
  still(pen, w, height, model, look) {
    const f = this.frame(w, height), colours = look.colours, { orbit } = model;
    if (!orbit) return;
    const lights = orbit.tracks.flatMap((track) => track.light.map((row) => row[1])).filter((m) => m > 0).sort((a, b) => a - b);
    const low = Math.max(-7, Math.floor(Math.log10(lights[Math.floor(0.005 * lights.length)] ?? 0.01))), high = Math.min(3, Math.ceil(Math.log10(lights[Math.floor(0.995 * lights.length)] ?? 10)));
    const y = (m) => f.y + (f.h * (high - Math.log10(m))) / Math.max(1, high - low);
    for (let e = low; e <= high; e += Math.ceil((high - low) / 4)) {
      pen.line([[f.x, y(10 ** e)], [f.x + f.w, y(10 ** e)]], { stroke: colours.grid });
      pen.text(f.x - 6, y(10 ** e), e < -2 || e > 3 ? raised(`1e${e}`).slice(2) : String(10 ** e), { fill: colours.soft, size: 11, align: "right" });
    }
    for (let i = 0; i <= 4; i++) pen.text(f.x + (f.w * i) / 4, f.y + f.h + 13, i === 4 ? "1 orbit" : i ? `${i}/4` : "0", { fill: colours.soft, size: 11, align: i === 4 ? "right" : "center" });
    pen.within(f.x, f.y, f.w, f.h, () => {
      for (const event of orbit.events) { const x = f.x + f.w * event.part; pen.line([[x, f.y], [x, f.y + f.h]], { stroke: colours.order[event.order] ?? colours.soft, width: 1.4, dash: event.kind === "creation" ? [] : [3, 3], alpha: 0.8 }); }
      for (const track of orbit.tracks) this.light(pen, track, f, y, colours);
    });
    pen.line([[f.x, f.y], [f.x + f.w, f.y], [f.x + f.w, f.y + f.h], [f.x, f.y + f.h]], { stroke: colours.edge, closed: true });
  }
  light(pen, track, f, y, colours) {
    const count = track.light.length;
    for (let i = 0; i + 1 < count + (track.closed ? 1 : 0); i++) {
      const [a, m, index] = track.light[i], [b, n, other] = track.light[(i + 1) % count];
      if (!(m > 0 && n > 0)) continue;
      const shift = mod(a, 1), step = mod(b - a + 0.5, 1) - 0.5;
      for (const turn of [0, -1, 1]) pen.line([[f.x + f.w * (shift + turn), y(m)], [f.x + f.w * (shift + turn + step), y(n)]], { stroke: colours.order[Math.max(index, other)] ?? colours.soft, width: 1.6 });
    }
  }
}

// ---- the page ------------------------------------------------------------------------------------------------------

export function mount(element, channel, options = {}) {
  const state = { ...DEFAULTS, ...channel.state };
  const model = { state, curves: [], images: [], edge: [], axes: null, orbit: null, lensed: null, celestial: null, backdropField: 200 };
  const sky = new SkyPanel(), celestial = new CelestialPanel(), strip = new Strip();
  const told = { view: null, numbers: null, certified: null, lines: [] };
  const latencies = { star: [], draft: [], full: [] };
  let wantedVelocity = state.velocity, flashes = [], dragging = false, playing = null, moment = 0, drawn = 0, presets = [];
  let theme = "auto", refusalLine = "", onceRefused = false, ready = false;

  // -- elements
  const live = h("p", { class: "kc-said", role: "status", "aria-live": "polite" });
  const banner = h("p", { class: "kc-banner", role: "alert", hidden: true });
  const badge = h("span", { class: "kc-badge" });
  const tip = h("div", { class: "kc-tip", role: "tooltip", hidden: true });
  const panel = (name, title, label, tools) => {
    const canvas = h("canvas", { tabindex: "0", role: "img", "aria-label": label, class: `kc-canvas kc-${name}` });
    const coarse = h("span", { class: "kc-coarse", hidden: true }, "coarse while you move");
    return { canvas, coarse, box: h("section", { class: `kc-panel kc-panel-${name}` }, h("header", {}, h("h2", {}, title), coarse, h("div", { class: "kc-tools" }, ...tools)), canvas) };
  };
  const button = (words, label, act, more = {}) => h("button", { type: "button", "aria-label": label, title: label, onclick: act, ...more }, words);
  const zooms = (thing, canvas) => [button("−", "Zoom out", () => zoomed(thing, canvas(), 1 / 1.5)), button("+", "Zoom in", () => zoomed(thing, canvas(), 1.5)), button("⤢", "Show all", () => { thing.reset(); redraw(); })];
  const select = (label, values, changed) => h("select", { "aria-label": label, onchange: (e) => changed(e.target.value) }, ...values.map(([value, words]) => h("option", { value }, words)));
  const charts = select("Chart of the celestial sphere", [["map", "map"], ["unwrapped", "unwrapped"], ["globe", "globe"]], (chart) => { state.chart = chart; fit(); remember(); redraw(); });
  const left = panel("camera", "Camera sky", "The camera sky", zooms(sky, () => left.canvas));
  const right = panel("celestial", "Celestial sphere", "The celestial sphere, with the star", [charts, ...zooms(celestial, () => right.canvas)]);
  const below = h("canvas", { class: "kc-canvas kc-strip", tabindex: "0", role: "img", "aria-label": "Brightness of the images over one orbit" });
  const play = button("▶ Play one orbit", "Play one orbit of the camera (space)", () => toggle(), { class: "kc-play" });
  const clock = h("span", { class: "kc-clock" });
  const stripBox = h("section", { class: "kc-strip-box", hidden: true }, below);

  const sliders = {};
  const slider = (name, label, low, high, step, toValue, toPlace, unit) => {
    const range = h("input", { type: "range", min: low, max: high, step, "aria-label": label });
    const number = h("input", { type: "number", step: "any", "aria-label": `${label}, number` });
    const moved = (event, value, want) => { if (Number.isFinite(value)) { change({ [name]: value }, want, event.timeStamp); } };
    range.addEventListener("input", (e) => moved(e, toValue(Number(range.value)), "draft"));
    range.addEventListener("change", (e) => moved(e, toValue(Number(range.value)), "full"));
    number.addEventListener("change", (e) => moved(e, Number(number.value), "full"));
    sliders[name] = () => { range.value = toPlace(state[name]); if (document.activeElement !== number) number.value = Number(state[name].toPrecision(6)); range.setAttribute("aria-valuetext", `${short(state[name], 5)}${unit}`); };
    return h("label", { class: "kc-slider" }, h("span", {}, label), number, range);
  };
  const round = (x, digits) => Number(x.toPrecision(digits));
  const same = (x) => x;
  const velocity = select("Velocity of the camera", [["circular", "circular"], ["fiducial", "fiducial"], ["static", "static"]], (value) => { wantedVelocity = value; change({ velocity: value }, "full"); });
  const orders = select("Orders of critical curves", [1, 2, 3, 4].map((k) => [k, `${k}: index ${k > 1 ? `0–${k - 1}` : 0}`]), (value) => change({ orders: Number(value) }, "full"));
  const backdrop = select("Sky behind the curves", [["none", "none"], ["stars", "star field"], ["checkerboard", "checkerboard"]], (value) => change({ backdrop: value }, "full"));
  const preset = select("Presets", [["", "Presets: figures of JTFT …"]], (name) => { const chosen = presets.find((p) => p.name === name); if (chosen) show(chosen.state); preset.value = ""; });
  const labelled = (words, node) => h("label", { class: "kc-choice" }, h("span", {}, words), node);
  const imagesTable = h("table", { class: "kc-images" }), causticsTable = h("table", { class: "kc-caustics" });
  const code = h("pre", { class: "kc-code", tabindex: "0" });
  const themes = button("◐", "Light or dark", () => { theme = dark() ? "light" : "dark"; root.dataset.theme = theme; redraw(); });
  const exports = h("div", { class: "kc-exports" }, button("PNG", "Export a PNG picture", () => exportPng()), button("SVG", "Export an SVG picture", () => exportSvg()), button("JSON", "Export the numbers as JSON", () => exportJson()), button("Copy link", "Copy a link to this state", () => copyLink()), themes);

  const controls = h("section", { class: "kc-controls", "aria-label": "Camera" },
    slider("spin", "Spin a", 0, 4, 0.005, (u) => (u >= 4 ? 0.9999 : round(1 - 10 ** -u, 4)), (a) => -Math.log10(1 - a), ""),
    slider("radius", "Radius r (M)", 0, 3, 0.002, (u) => round(10 ** u, 4), (r) => Math.log10(r), " M"),
    slider("inclination", "Inclination (°)", 0, 180, 0.5, same, same, "°"),
    slider("theta", "Star θ′ (°)", 0, 180, 0.1, same, same, "°"),
    slider("phi", "Star φ′ (°)", 0, 360, 0.1, same, (phi) => mod(phi, TURN), "°"),
    labelled("Velocity", velocity), labelled("Orders", orders), labelled("Backdrop", backdrop));
  const root = h("div", { class: "kc-explorer" },
    h("header", { class: "kc-head" }, h("h1", {}, "Kerr caustics"), preset, badge, exports),
    banner,
    h("div", { class: "kc-body" }, controls, h("div", { class: "kc-stage" }, h("div", { class: "kc-panels" }, left.box, right.box), h("div", { class: "kc-orbit" }, play, clock), stripBox, live,
      h("div", { class: "kc-tables" }, h("section", {}, h("h2", {}, "Images of the star"), h("div", { class: "kc-scroll" }, imagesTable)), h("section", {}, h("h2", {}, "Caustics"), h("div", { class: "kc-scroll" }, causticsTable))),
      h("details", {}, h("summary", {}, "The same on the command line and in Python"), code),
      h("p", { class: "kc-help" }, "Drag the star; drag or pinch elsewhere to move and zoom. Keys: arrows move the star (with Shift a tenth), [ and ] change the spin, space plays. Filled images have even parity. Errors are estimates, and counts are certified when the search and the winding of the caustics agree."))), tip);
  element.replaceChildren(root);

  const dark = () => (theme === "auto" ? matchMedia("(prefers-color-scheme: dark)").matches : theme === "dark");
  const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

  // -- questions: one of each kind on its way, and the newest waits
  const asked = { view: null, orbit: null, backdrop: null }, waiting = { view: null, orbit: null, backdrop: null };
  let number = 0;
  function ask(want, since) {
    const kind = want === "orbit" || want === "backdrop" ? want : "view";
    // Curves that are still to come must not be forgotten for a star that moves.
    const older = waiting[kind];
    if (kind === "view" && want === "star" && (older?.want === "full" || !fits())) want = older?.want ?? "full";
    waiting[kind] = { want, since: since ?? performance.now(), state: { ...state } };
    sendNext(kind);
  }
  function sendNext(kind) {
    if (!ready || asked[kind] || !waiting[kind]) return;
    asked[kind] = { ...waiting[kind], id: ++number };
    waiting[kind] = null;
    channel.send(JSON.stringify({ id: number, want: asked[kind].want, state: asked[kind].state }));
  }
  const cameraOf = (s) => [s.spin, s.radius, s.inclination, s.velocity, s.orders].join();
  const fits = () => told.view && told.view.quality === "full" && cameraOf(told.view.state) === cameraOf(state);

  function heard(bytes) {
    const answer = bytes instanceof ArrayBuffer || ArrayBuffer.isView(bytes) ? decoded(bytes) : bytes;
    if (answer.kind === "greeting") return greeted(answer);
    const kind = ["orbit", "backdrop"].includes(answer.want) ? answer.want : "view";
    const question = asked[kind];
    if (question && answer.id === question.id) asked[kind] = null;
    // What cannot be read at all is refused without its number.
    if (answer.kind === "refusal" && answer.id === null) asked.view = asked.orbit = asked.backdrop = null;
    if (answer.kind === "refusal") refused(answer.line, kind);
    else if (kind === "view") viewed(answer, question);
    else if (kind === "orbit") orbited(answer);
    else behind(answer);
    sendNext(kind);
    redraw(question);
  }
  function greeted(answer) {
    presets = answer.presets;
    preset.replaceChildren(h("option", { value: "" }, "Presets: figures of JTFT …"), ...presets.map(({ name }) => h("option", { value: name }, name)));
    asked.view = asked.orbit = asked.backdrop = null;
    ready = true;
    complain("");
    change({}, "full");
  }
  function refused(line, kind) {
    if (kind === "backdrop" || kind === "orbit") { complain(line); stopPlaying(); return; }
    complain(line);
    // What an address asks for may not exist; the usual state does.
    if (!told.view && !onceRefused) { onceRefused = true; Object.assign(state, DEFAULTS); wantedVelocity = state.velocity; controlsFollow(); ask("full"); }
  }
  function complain(line) { refusalLine = line; banner.textContent = line; banner.hidden = !line; }
  function viewed(answer, question) {
    if (told.view || !onceRefused) complain("");
    // A page of few states shows the nearest one.
    if (answer.nearest) { Object.assign(state, answer.state); controlsFollow(); }
    if (answer.quality !== "star") {
      model.edge = rows(answer.arrays.edge); model.axes = answer.axes; model.curves = curvesOf(answer);
      told.view = answer; told.version = (told.version ?? 0) + 1;
      fit();
    }
    if (answer.images && !playing) {
      const images = imagesOf(answer), orders = answer.state.orders;
      let news = "";
      if (told.numbers && cameraOf(told.numbers.state) === cameraOf(answer.state)) {
        news = changed(model.images, images, orders);
      }
      model.images = images;
      told.numbers = answer;
      say(news);
    } else if (!answer.images && !playing) { model.images = []; told.numbers = null; }
    if (answer.quality === "full" && question?.want !== "draft") {
      if (state.backdrop !== "none" && model.behind !== [cameraOf(state), state.backdrop].join()) ask("backdrop");
    }
    if (model.orbit && orbitKey(model.orbit.state) !== orbitKey(state)) dropOrbit();
    play.disabled = !answer.has_orbit;
    play.title = answer.has_orbit ? "Play one orbit of the camera (space)" : "This camera does not circle the spin axis";
    write();
  }
  const orbitKey = (s) => [cameraOf(s), s.theta].join();
  function orbited(answer) {
    if (orbitKey(answer.state) !== orbitKey(state)) return playing ? ask("orbit") : undefined;
    model.orbit = orbitOf(answer); told.version += 1;
    stripBox.hidden = false;
    if (playing) { moment = nearestMoment(); playing.from = null; }
  }
  function dropOrbit() { model.orbit = null; stripBox.hidden = true; clock.textContent = ""; if (playing) ask("orbit"); }
  async function behind(answer) {
    if (answer.state.backdrop !== state.backdrop || cameraOf(answer.state) !== cameraOf(state)) return;
    const picture = (array) => createImageBitmap(new Blob([array.data], { type: "image/jpeg" }));
    model.backdropField = answer.field;
    [model.lensed, model.celestial] = answer.arrays.lensed ? await Promise.all([picture(answer.arrays.lensed), picture(answer.arrays.celestial)]) : [null, null];
    model.behind = [cameraOf(answer.state), answer.state.backdrop].join(); told.version += 1;
    redraw();
  }

  // -- changes
  function change(changes, want, since) {
    Object.assign(state, changes);
    state.spin = clamp(state.spin, 0, 0.9999);
    state.radius = clamp(state.radius, round(1.01 * horizon(state.spin) + 5e-5, 5), 1000);
    state.inclination = clamp(state.inclination, 0, 180);
    state.theta = clamp(state.theta, 0, 180);
    state.phi = mod(state.phi, TURN);
    const level = state.inclination === 90;
    const can = { circular: level && state.radius > photonOrbit(state.spin) * 1.001, static: state.radius > 1.001 * (1 + Math.sqrt(1 - (state.spin * Math.cos(state.inclination * RAD)) ** 2)), fiducial: true };
    state.velocity = can[wantedVelocity] ? wantedVelocity : "fiducial";
    if (model.orbit && orbitKey(model.orbit.state) !== orbitKey(state)) dropOrbit();
    if (want !== "star" && model.behind && model.behind !== [cameraOf(state), state.backdrop].join()) { model.lensed = model.celestial = null; model.behind = null; }
    controlsFollow();
    if (want !== "draft") remember();
    ask(want, since);
    redraw();
  }
  function controlsFollow() {
    Object.values(sliders).forEach((follow) => follow());
    velocity.value = state.velocity; orders.value = String(state.orders); backdrop.value = state.backdrop; charts.value = state.chart;
  }
  function show(wanted) {
    stopPlaying();
    wantedVelocity = wanted.velocity ?? wantedVelocity;
    sky.reset(); celestial.reset();
    change({ ...DEFAULTS, ...wanted }, "full");
  }
  // Browsers bear few changes of the address a second.
  let remembering = null;
  function remember() { remembering ??= setTimeout(() => { remembering = null; channel.remember?.({ ...state }); }, 150); }
  function fit() { sky.fit(model); celestial.fit(model, state.chart); }
  function moveStar(theta, phi, since) { stopPlaying(); change({ theta, phi }, "star", since); }
  const gapTo = (event) => Math.abs(mod(event.part - moment + 0.5, 1) - 0.5);
  // Lets pairs that came or went flash, and says so.
  function changed(before, after, orders, events = []) {
    const what = [["created", before, after], ["annihilated", after, before]];
    return what.flatMap(([word, old, now]) => pairsBorn(old, now, orders, model.curves).map((pair) => {
      // While an orbit is played the place itself is known.
      const event = events.filter((e) => e.order === pair.order).sort((a, b) => gapTo(a) - gapTo(b))[0];
      flashes.push({ ...pair, sky: event?.sky ?? pair.sky, since: performance.now(), part: 0 });
      return `A pair of index ${pair.order - 1} and ${pair.order} was ${word}. `;
    })).join("");
  }
  function zoomed(thing, canvas, factor) { const { w, height } = sizeOf(canvas); thing.zoom(factor, w / 2, height / 2, thing.frame(w, height)); redraw(); }

  // -- playing
  function nearestMoment() {
    let best = 0, gap = Infinity;
    model.orbit.frames.forEach((frame, i) => { const d = Math.abs(mod(frame.phi - state.phi + 180, TURN) - 180); if (d < gap) { gap = d; best = i; } });
    return best / model.orbit.frames.length;
  }
  function toggle() {
    if (playing) return stopPlaying();
    if (told.view && !told.view.has_orbit) return complain("This camera does not circle the spin axis: it has no orbit to play.");
    playing = { from: null, turns: 0 };
    play.textContent = "❚❚ Pause";
    if (model.orbit) moment = nearestMoment(); else { clock.textContent = "finding the tracks …"; ask("orbit"); }
    redraw();
  }
  function stopPlaying() {
    if (!playing) return;
    playing = null;
    play.textContent = "▶ Play one orbit";
    remember();
    ask("star");
  }
  function step(now) {
    if (!playing || !model.orbit) return;
    if (playing.from === null) playing.from = now - moment * ORBIT_SECONDS * 1000, playing.began = now;
    moment = mod((now - playing.from) / 1000 / ORBIT_SECONDS, 1);
    at(moment);
    if (now - playing.began >= ORBIT_SECONDS * 1000) stopPlaying();
  }
  function at(part) {
    const { frames, period, state: of } = model.orbit, frame = frames[Math.min(frames.length - 1, Math.floor(part * frames.length))];
    const news = model.images.length ? changed(model.images, frame.images, of.orders, model.orbit.events) : "";
    state.phi = frame.phi; model.images = frame.images; told.numbers = null; told.certified = frame.certified;
    sliders.phi();
    clock.textContent = `t = ${(part * period).toFixed(1)} M of ${period.toFixed(1)} M`;
    say(news);
    if (performance.now() - (told.tabled ?? 0) > 200) { told.tabled = performance.now(); write(); }
  }

  // -- what is said in words
  function say(first = "") {
    const orders = state.orders, counts = countsOf(model.images, orders), sure = told.numbers ? told.numbers.images.certified : told.certified;
    const words = `${first}${model.images.length} images: ${counts.map((n, k) => `${n} of index ${k}`).join(", ")}; ${sure ? "certified" : "not certified"}.`;
    badge.textContent = sure ? `✓ ${counts.join(" + ")} images, certified` : `! ${counts.join(" + ")} images, not certified`;
    badge.className = `kc-badge ${sure ? "kc-sure" : "kc-unsure"}`;
    const remarks = told.numbers?.images.remarks ?? [];
    const text = [words, ...remarks].join(" ");
    if (!playing || first) live.textContent = text;
    left.canvas.setAttribute("aria-label", `The camera sky: ${words}`);
    right.canvas.setAttribute("aria-label", `The celestial sphere: the star at theta ${short(state.theta)}, phi ${short(state.phi)} degrees, and ${model.curves.length} caustics`);
  }
  function write() {
    const cell = (tag, words) => h(tag, {}, words);
    const row = (tag, words, more = {}) => h("tr", more, ...words.map((w) => cell(tag, w)));
    const tint = (k) => { const mark = h("span", { class: "kc-mark" }, "●"); mark.style.color = palette().order[k]; return mark; };
    if (!dragging && model.images.length) {
      imagesTable.replaceChildren(h("thead", {}, row("th", ["index", "parity", "brightness", "ν/ν₀", "error (°)"])), h("tbody", {}, ...model.images.map(({ index, magnification, redshift, error }) => h("tr", {}, h("td", {}, tint(index), ` ${index}`), ...[index % 2 ? "−" : "+", short(magnification), short(redshift), short(error, 2)].map((w) => cell("td", w))))));
    }
    if (told.view?.quality === "full" && told.written !== told.view) {
      told.written = told.view;
      causticsTable.replaceChildren(h("thead", {}, row("th", ["order", "circuits", "θ′ extent (°)", "φ′ extent (°)", "cusps", "error (°)", ""])), h("tbody", {}, ...model.curves.map((c) => h("tr", {}, h("td", {}, tint(c.order), ` ${c.order}`), ...[short(c.circuits), short(c.theta_extent, 5), short(c.phi_extent, 6), String(c.cusps.length), short(c.error, 2)].map((w) => cell("td", w)), h("td", {}, button("show", `Zoom to the ${NAMES[c.order]} caustic`, () => { if (state.chart === "globe") { state.chart = "map"; fit(); controlsFollow(); } celestial.look(c); redraw(); }))))));
    }
    const answer = told.numbers ?? told.view;
    if (answer) code.textContent = `${answer.commands.join("\n")}\n\n${answer.python}`;
  }
  const palette = () => COLOURS[dark() ? "dark" : "light"];

  // -- drawing
  let pending = false, sinceList = [];
  function redraw(question) {
    if (question?.since !== undefined) sinceList.push(question);
    if (pending) return;
    pending = true;
    requestAnimationFrame(draw);
  }
  function sizeOf(canvas) { const box = canvas.getBoundingClientRect(); return { w: Math.max(60, box.width), height: Math.max(60, box.height) }; }
  function look() {
    const draft = !!told.view && (told.view.quality === "draft");
    return { colours: palette(), backdrop: state.backdrop !== "none", hasPicture: !!model.lensed, draft, flashes, dragging, playing: !!playing, moment };
  }
  function penFor(canvas) {
    const { w, height } = sizeOf(canvas), ratio = Math.min(3, devicePixelRatio || 1), [pw, ph] = [Math.round(w * ratio), Math.round(height * ratio)];
    if (canvas.width !== pw || canvas.height !== ph) { canvas.width = pw; canvas.height = ph; }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, w, height);
    return { pen: new CanvasPen(context, FONTS), w, height };
  }
  // What does not move with the star is drawn when it changes, and kept.
  const layers = new Map();
  function paint(canvas, thing, seen) {
    const { pen, w, height } = penFor(canvas);
    const key = [canvas.width, canvas.height, thing.key(), told.version, dark(), seen.draft, seen.backdrop, !!model.lensed, model.orbit && state.theta].join("|");
    let layer = layers.get(thing);
    if (layer?.key !== key) {
      const kept = layer?.canvas ?? h("canvas"), ratio = canvas.width / w;
      kept.width = canvas.width; kept.height = canvas.height;
      const context = kept.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      thing.still(new CanvasPen(context, FONTS), w, height, model, seen);
      layer = { key, canvas: kept };
      layers.set(thing, layer);
    }
    pen.c.drawImage(layer.canvas, 0, 0, w, height);
    thing.live(pen, w, height, model, seen);
  }
  function draw(now) {
    pending = false;
    step(now);
    flashes = flashes.filter((f) => now - f.since < FLASH);
    flashes.forEach((f) => { f.part = still() ? 0.3 : clamp((now - f.since) / FLASH, 0, 1); });
    const seen = look();
    for (const p of [left, right]) p.coarse.hidden = !seen.draft;
    for (const [canvas, thing] of [[left.canvas, sky], [right.canvas, celestial], ...(stripBox.hidden ? [] : [[below, strip]])]) paint(canvas, thing, seen);
    drawn += 1;
    for (const { want, since } of sinceList) { const list = latencies[want]; if (list) { list.push(performance.now() - since); if (list.length > 1000) list.shift(); } }
    sinceList = [];
    if (playing || flashes.length) redraw();
  }

  // -- pointers
  const near = (thing, canvas, x, y, reach) => {
    const { w, height } = sizeOf(canvas);
    let best = null, gap = reach;
    thing.things(model, w, height).forEach((found, i) => { const d = Math.hypot(found.at[0] - x, found.at[1] - y) - (found.image || found.star || found.event ? 8 : found.cusp ? 4 : 0); if (d < gap) { gap = d; best = found; } });
    return best;
  };
  function pointers(canvas, thing, canDrag) {
    const down = new Map();
    let mode = null, moved = 0;
    const spot = (e) => { const box = canvas.getBoundingClientRect(); return [e.clientX - box.left, e.clientY - box.top]; };
    const frame = () => { const { w, height } = sizeOf(canvas); return thing.frame(w, height); };
    const onStarAt = (x, y, reach) => canDrag && thing.starSpots(state, frame()).some(({ at, back }) => !back && Math.hypot(at[0] - x, at[1] - y) < reach);
    // A finger moves the page up and down, but for the star, and two fingers.
    canvas.addEventListener("touchstart", (e) => {
      const box = canvas.getBoundingClientRect(), { clientX, clientY } = e.touches[0];
      if (e.touches.length > 1 || onStarAt(clientX - box.left, clientY - box.top, 32)) e.preventDefault();
    }, { passive: false });
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId); canvas.focus({ preventScroll: true });
      down.set(e.pointerId, spot(e)); moved = 0; tip.hidden = true;
      const reach = e.pointerType === "touch" ? 32 : 18, [x, y] = spot(e);
      mode = down.size > 1 ? "pinch" : onStarAt(x, y, reach) ? "star" : "pan";
      dragging = mode === "star"; redraw();
    });
    const dragged = (e) => {
      if (mode !== "star" || !down.has(e.pointerId)) return;
      const under = thing.under(...spot(e), frame());
      if (under) moveStar(under[0], under[1], e.timeStamp);
    };
    // Moves wait for the next picture; where the browser tells them at once, the question leaves half a picture earlier.
    const early = "onpointerrawupdate" in window && isSecureContext;
    if (early) canvas.addEventListener("pointerrawupdate", dragged);
    canvas.addEventListener("pointermove", (e) => {
      const [x, y] = spot(e), before = down.get(e.pointerId);
      if (!before) return hover(canvas, thing, x, y, e);
      moved += Math.hypot(x - before[0], y - before[1]);
      if (mode === "star") { if (!early) dragged(e); }
      else if (mode === "pinch" && down.size === 2) {
        const [other] = [...down].filter(([id]) => id !== e.pointerId).map(([, p]) => p);
        const grown = Math.hypot(x - other[0], y - other[1]) / Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1]));
        thing.zoom(grown, (x + other[0]) / 2, (y + other[1]) / 2, frame()); redraw();
      } else if (mode === "pan") { thing.pan(x - before[0], y - before[1], frame()); redraw(); }
      down.set(e.pointerId, [x, y]);
    });
    const up = (e) => {
      if (!down.delete(e.pointerId)) return;
      const [x, y] = spot(e), wasStar = mode === "star";
      if (canDrag && mode === "pan" && moved < 4 && e.type === "pointerup") { const under = thing.under(x, y, frame()); if (under) moveStar(under[0], under[1], e.timeStamp); }
      if (!down.size) { mode = null; dragging = false; if (wasStar) { remember(); ask("star"); } redraw(); }
    };
    canvas.addEventListener("pointerup", up); canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
    canvas.addEventListener("dblclick", () => { thing.reset(); redraw(); });
    canvas.addEventListener("wheel", (e) => {
      if (!options.wholePage && !e.ctrlKey && document.activeElement !== canvas) return;
      e.preventDefault();
      thing.zoom(Math.exp(-clamp(e.deltaY, -120, 120) * 0.003), ...spot(e), frame()); redraw();
    }, { passive: false });
  }
  function hover(canvas, thing, x, y, event) {
    const found = near(thing, canvas, x, y, 9);
    tip.hidden = !found;
    canvas.style.cursor = found?.star ? "grab" : found ? "help" : "default";
    if (!found) return;
    tip.replaceChildren(...about(found).map((line, i) => h(i ? "span" : "b", {}, line)));
    const box = root.getBoundingClientRect(), wide = 250;
    tip.style.left = `${clamp(event.clientX - box.left + 14, 4, Math.max(4, box.width - wide))}px`;
    tip.style.top = `${event.clientY - box.top + 16}px`;
  }
  function about({ image, event, cusp, curve, point, star: onStar }) {
    if (image) return [`Image of index ${image.index}, parity ${image.index % 2 ? "−" : "+"}`, `brightness ${short(image.magnification)}`, ...(image.redshift === undefined ? [] : [`ν/ν₀ ${short(image.redshift, 6)}`, `φ′ of the ray ${short(image.azimuth, 7)}°`]), `N = (${image.sky.map((x) => x.toFixed(6)).join(", ")})`, `error ${short(image.error, 2)}°`];
    if (event) return [`Pair ${event.kind}, order ${event.order}`, `at ${(100 * event.part).toFixed(3)} % of the orbit`, `star at φ′ = ${short(event.phi, 8)}°`, `error ${short(event.error, 2)}°`, ...(event.at_cusp ? ["at a cusp"] : [])];
    if (cusp) return [`Cusp, ${NAMES[curve.order]} caustic`, `θ′ = ${short(cusp.celestial[0], 9)}°`, `φ′ = ${short(cusp.celestial[1], 9)}°`, `error ${short(cusp.error, 2)}°`];
    if (onStar) return ["The star", `θ′ = ${short(onStar.theta, 7)}°, φ′ = ${short(onStar.phi, 7)}°`, "drag it"];
    return [`${NAMES[curve.order]} critical curve and caustic`, `here θ′ = ${short(point[0], 6)}°, φ′ = ${short(point[1], 7)}°`, ...(curve.circuits === undefined ? ["coarse"] : [`${curve.kind}, ${short(curve.circuits)} circuits`, `extents ${short(curve.theta_extent, 5)}° × ${short(curve.phi_extent, 6)}°`, `error ${short(curve.error, 2)}°`])];
  }
  pointers(left.canvas, sky, false);
  pointers(right.canvas, celestial, true);
  const onStrip = (e) => {
    if (!model.orbit || !(e.buttons & 1)) return;
    const box = below.getBoundingClientRect(), f = strip.frame(box.width, box.height);
    moment = clamp((e.clientX - box.left - f.x) / f.w, 0, 0.9999);
    if (playing) playing.from = null; 
    at(moment);
    if (!playing) { remember(); ask("star"); }
    redraw();
  };
  below.addEventListener("pointerdown", onStrip); below.addEventListener("pointermove", onStrip);

  // -- keys
  function keyed(event) {
    const into = event.target.closest?.("input, select, textarea, button, summary, pre");
    if (into || event.ctrlKey || event.metaKey || event.altKey) return;
    const size = event.shiftKey ? 0.1 : 1;
    const moves = { ArrowLeft: [0, -size], ArrowRight: [0, size], ArrowUp: [-size, 0], ArrowDown: [size, 0] };
    if (moves[event.key]) moveStar(state.theta + moves[event.key][0], state.phi + moves[event.key][1], event.timeStamp);
    else if ("[]{}".includes(event.key)) { const u = clamp(-Math.log10(1 - state.spin) + ("[{".includes(event.key) ? -1 : 1) * ("[]".includes(event.key) ? 0.05 : 0.005), 0, 4); change({ spin: round(1 - 10 ** -u, 6) }, event.repeat ? "draft" : "full", event.timeStamp); }
    else if (event.key === " ") toggle();
    else return;
    event.preventDefault();
  }
  (options.wholePage ? document : root).addEventListener("keydown", keyed);
  const settled = (event) => { if ("[]{}".includes(event.key) && !fits()) ask("full"); };
  (options.wholePage ? document : root).addEventListener("keyup", settled);

  // -- exports
  function deliver(blob, name) {
    const link = h("a", { href: URL.createObjectURL(blob), download: name });
    root.append(link); link.click(); link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
  const fileName = (ending) => `kerr_a${state.spin}_r${state.radius}.${ending}`;
  const caption = () => `a = ${state.spin}, r = ${state.radius} M, inclination ${state.inclination}°, ${state.velocity}; star at θ′ = ${short(state.theta, 6)}°, φ′ = ${short(state.phi, 6)}°`;
  function exportPng() {
    const canvas = h("canvas"), scale = 2;
    canvas.width = 1240 * scale; canvas.height = 640 * scale;
    const context = canvas.getContext("2d"), seen = { ...look(), flashes: [], dragging: false };
    context.scale(scale, scale);
    context.fillStyle = seen.colours.paper; context.fillRect(0, 0, 1240, 640);
    const pen = new CanvasPen(context, FONTS);
    pen.text(20, 20, caption(), { fill: seen.colours.ink, size: 15, align: "left" });
    [[sky, 10], [celestial, 630]].forEach(([thing, x]) => { context.save(); context.translate(x, 40); thing.draw(pen, 600, 590, model, seen); context.restore(); });
    canvas.toBlob((blob) => deliver(blob, fileName("png")), "image/png");
  }
  function exportSvg() {
    const pen = new SvgPen(1240, 640, FONTS), seen = { ...look(), flashes: [], dragging: false };
    pen.text(20, 20, caption(), { fill: seen.colours.ink, size: 15, align: "left" });
    [[sky, 10], [celestial, 630]].forEach(([thing, x]) => pen.group(x, 40, () => thing.draw(pen, 600, 590, model, seen)));
    deliver(new Blob([pen.whole(seen.colours.paper)], { type: "image/svg+xml" }), fileName("svg"));
  }
  function exportJson() {
    const { arrays: _, id: __, want: ___, ...view } = told.view ?? {};
    const whole = { schema: "kerrcaustics/explorer/1", ...view, ...(told.numbers ? { state: { ...state }, images: told.numbers.images, commands: told.numbers.commands, python: told.numbers.python, address: told.numbers.address } : {}), curves: model.curves.map(({ order, sky: s, celestial: c }) => ({ order, sky: s, celestial_deg: c })) };
    deliver(new Blob([JSON.stringify(whole, null, 1)], { type: "application/json" }), fileName("json"));
  }
  async function copyLink() {
    const link = channel.link?.() ?? `#${fragmentOf(state)}`;
    try { await navigator.clipboard.writeText(link); live.textContent = "The link was copied."; } catch { live.textContent = link; }
  }

  const resized = new ResizeObserver(() => redraw());
  [left.canvas, right.canvas, below].forEach((canvas) => resized.observe(canvas));
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const recoloured = () => { told.written = null; write(); redraw(); };
  scheme.addEventListener("change", recoloured);
  controlsFollow();
  channel.listen(heard);

  return {
    state: () => ({ ...state }),
    counts: () => countsOf(model.images, state.orders),
    images: () => model.images,
    certified: () => (told.numbers ? told.numbers.images.certified : told.certified),
    quality: () => told.view?.quality ?? null,
    busy: () => !ready || !!remembering || Object.values(asked).some(Boolean) || Object.values(waiting).some(Boolean),
    playing: () => !!playing,
    orbit: () => model.orbit && { events: model.orbit.events, frames: model.orbit.frames.length },
    latencies: () => latencies,
    frames: () => drawn,
    flashed: () => flashes.length,
    line: () => refusalLine,
    starSpots: () => { const { w, height } = sizeOf(right.canvas), box = right.canvas.getBoundingClientRect(); return celestial.starSpots(state, celestial.frame(w, height)).map(({ at }) => [at[0] + box.left, at[1] + box.top]); },
    spot: (theta, phi) => { const { w, height } = sizeOf(right.canvas), box = right.canvas.getBoundingClientRect(), f = celestial.frame(w, height), [x, y] = state.chart === "globe" ? celestial.onGlobe(theta, phi, f) : celestial.spot([theta, phi], f); return [x + box.left, y + box.top]; },
    show, lost: (line) => { ready = false; complain(line); },
    leave: () => { resized.disconnect(); scheme.removeEventListener("change", recoloured); (options.wholePage ? document : root).removeEventListener("keydown", keyed); (options.wholePage ? document : root).removeEventListener("keyup", settled); },
  };
}

const FONTS = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

// ---- in a notebook: anywidget calls this -----------------------------------------------------------------------------

export default {
  render({ model, el }) {
    let explorer = null;
    const listeners = [];
    const channel = {
      state: model.get("state"),
      listen: (heard) => listeners.push(heard),
      send: (text) => model.send({ kind: "question", text }),
      remember: () => {},
    };
    const heard = (message, buffers) => { if (message?.kind === "message") buffers.forEach((bytes) => listeners.forEach((f) => f(bytes))); };
    const followed = () => { const wanted = model.get("state"); if (JSON.stringify(wanted) !== JSON.stringify(explorer.state()) && !explorer.busy()) explorer.show(wanted); };
    model.on("msg:custom", heard);
    explorer = mount(el, channel, {});
    model.on("change:state", followed);
    model.send({ kind: "hello" });
    return () => { model.off("msg:custom", heard); model.off("change:state", followed); explorer.leave(); };
  },
};
