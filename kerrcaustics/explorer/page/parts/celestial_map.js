// The celestial sphere as a map: theta' downward, phi' to the left as one sees it looking out, to the right as one would
// see it from outside; whole turns repeated or unwrapped.

const degrees = (angle) => `${Number(angle.toFixed(10))}°`;

class MapChart {
  constructor(wrapped) {
    this.wrapped = wrapped;
    // 1 where phi' grows to the right.
    this.side = 1;
    this.auto = [0, TURN, 0, 180];
    this.window = null;
  }
  reset() {
    this.window = null;
  }
  fit(model) {
    this.side = sideOf(model.state);
    this.auto = [0, TURN, 0, 180];
    if (this.wrapped || !model.curves.length) return;
    const [low, high] = span(model.curves.flatMap((curve) => curve.celestial.map(([, phi]) => phi)));
    const room = Math.max(40, 0.04 * (high - low), (TURN - (high - low)) / 2);
    this.auto = [low - room, high + room, 0, 180];
  }
  look(curve) {
    const [c, d] = span(curve.celestial.map(([theta]) => theta));
    const [a, b] = span(curve.celestial.map(([, phi]) => phi));
    const across = Math.max(0.1 * (b - a), 1e-4);
    const up = Math.max(0.15 * (d - c), 1e-4);
    const turns = this.wrapped ? TURN * Math.floor((a + b) / 2 / TURN) : 0;
    this.window = [a - across - turns, b + across - turns, c - up, d + up];
  }
  // Whether a part was chosen in which there is neither a curve nor the star.
  isEmpty({ curves, state }) {
    if (!this.window) return false;
    const [, , c, d] = this.window;
    const isIn = ([theta, phi]) => theta >= c && theta <= d && this.turns(phi, phi, 1).length > 0;
    return !isIn([state.theta, state.phi]) && !curves.some(({ celestial }) => celestial.some(isIn));
  }
  get shown() {
    return this.window ?? this.auto;
  }
  key() {
    return [this.wrapped, this.side, ...this.shown].join();
  }
  frame(w, height) {
    const [a, b, c, d] = this.shown;
    const labels = this.latitudes(height - 32).map(degrees);
    const [x, y] = [14 + 6.2 * Math.max(4, ...labels.map((label) => label.length)), 8];
    const [wide, high] = [w - x - 18, height - y - 24];
    // sx: negative where phi' grows to the left; a: phi' at the left border.
    const [left, sx] = this.side > 0 ? [a, wide / (b - a)] : [b, -wide / (b - a)];
    return { x, y, w: wide, h: high, sx, sy: high / (d - c), a: left, c };
  }
  spot([theta, phi], f) {
    return [f.x + (phi - f.a) * f.sx, f.y + (theta - f.c) * f.sy];
  }
  // theta', phi' under the pointer.
  under(x, y, f) {
    return [clamp(f.c + (y - f.y) / f.sy, 0, 180), f.a + (x - f.x) / f.sx];
  }
  zoom(factor, x, y, f) {
    const [a, b, c, d] = this.shown;
    const [px, py] = [f.a + (x - f.x) / f.sx, f.c + (y - f.y) / f.sy];
    const k = clamp(factor, (d - c) / 180 / 1.2, (d - c) / 1e-4);
    this.window = [px + (a - px) / k, px + (b - px) / k, py + (c - py) / k, py + (d - py) / k];
  }
  pan(dx, dy, f) {
    const [a, b, c, d] = this.shown;
    this.window = [a - dx / f.sx, b - dx / f.sx, c - dy / f.sy, d - dy / f.sy];
  }
  // Whole turns by which what lies between two longitudes is shown.
  copies(low, high, most = 40) {
    if (!this.wrapped) return [0];
    return this.turns(low, high, most);
  }
  turns(low, high, most) {
    const [a, b] = this.shown;
    const turns = [];
    for (let k = Math.ceil((a - high) / TURN); k <= Math.floor((b - low) / TURN) && turns.length < most; k++)
      turns.push(k * TURN);
    return turns;
  }
  // Whole turns by which a thing at a longitude is shown.
  shifts(phi) {
    return this.turns(phi - 90, phi + 90, 12);
  }
  outline(pen, points, f, style) {
    const wide = ([, a], [, b]) => Math.abs(a - b) > 180;
    pen.line(
      points.flatMap((point, i) => (i && wide(points[i - 1], point) ? [null] : []).concat([this.spot(point, f)])),
      style,
    );
  }
  starSpots({ theta, phi }, f) {
    return this.turns(phi, phi, 12).map((turn) => ({ at: this.spot([theta, phi + turn], f) }));
  }
  spots([theta, phi], f) {
    return this.copies(phi, phi).map((turn) => this.spot([theta, phi + turn], f));
  }
  clip(f) {
    return [f.x, f.y, f.w, f.h];
  }
  draw(pen, f, model, look) {
    const bright = model.celestial && look.backdrop;
    this.labels(pen, f, look.colours);
    pen.within(...this.clip(f), () => {
      if (bright) this.picture(pen, f, model.celestial);
      this.grid(pen, f, look.colours, bright ? 0.25 : 1);
      // Where stars can be, if not everywhere.
      for (const theta of model.heights) this.across(pen, f, theta, { stroke: look.colours.star, dash: [1, 5] });
      for (const curve of [...model.curves].reverse()) this.caustic(pen, curve, f, look, bright);
      if (model.orbit) this.orbit(pen, f, model, look, bright);
      this.words(pen, f, model, bright ? OVER_PICTURE : look.colours);
      this.names(pen, f, model.state, bright ? OVER_PICTURE : look.colours);
    });
    pen.line(box(f.x, f.y, f.w, f.h), { stroke: look.colours.edge, width: 1, closed: true });
  }
  words(pen, f, { state, curves }, { soft, halo }) {
    const points = curves.flatMap(({ celestial }) => celestial.flatMap((point) => this.spots(point, f)));
    for (const at of this.spots(behindHole(state), f)) {
      const spot = clearSpot(column(at, 24, 140), points, 48, 9);
      // A line leads to words that stand away.
      const [end, side] = [spot[1] - at[1], Math.sign(spot[1] - at[1])];
      if (Math.abs(end) > 24) pen.line([[at[0], at[1] + 8 * side], [at[0], spot[1] - 9 * side]], { stroke: soft, width: 0.8 });
      pen.text(...spot, "behind the hole", { fill: soft, size: 12, halo });
    }
  }
  // The names of the axes with the senses in which they grow, and the side from which the sphere is seen.
  names(pen, f, state, { soft, ink, halo }) {
    const word = (x, y, text, align, fill = soft) => pen.text(x, y, text, { fill, size: 12, align, halo });
    word(f.x + 6, f.y + 11, "θ′ ↓", "left");
    if (this.side > 0) word(f.x + f.w - 6, f.y + f.h - 10, "φ′ →", "right");
    else word(f.x + 6, f.y + f.h - 10, "← φ′", "left");
    word(f.x + f.w - 6, f.y + 11, seenFrom(state), "right", ink);
  }
  // As many as have room for their labels.
  longitudes(width) {
    const [a, b] = this.shown;
    for (let most = clamp(Math.floor(width / 56), 2, 12); ; most--) {
      const values = ticks(a, b, most);
      const longest = Math.max(...values.map((phi) => this.longitude(phi).length));
      if (most <= 1 || values.length * (6.2 * longest + 14) < width) return values;
    }
  }
  latitudes(height) {
    const [, , c, d] = this.shown;
    return ticks(Math.max(0, c), Math.min(180, d), clamp(Math.floor(height / 34), 2, 12));
  }
  longitude(phi) {
    return degrees(this.wrapped ? mod(phi, TURN) || (phi ? TURN : 0) : phi);
  }
  labels(pen, f, { soft }) {
    for (const phi of this.longitudes(f.w)) {
      const label = this.longitude(phi);
      const half = 3.1 * label.length;
      const [x] = this.spot([f.c, phi], f);
      // The last label ends at the side of the panel.
      pen.text(clamp(x, half, f.x + f.w + 16 - half), f.y + f.h + 13, label, { fill: soft, size: 11 });
    }
    for (const theta of this.latitudes(f.h))
      pen.text(f.x - 6, this.spot([theta, f.a], f)[1], degrees(theta), { fill: soft, size: 11, align: "right" });
  }
  picture(pen, f, image) {
    pen.line(box(f.x, f.y, f.w, f.h), { fill: "#000000", closed: true });
    const [a, b] = this.shown;
    for (let k = Math.floor(a / TURN); k * TURN < b; k++)
      pen.picture(image, ...this.spot([0, k * TURN], f), TURN * f.sx, 180 * f.sy, DIM);
  }
  grid(pen, f, { grid }, alpha) {
    const style = { stroke: grid, alpha };
    for (const phi of this.longitudes(f.w)) {
      const [x] = this.spot([0, phi], f);
      pen.line(
        [
          [x, f.y],
          [x, f.y + f.h],
        ],
        style,
      );
    }
    for (const theta of this.latitudes(f.h)) this.across(pen, f, theta, style);
  }
  across(pen, f, theta, style) {
    const [, y] = this.spot([theta, 0], f);
    pen.line(
      [
        [f.x, y],
        [f.x + f.w, y],
      ],
      style,
    );
  }
  orbit(pen, f, { orbit, state }, look, bright) {
    this.across(pen, f, state.theta, { stroke: look.colours.star, width: 1.2, dash: [3, 4] });
    for (const { phi } of orbit.events)
      for (const { at } of this.starSpots({ theta: state.theta, phi }, f))
        pen.line(cross(at), { stroke: bright ? "#fff" : look.colours.ink, width: 1.6 });
  }
  caustic(pen, curve, f, look, bright) {
    const stroke = orderColour(bright ? COLOURS.dark : look.colours, curve.order);
    const style = { stroke, width: look.draft ? 1.1 : 1.6, dash: DASHES[curve.order], alpha: look.draft ? 0.75 : 1 };
    const [low, high] = span(curve.celestial.map(([, phi]) => phi));
    for (const turn of this.copies(low, high)) {
      const line = curve.celestial.map(([theta, phi]) => this.spot([theta, phi + turn], f));
      if (line.length) line.push(line[0]);
      if (bright) pen.line(line, OUTLINE);
      pen.line(line, style);
      const middle = [curve.celestial[0][0], (low + high) / 2 + turn];
      // What is too small to be seen has a ring round it.
      if ((high - low) * Math.abs(f.sx) < 9) pen.disk(...this.spot(middle, f), 6, { stroke, width: 1.2, alpha: 0.8 });
      else this.cusps(pen, curve, f, turn, stroke);
    }
  }
  cusps(pen, curve, f, turn, fill) {
    for (const { celestial } of curve.cusps)
      pen.disk(...this.spot([celestial[0], celestial[1] + turn], f), 2.6, { fill });
  }
}
