// Whole critical curves: sampled so that curve and caustic are smooth to the eye, closed, and checked
// (curves/critical_curves.py). The curves are those of a camera at rest.

const SEARCH_LINES = 64,
  COARSE_LINES = 48,
  CROWDING = 0.9,
  LONGEST = Math.PI / 90,
  LONGEST_PART = 1 / 80,
  MOST_POINTS = 40000,
  BLUR_ERRORS = 10;

const linesAround = (n) => Array.from({ length: n }, (_, i) => (TWO_PI * i) / n);

function searched(camera, lines, orders) {
  const { found, twice } = brackets(new Lines(camera, lines), orders),
    points = found.length ? refined(camera, found.map(({ line }) => lines[line]), found) : [];
  return { points, twice };
}

// Few points of each curve, which lie on it: for a camera that moves.
function coarseCurves(camera, orders) {
  const { points } = searched(camera, linesAround(COARSE_LINES), orders),
    curves = [];
  for (let order = 1; order <= orders; order++) {
    const own = points.filter((point) => point.order === order);
    if (own.length > 2) curves.push({ order, ...placesOf(camera, own) });
  }
  return curves;
}

const placesOf = (camera, points) => ({
  sky: flat(points.map(({ sight }) => camera.seen(skyOfSight(sight)))),
  celestial: flat(points.map(({ theta, azimuth }) => [theta, azimuth])),
});

class CriticalCurve {
  constructor(order, points, remarks) {
    Object.assign(this, { order, points, remarks, closed: !remarks.length });
    this.error = most(points.map(({ error }) => error));
    const middle = [0, 1, 2].map((k) => points.reduce((sum, { direction }) => sum + direction[k], 0) / points.length);
    this.middle = middle;
    this.spread = most(points.map(({ direction }) => gap3(direction, middle)));
    this.sizeInErrors = this.spread / this.error;
    this.isPoint = this.sizeInErrors <= 3 && this.error < 1e-3;
    this.isResolved = this.sizeInErrors > 300;
    this.blur = BLUR_ERRORS * (this.spread + this.error);
    this.onAxis = this.isPoint && most(points.map(({ theta }) => Math.sin(theta))) <= 3 * this.error;
  }
  get depths() {
    return (this.spline ??= new Periodic(
      this.points.map(({ phase }) => phase),
      this.points.map(({ depth }) => depth),
    ));
  }
  // Point i of a curve that goes on around its ends.
  around(i) {
    const n = this.points.length,
      point = this.points[mod(i, n)];
    return { ...point, phase: point.phase + TWO_PI * Math.floor(i / n) };
  }
  // Points at phases between those of the curve; null for those that are not found. Cubics through four neighbours.
  between(camera, phases) {
    return between(camera, this.order, phases, (phase) => this.neighbours(phase));
  }
  neighbours(phase) {
    const start = this.points[0].phase,
      turns = Math.floor((phase - start) / TWO_PI),
      i = pieceAt((this.phases ??= this.points.map((point) => point.phase)), phase - TWO_PI * turns) + turns * this.points.length;
    const beyond = phase - TWO_PI * turns >= this.points.at(-1).phase ? 1 : 0;
    return [-1, 0, 1, 2].map((k) => this.around(i + beyond + k));
  }
}

function cubicThrough(places, values, at) {
  return values.reduce((sum, value, k) => {
    const factor = places.reduce((product, place, j) => (j === k ? product : (product * (at - place)) / (places[k] - place)), 1);
    return sum + value * factor;
  }, 0);
}

// Points of a curve at phases, from four known neighbours of each; null where there is none close to them.
function between(camera, order, phases, neighbours) {
  if (!phases.length) return [];
  const near = phases.map(neighbours),
    depthsOf = (points) => points.map(({ depth }) => depth),
    guesses = near.map((points, i) => cubicThrough(points.map(({ phase }) => phase), depthsOf(points), phases[i])),
    points = polished(new Lines(camera, phases), phases.map(() => order), guesses);
  const reach = near.map((four) => {
    const depths = depthsOf(four),
      margin = most([0, 1, 2].map((k) => Math.abs(depths[k + 1] - depths[k])));
    return [Math.max(Math.min(depths[1], depths[2]) - margin, 0), Math.max(depths[1], depths[2]) + margin];
  });
  const moved = points.flatMap((point, i) => (Math.abs(point.depth - guesses[i]) > LABEL_STEP ? [i] : [])),
    holds = labelled(moved.map((i) => points[i]), camera);
  return points.map((point, i) => {
    const [low, high] = reach[i],
      own = !moved.includes(i) || holds[moved.indexOf(i)];
    if (own && isOnCurve(point) && point.depth > low - 1e-3 && point.depth < high + 1e-3) return point;
    return retried(camera, { order, low: Math.max(low - 0.6, 0), high: high + 0.6 }, phases[i]);
  });
}

const stepsTo = (one, other) => [
  Math.hypot(other.theta - one.theta, Math.sin((one.theta + other.theta) / 2) * (other.azimuth - one.azimuth)),
  2 * Math.asin(Math.min(gap3(one.sight, other.sight) / 2, 1)),
];

// Phases at which steps of a closed curve that are too long are cut.
function cutsOf(points) {
  const ends = (name) => [most(points.map((point) => point[name])), least(points.map((point) => point[name]))],
    [high, low] = ends("theta"),
    [east, west] = ends("azimuth"),
    size = Math.max(high - low, most(points.map(({ theta }) => Math.sin(theta))) * Math.min(east - west, TWO_PI)),
    longest = Math.max(Math.min(LONGEST, size * LONGEST_PART), 3 * most(points.map(angleError)));
  return points.flatMap((point, i) => {
    const next = points[i + 1] ?? { ...points[0], phase: points[0].phase + TWO_PI },
      [onCaustic, onSky] = stepsTo(point, next),
      excess = Math.max(onCaustic / longest, onSky / LONGEST),
      parts = excess > 1 ? Math.min(Math.ceil(excess + 0.1), 8) : 1;
    return Array.from({ length: parts - 1 }, (_, k) => point.phase + ((k + 1) / parts) * (next.phase - point.phase));
  });
}

function sampled(camera, order, points) {
  const missed = new Set(),
    remarks = [];
  for (let halving = 0; points.length > 3; halving++) {
    const cuts = cutsOf(points).filter((phase) => !missed.has(phase));
    if (!cuts.length) break;
    if (halving === 14 || points.length >= MOST_POINTS) {
      remarks.push(`${cuts.length} steps between neighbours stayed longer than they should`);
      break;
    }
    const curve = new CriticalCurve(order, points, []),
      found = curve.between(camera, cuts);
    found.forEach((point, i) => point ?? missed.add(cuts[i]));
    points = [...points, ...found.filter((point) => point)].sort((one, other) => one.phase - other.phase);
  }
  if (missed.size) remarks.push(`${missed.size} points between neighbours could not be found`);
  return { points, remarks };
}

// The critical curves of order 1 to orders that could be followed.
function criticalCurves(camera, orders) {
  const lines = linesAround(SEARCH_LINES).map((line) => line - CROWDING * camera.spin ** 4 * Math.sin(line)),
    { points: every, twice } = searched(camera, lines, orders),
    curves = [];
  for (let order = 1; order <= orders; order++) {
    const own = every.filter((point) => point.order === order),
      errors = own.map(({ error }) => error).sort((a, b) => a - b);
    if (!own.length || !(errors[errors.length >> 1] < 1e-3)) continue;
    const { points, remarks } = sampled(camera, order, own);
    if (!labelled(points, camera).every((holds) => holds)) continue;
    if (own.length < lines.length) remarks.push(`${lines.length - own.length} of ${lines.length} lines of the search hold no point`);
    const onCaustic = points.map((point, i) => stepsTo(point, points[(i + 1) % points.length])[0]),
      last = onCaustic.pop();
    if (points.length > 1 && !(last <= 3 * Math.max(most(onCaustic), most(points.map(angleError)))))
      remarks.push("the ends of the curve do not meet");
    if (twice.has(order)) remarks.push(`the Morse index shows more than one critical curve of order ${order}`);
    curves.push(new CriticalCurve(order, points, remarks));
  }
  return curves;
}
