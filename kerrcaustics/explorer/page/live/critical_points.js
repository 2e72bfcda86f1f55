// Points of critical curves: on a line across the shadow edge the curve of order k lies where the Morse index grows from
// k - 1 to k, and there the minor diameter of the beam passes through zero (curves/critical_points.py).
//
// A point has order, phase, depth, sight, direction, theta, azimuth, major, ratio and error.

const STEP = 0.5,
  DEPTH_OF_ORDER = 3.5,
  SECTIONS = 9,
  LABEL_STEP = 1e-3,
  RESIDUAL = 1e-10,
  MANY = 1 << 20;

// Index (many where captured) and ratio of the diameters at depths of lines, by their numbers. NaN where not known.
function indexAndRatio(lines, which, depths) {
  const { camera } = lines,
    index = new Int32Array(which.length),
    ratio = new Float64Array(which.length).fill(1),
    bent = [],
    sights = [];
  for (let j = 0; j < which.length; j++) {
    const sight = lines.sight(which[j], depths[j]);
    // Rays close to the principal null directions meet no conjugate point.
    if (sight[0] >= 1 || !(camera.k(scaled3(sight, -1)) >= LEAST_K)) continue;
    bent.push(j);
    sights.push(skyOfSight(sight));
  }
  const beams = traced(camera, flat(sights));
  bent.forEach((j, i) => {
    const captured = beams.status[i] === CAPTURED,
      { minor, major } = shapeOf(beams.jacobian, i);
    index[j] = captured ? MANY : beams.index[i];
    ratio[j] = captured ? -1 : beams.known[i] ? minor / major : NaN;
  });
  return { index, ratio };
}

function pointsAt(lines, which, depths, orders) {
  const beams = traced(lines.camera, lines.sky(which, depths));
  return Array.from(which, (i, j) => {
    const sight = lines.sight(i, depths[j]),
      direction = row3(beams.direction, j),
      { major, minor, angle } = shapeOf(beams.jacobian, j),
      [eTheta, ePhi] = polarBasis(direction),
      axis = eTheta.map((part, k) => Math.cos(angle) * part + Math.sin(angle) * ePhi[k]);
    return {
      order: orders[j],
      phase: lines.phases[i],
      depth: depths[j],
      sight,
      direction,
      theta: Math.atan2(Math.hypot(direction[0], direction[1]), direction[2]),
      // Rays with b > 0, which move along phi, pass the axis as many times as their order: the curve closes.
      azimuth: beams.azimuth[j] + (sight[2] < 0 ? TWO_PI * orders[j] : 0),
      major: axis,
      ratio: beams.known[j] && beams.status[j] === REACHED ? minor / major : NaN,
      error: beams.error[j],
    };
  });
}

const angleError = ({ error, theta }) => error / Math.max(Math.sin(theta), error);
const isOnCurve = ({ ratio }) => Math.abs(ratio) < RESIDUAL;

// Points refined from depths that are close, by Halley's steps on three beams each, one for each line.
function polished(lines, orders, guesses) {
  const n = lines.count,
    depths = Float64Array.from(guesses);
  let active = Array.from({ length: n }, (_, i) => i);
  for (let turn = 0; turn < 7 && active.length; turn++) {
    const differences = active.map((i) => 1e-5 + 1e-11 * Math.exp(depths[i])),
      which = active.flatMap((i) => [i, i, i]),
      places = active.flatMap((i, j) => [depths[i], depths[i] - differences[j], depths[i] + differences[j]]),
      beams = traced(lines.camera, lines.sky(which, places));
    const ratio = (j) => {
      const { minor, major } = shapeOf(beams.jacobian, j);
      return beams.known[j] ? minor / major : NaN;
    };
    active = active.filter((i, j) => {
      const [here, outer, inner] = [ratio(3 * j), ratio(3 * j + 1), ratio(3 * j + 2)],
        slope = (inner - outer) / (2 * differences[j]),
        bend = (inner + outer - 2 * here) / differences[j] ** 2;
      let step = -here / slope;
      step = bounded(step / (1 + bounded((step * bend) / (2 * slope), -0.5, 0.5)), -0.2, 0.2);
      if (!Number.isFinite(step)) step = 0;
      depths[i] += step;
      const left = Math.abs(step) * (step ** 2 + differences[j] ** 2);
      return left > 1e-15 && Math.abs(step) > 1e-5 * differences[j];
    });
  }
  return pointsAt(lines, Array.from({ length: n }, (_, i) => i), depths, orders);
}

// Depths above and below each curve on each line, and orders that the index shows more than once.
function brackets(lines, orders) {
  const n = lines.count,
    numbers = Array.from({ length: n }, (_, i) => i),
    rows = [];
  let depth = 0;
  const search = (count) => {
    const depths = Array.from({ length: count }, (_, i) => depth + STEP * i),
      { index } = indexAndRatio(lines, depths.flatMap(() => numbers), depths.flatMap((d) => Array(n).fill(d)));
    depths.forEach((d, i) => rows.push({ depth: d, index: index.subarray(i * n, (i + 1) * n) }));
    depth += STEP * count;
  };
  const passed = () => rows.findIndex(({ index }) => index.every((k) => k >= orders));
  search(Math.ceil((DEPTH_OF_ORDER * orders) / STEP));
  while (passed() < 0 && depth <= DEEPEST) search(4);
  if (passed() >= 0) rows.length = passed() + 1;
  const found = [],
    twice = new Set();
  for (let order = 1; order <= orders; order++) {
    let pieces = 0;
    for (let i = 0; i < n; i++) {
      const first = rows.findIndex(({ index }) => index[i] >= order && index[i] < MANY);
      if (first > 0) found.push({ order, line: i, low: rows[first - 1].depth, high: rows[first].depth });
      for (let j = 1; j < rows.length; j++) if (rows[j].index[i] < order && rows[j - 1].index[i] >= order) twice.add(order);
      if (rows[0].index[i] < order && rows[0].index[mod(i - 1, n)] >= order) pieces += 1;
    }
    if (pieces > 1) twice.add(order);
  }
  return { found, twice };
}

// |minor| / major next to curves of given orders, else 1; negative inside of them.
function sides(lines, which, depths, orders) {
  const { index, ratio } = indexAndRatio(lines, which, depths);
  return Array.from(index, (k, j) => {
    const size = k === orders[j] || k === orders[j] - 1 ? Math.abs(ratio[j]) : 1;
    return k >= orders[j] ? -size : size;
  });
}

// Points, one for each bracket that holds one, on lines with the phases of the brackets.
function refined(camera, phases, asked) {
  const lines = new Lines(camera, phases),
    orders = asked.map(({ order }) => order),
    which = asked.flatMap((_, i) => Array(SECTIONS).fill(i)),
    depths = asked.flatMap(({ low, high }) => Array.from(even(SECTIONS, low, high))),
    side = sides(lines, which, depths, which.map((i) => orders[i])),
    width = asked.map(({ low, high }) => (high - low) / (SECTIONS - 1));
  const starts = asked.map((_, i) => {
    const own = side.slice(SECTIONS * i, SECTIONS * (i + 1)),
      after = own.findIndex((value) => value < 0);
    if (after < 1) return null;
    return depths[SECTIONS * i + after - 1] + (width[i] * own[after - 1]) / (own[after - 1] - own[after]);
  });
  const points = polished(lines, orders, starts.map((start, i) => start ?? asked[i].low)),
    good = points.map((point, i) => starts[i] !== null && isOnCurve(point) && Math.abs(point.depth - starts[i]) < width[i]);
  const moved = points.flatMap((point, i) => (good[i] && Math.abs(point.depth - starts[i]) > LABEL_STEP ? [i] : []));
  labelled(moved.map((i) => points[i]), camera).forEach((holds, j) => (good[moved[j]] = holds));
  return points.map((point, i) => (good[i] ? point : retried(camera, asked[i], phases[i]))).filter((point) => point);
}

// A point by halving a bracket, where steps lead nowhere.
function retried(camera, { order, low, high }, phase) {
  const lines = new Lines(camera, [phase]),
    side = (depth) => sides(lines, [0], [depth], [order])[0];
  if (!(side(low) > 0 && side(high) < 0)) return null;
  const [point] = polished(lines, [order], [bisectedCoarsely(side, low, high)]);
  return isOnCurve(point) && labelled([point], camera)[0] ? point : null;
}

function bisectedCoarsely(f, low, high) {
  while (high - low > 1e-6) {
    const middle = (low + high) / 2;
    if (f(middle) > 0) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

// True where the index is order - 1 on the outer side of a point, and order on the inner side.
function labelled(points, camera) {
  if (!points.length) return [];
  const lines = new Lines(camera, points.map(({ phase }) => phase)),
    which = points.flatMap((_, i) => [i, i]),
    { index } = indexAndRatio(lines, which, points.flatMap(({ depth }) => [depth - LABEL_STEP, depth + LABEL_STEP]));
  return points.map(({ order }, i) => index[2 * i] === order - 1 && index[2 * i + 1] === order);
}
