// The celestial sphere as a globe, from inside or outside: an orthographic projection of the half that is looked at.

// At first the half behind the hole is looked at, as by the camera.
const GLOBE = { lon: 160, lat: 20, zoom: 1 };

class GlobeChart {
  constructor() {
    // 1 where phi' grows to the right.
    this.side = 1;
    this.reset();
  }
  reset() {
    this.view = { ...GLOBE };
  }
  fit({ state }) {
    this.side = sideOf(state);
  }
  isEmpty() {
    return false;
  }
  key() {
    return [this.side, ...Object.values(this.view)].join();
  }
  frame(w, height) {
    return { w, h: height, R: 0.46 * Math.min(w, height) * this.view.zoom, cx: w / 2, cy: height / 2 };
  }
  // Right, up, toward the viewer.
  facing(n) {
    const [cl, sl, cb, sb] = turned(this.view);
    const [east, out] = [-n[0] * sl + n[1] * cl, n[0] * cl + n[1] * sl];
    return [east, n[2] * cb - out * sb, out * cb + n[2] * sb];
  }
  spot([theta, phi], f) {
    const [x, y, z] = this.facing(place(theta, phi));
    return [f.cx + this.side * x * f.R, f.cy - y * f.R, z];
  }
  // theta', phi' under the pointer; null beside the globe.
  under(x, y, f) {
    const [u, v] = [(this.side * (x - f.cx)) / f.R, (f.cy - y) / f.R];
    if (u * u + v * v > 1) return null;
    const z = Math.sqrt(1 - u * u - v * v);
    const [cl, sl, cb, sb] = turned(this.view);
    const [out, up] = [z * cb - v * sb, v * cb + z * sb];
    return [Math.acos(clamp(up, -1, 1)) / RAD, Math.atan2(out * sl + u * cl, out * cl - u * sl) / RAD];
  }
  zoom(factor) {
    this.view.zoom = clamp(this.view.zoom * factor, 0.6, 40);
  }
  pan(dx, dy, f) {
    this.view.lon -= (this.side * dx) / f.R / RAD;
    this.view.lat = clamp(this.view.lat + dy / f.R / RAD, -89, 89);
  }
  outline(pen, points, f, style) {
    this.line(pen, points, f, style);
  }
  starSpots({ theta, phi }, f) {
    const [x, y, z] = this.spot([theta, phi], f);
    return [{ at: [x, y], back: z < 0 }];
  }
  spots(celestial, f) {
    return [this.spot(celestial, f)].filter(([, , z]) => z >= 0);
  }
  clip(f) {
    return [0, 0, f.w, f.h];
  }
  draw(pen, f, model, { colours }) {
    pen.disk(f.cx, f.cy, f.R, { fill: colours.shadow, alpha: 0.35 });
    pen.disk(f.cx, f.cy, f.R, { stroke: colours.edge, width: 1 });
    pen.within(...this.clip(f), () => {
      this.grid(pen, f, colours);
      for (const curve of [...model.curves].reverse()) this.caustic(pen, curve, f, orderColour(colours, curve.order));
    });
    pen.text(f.w - 8, 12, seenFrom(model.state), { fill: colours.ink, size: 12, align: "right", halo: colours.halo });
  }
  // What lies behind is faint.
  line(pen, points, f, style) {
    const spots = points.map((point) => this.spot(point, f));
    const isOn = (p, back) => p && p[2] < 0 === back;
    for (const back of [true, false]) {
      const seen = spots.map((p, i) => (isOn(p, back) || isOn(spots[i - 1], back) ? p : null));
      pen.line(seen, { ...style, alpha: (style.alpha ?? 1) * (back ? 0.22 : 1) });
    }
  }
  grid(pen, f, { grid, edge }) {
    const arc = Array.from({ length: 91 }, (_, i) => i);
    for (let phi = 0; phi < TURN; phi += 30) {
      const meridian = arc.map((i) => [i * 2, phi]);
      this.line(pen, meridian, f, { stroke: grid });
    }
    for (let theta = 30; theta < 180; theta += 30) {
      const parallel = arc.map((i) => [theta, i * 4]);
      this.line(pen, parallel, f, { stroke: theta === 90 ? edge : grid });
    }
  }
  caustic(pen, curve, f, colour) {
    const closed = curve.celestial.length ? [...curve.celestial, curve.celestial[0]] : [];
    this.line(pen, closed, f, { stroke: colour, width: 1.6, dash: DASHES[curve.order] });
    for (const { celestial } of curve.cusps)
      for (const [x, y] of this.spots(celestial, f)) pen.disk(x, y, 2.6, { fill: colour });
  }
}
