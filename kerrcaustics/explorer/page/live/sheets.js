// The camera sky cut along its critical curves: one sheet for each Morse index, covered by a grid that gives guesses of
// images, and the counts at the north pole (images/sheets.py, sheet_grids.py, sheet_cells.py).

const GRID_STEP = Math.PI / 18,
  MOST_NODES = 400000,
  COARSE = (40 * Math.PI) / 180,
  PROBES = 24,
  PROBE_POINTS = 129,
  NARROW = 0.05,
  WIDE = 0.5,
  LINEAR = 0.25,
  INSIDE = 0.002;
// Directions at which images are counted on the grids: generic ones.
const REFERENCES = [
  [0.4, 1.0],
  [0.9, 4.0],
  [1.3, 2.5],
  [2.1, 5.5],
  [2.6, 0.3],
].map(([theta, phi]) => fromAngles(theta, phi));

// Numbers of the first node, the last, and as few between them as keep sums of steps below the longest.
function spaced(steps, longest) {
  const chosen = [0];
  let run = 0,
    passed = 0;
  for (let i = 0; i < steps.length - 1; i++) {
    run += steps[i] / longest;
    // A step that is no number, and all behind it, are one.
    const now = Number.isNaN(run) ? Infinity : Math.floor(run);
    if (now !== passed) chosen.push(i + 1);
    passed = now;
  }
  return [...chosen, steps.length];
}

// The map on lines of a sheet at parts of the way from its outer edge to the inner one.
function mappedGrid(camera, phases, parts, depthAt) {
  const lines = new Lines(camera, phases),
    which = [],
    depths = [];
  phases.forEach((phase, i) =>
    parts.forEach((part) => {
      which.push(i);
      depths.push(depthAt(phase, part));
    }),
  );
  const { direction, status, known } = traced(camera, lines.sky(which, depths), { beams: false });
  status.forEach((state, i) => {
    if (state !== REACHED || !known[i]) direction.fill(NaN, 3 * i, 3 * i + 3);
  });
  return direction;
}

function sheetOf(camera, index, outer, curve) {
  const { points } = curve,
    depthAt = (phase, part) => {
      const low = outer ? outer.depths.at(phase) : 0;
      return low + part * (curve.depths.at(phase) - low);
    };
  const stepTo = (point, before) =>
    Math.max(gap3(point.direction, before.direction), gap3(point.sight, before.sight), point.phase - before.phase);
  const steps = points.slice(1).map((point, i) => stepTo(point, points[i])),
    thinned = (step) => spaced(steps, step).map((i) => points[i].phase);
  const every = thinned(GRID_STEP),
    skip = Math.max(1, Math.floor(every.length / PROBES)),
    probes = every.filter((_, i) => i % skip === 0),
    along = mappedGrid(camera, probes, even(PROBE_POINTS, 0, 1), depthAt);
  const length = most(
    probes.map((_, i) => {
      let sum = 0;
      for (let j = i * PROBE_POINTS; j < (i + 1) * PROBE_POINTS - 1; j++) sum += gap3(row3(along, j), row3(along, j + 1)) || 0;
      return sum;
    }),
  );
  const step = GRID_STEP * Math.max(1, Math.sqrt((every.length * length) / GRID_STEP / MOST_NODES)),
    phases = thinned(step);
  phases.push(phases[0] + TWO_PI);
  const parts = even(Math.ceil(length / step) + 2, 0, 1);
  return { index, step, phases, parts, depthAt, grid: mappedGrid(camera, phases, parts, depthAt) };
}

// The cells of a sheet: two opposite corners by phase and part, and images of four.
function cellsOf({ index, step, phases, parts, grid }) {
  const columns = parts.length,
    nearEdge = [1, 2, 4, 8].flatMap((k) => [k, columns - 1 - k]).filter((k) => k > 0 && k < columns - 1),
    nodes = Array.from({ length: grid.length / 3 }, (_, i) => row3(grid, i)),
    stepsOn = (i) => Float64Array.from({ length: columns - 1 }, (_, j) => gap3(nodes[i * columns + j], nodes[i * columns + j + 1])),
    cells = [];
  for (let i = 0, before = stepsOn(0); i < phases.length - 1; i++) {
    const after = stepsOn(i + 1),
      chosen = [...new Set([...spaced(before.map((one, j) => Math.max(one, after[j])), step), ...nearEdge])].sort((a, b) => a - b);
    for (let c = 0; c < chosen.length - 1; c++) {
      const [low, high] = [i * columns + chosen[c], i * columns + chosen[c + 1]],
        corners = [nodes[low], nodes[low + columns], nodes[high], nodes[high + columns]];
      if (corners.every(([x]) => x === x))
        cells.push({ index, corners, phase: [phases[i], phases[i + 1]], part: [parts[chosen[c]], parts[chosen[c + 1]]] });
    }
    before = after;
  }
  return cells;
}

// Linear maps from a star to its place in each cell, whose middle is 0: two rows of four numbers a cell, and the middles
// with the squares of the distances within which the maps are trusted.
function linearMaps(cells) {
  const maps = new Float64Array(12 * cells.length);
  cells.forEach(({ corners: [a, b, c, d] }, i) => {
    const along = [0, 1, 2].map((k) => (b[k] + d[k] - a[k] - c[k]) / 2),
      across = [0, 1, 2].map((k) => (c[k] + d[k] - a[k] - b[k]) / 2),
      whole = [0, 1, 2].map((k) => a[k] + b[k] + c[k] + d[k]),
      middle = scaled3(whole, 1 / size3(whole)),
      normal = cross3(along, across),
      square = dot3(normal, normal) || 1,
      [u, v] = [scaled3(cross3(across, normal), 1 / square), scaled3(cross3(normal, along), 1 / square)],
      reach = 1.25 * Math.max(gap3(a, middle), gap3(b, middle), gap3(c, middle), gap3(d, middle));
    maps.set([...u, -dot3(u, middle), ...v, -dot3(v, middle), ...middle, reach * reach], 12 * i);
  });
  return maps;
}

// The place (u, v) of a star in a cell, if the map were bilinear in the tangent plane.
function bilinearPlace(corners, star) {
  const [east, north] = tangentsAt(star);
  const [p, one, two, three] = corners.map((corner) => {
      const toward = Math.max(dot3(corner, star), 0.2);
      return [dot3(corner, east) / toward, dot3(corner, north) / toward];
    }),
    [pu, pv] = [one, two].map((corner) => [corner[0] - p[0], corner[1] - p[1]]),
    puv = [0, 1].map((k) => three[k] - one[k] - pv[k]);
  let [u, v] = [0.5, 0.5];
  for (let i = 0; i < 4; i++) {
    const value = [0, 1].map((k) => p[k] + pu[k] * u + pv[k] * v + puv[k] * u * v),
      du = [0, 1].map((k) => pu[k] + puv[k] * v),
      dv = [0, 1].map((k) => pv[k] + puv[k] * u),
      area = du[0] * dv[1] - du[1] * dv[0] || 1;
    [u, v] = [bounded(u - (value[0] * dv[1] - value[1] * dv[0]) / area, -1, 2), bounded(v - (du[0] * value[1] - du[1] * value[0]) / area, -1, 2)];
  }
  return [u, v];
}

// Counts of images by sheet, from those at the pole and the windings of the caustics.
const changes = (windings) => windings.map(({ count }, k) => (count - (windings[k - 1]?.count ?? 0)) * (k % 2 ? -1 : 1));

class Sheets {
  constructor(camera, curves) {
    Object.assign(this, { camera, curves, table: edgeTable(camera) });
    this.sheets = curves.map((curve, k) => sheetOf(camera, k, curves[k - 1], curve));
    this.cells = this.sheets.flatMap(cellsOf);
    this.maps = linearMaps(this.cells);
    this.atPole = this.sheets.map(() => 0);
    const known = REFERENCES.map((star) => {
      const change = changes(curves.map((curve) => windingOf(camera, curve, star)));
      return this.sheets.map(({ grid, parts }, k) => (k % 2 ? -1 : 1) * degreeOf(grid, parts.length, star) - change[k]);
    });
    this.atPole = this.sheets.map((_, k) => known.map((counts) => counts[k]).sort((a, b) => a - b)[2]);
    this.isCoarse = this.sheets.map(({ step }) => step > COARSE);
  }
  expected(star) {
    const windings = this.curves.map((curve) => windingOf(this.camera, curve, star));
    return { windings, counts: changes(windings).map((change, k) => this.atPole[k] + change) };
  }
  // Guesses of images: index and direction N on the sky at rest.
  starts(star, margin) {
    const [x, y, z] = star,
      reach = 0.5 + LINEAR + margin,
      { maps } = this,
      found = [];
    for (let i = 0; i < this.cells.length; i++) {
      const m = 12 * i,
        [p, q, r] = [x - maps[m + 8], y - maps[m + 9], z - maps[m + 10]];
      if (p * p + q * q + r * r > maps[m + 11] * (1 + margin) ** 2) continue;
      if (Math.abs(maps[m] * x + maps[m + 1] * y + maps[m + 2] * z + maps[m + 3]) > reach) continue;
      if (Math.abs(maps[m + 4] * x + maps[m + 5] * y + maps[m + 6] * z + maps[m + 7]) > reach) continue;
      const cell = this.cells[i],
        [u, v] = bilinearPlace(cell.corners, star);
      if (Math.max(Math.abs(u - 0.5), Math.abs(v - 0.5)) > 0.5 + margin) continue;
      const place = (ends, w) => ends[0] + bounded(w, 0, 1) * (ends[1] - ends[0]),
        [phase, part] = [place(cell.phase, u), bounded(place(cell.part, v), INSIDE, 1 - INSIDE)];
      found.push({ index: cell.index, phase, depth: this.sheets[cell.index].depthAt(phase, part) });
    }
    return found;
  }
}
