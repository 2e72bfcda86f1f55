// The camera sky: azimuthal equidistant about the middle of the shadow.

class SkyPanel {
  constructor() {
    this.centre = [0, 0];
    this.field = null;
    this.auto = 60;
  }
  reset() {
    this.centre = [0, 0];
    this.field = null;
  }
  fit(model) {
    const outer = model.curves[0]?.sky ?? model.edge;
    if (!outer) return;
    let far = 0;
    for (const n of outer) far = Math.max(far, Math.hypot(...this.flat(n, model.axes)));
    this.auto = clamp(1.55 * far, 0.02, model.state.backdrop === "none" ? 185 : 125);
  }
  flat(n, axes) {
    const along = dot(n, axes[0]),
      right = dot(n, axes[1]),
      up = dot(n, axes[2]),
      across = Math.hypot(right, up);
    const scale = across > 0 ? Math.atan2(across, along) / RAD / across : 0;
    return [right * scale, up * scale];
  }
  frame(w, height) {
    const scale = Math.min(w, height) / 2 / (this.field ?? this.auto);
    return { w, height, scale, x: w / 2 - this.centre[0] * scale, y: height / 2 + this.centre[1] * scale };
  }
  spot(n, axes, f) {
    const [x, y] = this.flat(n, axes);
    return [f.x + x * f.scale, f.y - y * f.scale];
  }
  // What is seen of the sky: a square round the panel.
  window(w, height) {
    return [...this.centre, Math.max(w, height) / this.frame(w, height).scale];
  }
  zoom(factor, x, y, f) {
    const field = clamp((this.field ?? this.auto) / factor, 1e-4, 190),
      grown = (this.field ?? this.auto) / field;
    const at = [(x - f.x) / f.scale, (f.y - y) / f.scale];
    this.centre = this.centre.map((c, i) => at[i] + (c - at[i]) / grown);
    this.field = field;
  }
  pan(dx, dy, f) {
    this.field ??= this.auto;
    this.centre = [this.centre[0] - dx / f.scale, this.centre[1] + dy / f.scale];
  }
  path(points, axes, f, closed) {
    const spots = points.map((n) => this.spot(n, axes, f));
    if (closed && spots.length) spots.push(spots[0]);
    const far = 90 * f.scale,
      line = [];
    spots.forEach((p, i) => {
      if (i && Math.hypot(p[0] - spots[i - 1][0], p[1] - spots[i - 1][1]) > far) line.push(null);
      line.push(p);
    });
    return line;
  }
  key() {
    return [this.centre, this.field ?? this.auto].join();
  }
  draw(pen, w, height, model, look) {
    this.still(pen, w, height, model, look);
    this.live(pen, w, height, model, look);
  }
  still(pen, w, height, model, look) {
    if (!model.axes) return;
    const f = this.frame(w, height);
    pen.within(0, 0, w, height, () => this.drawStill(pen, f, model, look));
  }
  drawStill(pen, f, model, look) {
    const { axes, orbit } = model;
    const { colours } = look;
    const bright = model.lensed && look.backdrop;
    if (bright) this.picture(pen, f, model);
    else this.rings(pen, f, colours, this.lines(model, f));
    const edge = bright ? { stroke: "#8b95a8" } : { fill: colours.shadow, stroke: colours.edge };
    pen.line(this.path(model.edge, axes, f, true), { ...edge, width: 1, closed: true });
    for (const { sky, closed } of orbit?.tracks ?? [])
      pen.line(this.path(sky, axes, f, closed), { stroke: colours.soft, width: 1, alpha: 0.6 });
    for (const curve of model.curves) this.curve(pen, curve, axes, f, look, bright);
    for (const event of orbit?.events ?? []) this.event(pen, event, axes, f, look);
    skyWords(pen, this, f, model, bright ? OVER_PICTURE : colours, this.lines(model, f));
    this.legend(pen, model, f.height, bright ? COLOURS.dark : colours, bright);
  }
  picture(pen, f, { lensed, window: [x, y, field] }) {
    const side = field * f.scale;
    pen.line(box(0, 0, f.w, f.height), { fill: "#000000", closed: true });
    pen.picture(lensed, f.x + x * f.scale - side / 2, f.y - y * f.scale - side / 2, side, side, DIM);
  }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height),
      { axes } = model;
    if (!axes) return;
    pen.within(0, 0, w, height, () => {
      if (model.shapes) this.shapes(pen, model.shapes, axes, f, look);
      for (const flash of look.flashes) this.flash(pen, flash, axes, f, look);
      const more = { most: model.shapes ? 3.5 : Infinity, points: this.lines(model, f) };
      [...model.images]
        .sort((a, b) => b.index - a.index)
        .forEach((image) => this.image(pen, image, axes, f, { ...look, ...more }));
    });
  }
  legend(pen, model, height, colours, bright) {
    const rows = model.curves.length;
    if (rows && !bright) pen.line(box(3, height - 6 - 17 * rows, 98, 17 * rows + 3), { fill: colours.paper, alpha: 0.85, closed: true });
    model.curves.forEach(({ order }, i) => {
      const y = height - 12 - 17 * (model.curves.length - 1 - i);
      const line = [
        [8, y],
        [30, y],
      ];
      if (bright) pen.line(line, OUTLINE);
      pen.line(line, { stroke: orderColour(colours, order), width: 1.8, dash: DASHES[order] });
      pen.text(36, y, NAMES[order], { fill: colours.ink, size: 11.5, align: "left", halo: colours.halo });
    });
  }
  // Where curves and the shadow's edge are drawn.
  lines({ curves, edge, axes }, f) {
    return [edge, ...curves.map(({ sky }) => sky)].flatMap((line) => line.map((n) => this.spot(n, axes, f)));
  }
  // Angles from the middle of the shadow: circles, some of which pass through what is shown.
  rings(pen, f, { grid, soft, halo }, points) {
    const reach = (x, size) => [Math.max(0, -x, x - size), Math.max(Math.abs(x), Math.abs(size - x))];
    const [[nearX, farX], [nearY, farY]] = [reach(f.x, f.w), reach(f.y, f.height)];
    const [low, high] = [Math.hypot(nearX, nearY) / f.scale, Math.min(180, Math.hypot(farX, farY) / f.scale)];
    for (const angle of ticks(low, high, 6)) {
      if (!angle) continue;
      pen.disk(f.x, f.y, angle * f.scale, { stroke: grid, width: 1 });
      const spot = labelSpot(f, angle * f.scale, points);
      if (spot) pen.text(...spot, `${angle}°`, { fill: soft, size: 11, halo });
    }
  }
  curve(pen, curve, axes, f, look, bright) {
    const colours = bright ? COLOURS.dark : look.colours;
    const style = {
      stroke: orderColour(colours, curve.order),
      width: look.draft ? 1.2 : 1.8,
      dash: DASHES[curve.order],
      alpha: look.draft ? 0.75 : 1,
    };
    const line = this.path(curve.sky, axes, f, true);
    if (bright) pen.line(line, OUTLINE);
    pen.line(line, style);
    for (const cusp of curve.cusps)
      pen.disk(...this.spot(cusp.sky, axes, f), 2.4, { fill: orderColour(colours, curve.order) });
  }
  event(pen, event, axes, f, look) {
    const [x, y] = this.spot(event.sky, axes, f);
    pen.line([[x - 4, y - 4], [x + 4, y + 4], null, [x - 4, y + 4], [x + 4, y - 4]], {
      stroke: look.colours.ink,
      width: 1.6,
    });
  }
  flash(pen, flash, axes, f, look) {
    const [x, y] = this.spot(flash.sky, axes, f),
      part = flash.part;
    pen.disk(x, y, 5 + 34 * part, { stroke: look.colours.star, width: 4 * (1 - part) + 0.5, alpha: 1 - part });
    pen.disk(x, y, 3 + 14 * part, { fill: look.colours.star, alpha: 0.6 * (1 - part) });
  }
  // Images of a disc, with their holes: limbs run round these the other way.
  shapes(pen, { limbs }, axes, f, look) {
    const colours = look.backdrop && look.hasPicture ? COLOURS.dark : look.colours;
    const areas = limbs.flatMap(({ sky }) => [...this.path(sky, axes, f, true), null]);
    pen.line(areas, { fill: colours.star, alpha: 0.5 });
    for (const { arcs } of limbs)
      for (const { index, sky } of arcs)
        pen.line(this.path(sky, axes, f, false), { stroke: indexColour(colours, index), width: 1.6 });
  }
  image(pen, image, axes, f, look) {
    let [x, y] = this.spot(image.sky, axes, f);
    const colours = look.backdrop && look.hasPicture ? COLOURS.dark : look.colours,
      colour = indexColour(colours, image.index);
    const inside = x > 8 && x < f.w - 8 && y > 8 && y < f.height - 8;
    if (!inside) {
      this.away(pen, image, x, y, f, colours);
      return;
    }
    const r = Math.min(look.most, imageSize(image.magnification)),
      even = image.index % 2 === 0;
    pen.disk(x, y, r + 1.5, { fill: colours.halo });
    pen.disk(x, y, r, { fill: even ? colour : colours.halo, stroke: colour, width: 2 });
    if (r >= 7)
      pen.text(x, y + 0.5, String(image.index), {
        fill: even ? colours.halo : colour,
        size: Math.min(13, r + 4),
        weight: 700,
      });
    else {
      const [ax, ay] = this.flat(image.sky, axes);
      // Outward, or where no curve passes through it.
      const spots = around([x, y], r + 9, Math.atan2(-ay, ax));
      const spot = clearSpot(spots, look.points, 5, 6);
      pen.text(...spot, String(image.index), { fill: colour, size: 11, weight: 700, halo: colours.halo });
    }
  }
  away(pen, image, x, y, f, colours) {
    // Outside of what is shown: an arrow at the rim, which points to it.
    const cx = f.w / 2,
      cy = f.height / 2,
      reach = Math.min(
        (f.w / 2 - 16) / Math.max(1, Math.abs(x - cx)),
        (f.height / 2 - 16) / Math.max(1, Math.abs(y - cy)),
      );
    const px = cx + (x - cx) * reach,
      py = cy + (y - cy) * reach,
      turn = Math.atan2(y - cy, x - cx);
    const corner = (a, r) => [px + r * Math.cos(turn + a), py + r * Math.sin(turn + a)];
    const colour = indexColour(colours, image.index);
    pen.line([corner(0, 11), corner(2.4, 9), corner(-2.4, 9)], { fill: colour, closed: true });
    pen.text(...corner(Math.PI, 15), String(image.index), { fill: colour, size: 11, weight: 700, halo: colours.halo });
  }
  things(model, w, height) {
    const f = this.frame(w, height),
      found = [];
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

const LABEL = 0.4 * Math.PI;

// Where the label of a ring is wholly on the panel and beside the legend: below the middle and a little to the right, as
// images lie straight below it so often, or the nearest to that.
function labelSpot({ x, y, w, height }, radius, points) {
  const [side, end] = [30, 10];
  const near = points.filter((p) => Math.abs(Math.hypot(p[0] - x, p[1] - y) - radius) < 24);
  for (let i = 0; i <= 720; i += 4) {
    const angle = LABEL + (i % 2 ? 1 : -1) * Math.ceil(i / 2) * (Math.PI / 360);
    const spot = [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
    const isIn = spot[0] > side && spot[0] < w - side && spot[1] > end && spot[1] < height - end;
    const isFree = isIn && (spot[0] > 120 || spot[1] < height - 80);
    if (isFree && !isCrossed(spot, near, 18, 9)) return spot;
  }
  return null;
}
