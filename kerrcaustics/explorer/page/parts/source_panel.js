// The celestial sphere, with the caustics and the star, on the chart that is chosen.

class SourcePanel {
  constructor() {
    this.charts = { map: new MapChart(true), unwrapped: new MapChart(false), globe: new GlobeChart() };
    this.chart = this.charts.map;
    this.order = null;
  }
  // Zooms to a caustic, and to the same of other cameras until another part is chosen.
  look(curve) {
    this.order = curve.order;
    this.chart.look(curve);
  }
  reset() {
    this.order = null;
    this.chart.reset();
  }
  fit(model) {
    // A chart that an address names may not exist.
    const chart = this.charts[model.state.chart] ?? this.charts.map;
    if (chart !== this.chart) {
      chart.reset();
      this.order = null;
    }
    this.chart = chart;
    chart.fit(model);
    const curve = model.curves.find(({ order }) => order === this.order);
    if (curve) chart.look(curve);
    else if (chart.isEmpty(model)) this.reset();
  }
  frame(w, height) {
    return this.chart.frame(w, height);
  }
  key() {
    return this.chart.key();
  }
  under(x, y, f) {
    return this.chart.under(x, y, f);
  }
  zoom(factor, x, y, f) {
    this.order = null;
    this.chart.zoom(factor, x, y, f);
  }
  pan(dx, dy, f) {
    this.order = null;
    this.chart.pan(dx, dy, f);
  }
  spot(celestial, f) {
    return this.chart.spot(celestial, f);
  }
  starSpots(star, f) {
    return this.chart.starSpots(star, f);
  }
  draw(pen, w, height, model, look) {
    this.still(pen, w, height, model, look);
    this.live(pen, w, height, model, look);
  }
  still(pen, w, height, model, look) {
    this.chart.draw(pen, this.frame(w, height), model, look);
  }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height);
    const star = ({ at, back }) => drawStar(pen, at, { ...look, faint: back, small: model.state.size > 0 });
    pen.within(...this.chart.clip(f), () => {
      if (model.state.size) this.disc(pen, model.state, f, look);
      this.starSpots(model.state, f).forEach(star);
      if (look.invites) this.invite(pen, model, f, look.colours);
    });
  }
  invite(pen, { state, curves }, f, { star, halo }) {
    const [spot] = this.starSpots(state, f);
    if (!spot || spot.back) return;
    const [x, y] = clearSpot(beside(spot.at, 44, 22), this.lines(curves, f), 30, 9);
    const [left, , w] = this.chart.clip(f);
    pen.text(clamp(x, left + 32, left + w - 32), y, "drag me", { fill: star, size: 13, weight: 700, halo });
  }
  // Where the caustics are drawn.
  lines(curves, f) {
    return curves.flatMap(({ celestial }) => celestial.flatMap((point) => this.chart.spots(point, f)));
  }
  // The limb of a star of finite size.
  disc(pen, { theta, phi, size }, f, { colours }) {
    const points = smallCircle(place(theta, phi), size).map(([x, y, z]) => {
      // Longitudes next to that of the star.
      const turn = Math.atan2(y, x) / RAD;
      return [Math.acos(clamp(z, -1, 1)) / RAD, phi + mod(turn - phi + 180, TURN) - 180];
    });
    for (const shift of this.chart.shifts?.(phi) ?? [0])
      this.chart.outline(pen, points.map(([t, p]) => [t, p + shift]), f, { stroke: colours.star, width: 1.6 });
  }
  things(model, w, height) {
    const f = this.frame(w, height);
    const things = this.starSpots(model.state, f).map(({ at }) => ({ at, star: model.state }));
    const add = (celestial, thing) => this.chart.spots(celestial, f).forEach((at) => things.push({ at, ...thing }));
    for (const curve of model.curves) {
      for (const cusp of curve.cusps) add(cusp.celestial, { cusp, curve });
      for (const point of curve.celestial) add(point, { curve, point });
    }
    return things;
  }
}
