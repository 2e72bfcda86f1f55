// Lines across the sky from the shadow edge to the direction opposite to the hole: on a line of an edge phase, depth
// counts the e-foldings of the distance to the edge (lens_map/sky_lines.py).

const DEEPEST = 32;

class Lines {
  constructor(camera, phases) {
    const n = phases.length;
    Object.assign(this, { camera, phases, count: n, edge: edgeSights(camera, phases) });
    this.away = new Float64Array(3 * n);
    this.reach = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      const [r, theta, phi] = row3(this.edge, i),
        across = Math.hypot(theta, phi);
      this.away.set([across, (-r * theta) / across, (-r * phi) / across], 3 * i);
      this.reach[i] = Math.PI - Math.atan2(across, -r);
    }
  }
  // The line of sight at a depth of line i.
  sight(i, depth) {
    const angle = this.reach[i] * Math.exp(-depth),
      [c, s] = [Math.cos(angle), Math.sin(angle)],
      parts = [0, 1, 2].map((k) => this.edge[3 * i + k] * c + this.away[3 * i + k] * s);
    return scaled3(parts, 1 / size3(parts));
  }
  // Directions N at depths of lines, by their numbers.
  sky(which, depths) {
    const sky = new Float64Array(3 * which.length);
    for (let j = 0; j < which.length; j++) sky.set(skyOfSight(this.sight(which[j], depths[j])), 3 * j);
    return sky;
  }
}

// The distance (radians) of the shadow edge from the direction to the hole, in even pieces of the position angle: four
// powers of a cubic each, as the kernels of Newton's method read it.
const PIECES = 8192,
  TABLE = 4096;

function edgeTable(camera) {
  const sights = edgeSights(camera, evenPhases(camera, even(TABLE + 1, 0, 1).slice(0, TABLE))),
    about = Array.from({ length: TABLE }, (_, i) => row3(sights, i)).map(([r, theta, phi]) => [
      Math.atan2(phi, theta),
      Math.atan2(Math.hypot(theta, phi), -r),
    ]);
  about.sort((one, other) => one[0] - other[0]);
  const kept = about.filter(([angle], i) => !i || angle - about[i - 1][0] > 1e-7),
    size = new Periodic(
      kept.map(([angle]) => angle),
      kept.map(([, distance]) => distance),
    );
  const table = new Float64Array(4 * PIECES),
    width = TWO_PI / PIECES,
    nodes = Array.from({ length: PIECES + 1 }, (_, i) => [size.at(width * i - Math.PI), size.at(width * i - Math.PI, 1)]);
  for (let i = 0; i < PIECES; i++) {
    const [[from, before], [to, after]] = [nodes[i], nodes[i + 1]],
      rate = (to - from) / width,
      bend = (before + after - 2 * rate) / width;
    table.set([bend / width, (rate - before) / width - bend, before, from], 4 * i);
  }
  return table;
}
