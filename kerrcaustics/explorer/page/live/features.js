// Cusps and extremes of caustics, from polynomials through points around each (curves/features.py), and what the page
// is told of a caustic.

const EXTREMES = { theta_min: ["theta", -1], theta_max: ["theta", 1], phi_min: ["azimuth", -1], phi_max: ["azimuth", 1] };

// Axes with signs by which each agrees with the one before.
function oriented(axes) {
  const found = [axes[0]];
  for (let i = 1; i < axes.length; i++) found.push(dot3(axes[i], found[i - 1]) < 0 ? scaled3(axes[i], -1) : axes[i]);
  return found;
}

// Points next to which the caustic turns back against its tangent, the major axis.
function reversals(points) {
  const n = points.length,
    major = oriented([...points, points[0]].map((point) => point.major)),
    along = points.map((point, i) => {
      const chord = less3(points[(i + 1) % n].direction, point.direction);
      return dot3(chord, [0, 1, 2].map((k) => major[i][k] + major[i + 1][k])) > 0;
    });
  const flipped = dot3(major[n], major[0]) < 0,
    found = [];
  for (let i = 0; i < n - 1; i++) if (along[i + 1] !== along[i]) found.push(i + 1);
  return (along[0] !== along[n - 1]) !== flipped ? [0, ...found] : found;
}

const tail = (coefficients) => most(coefficients.slice(-3).map(Math.abs));

function sectionsOf(camera, curve) {
  const { points } = curve,
    places = Object.entries(EXTREMES).map(([what, [field, sign]]) => {
      const values = points.map((point) => sign * point[field]);
      return [what, values.indexOf(most(values))];
    });
  reversals(points).forEach((i) => places.push(["cusp", i]));
  const sections = places.map(([what, i]) => {
    const [low, high] = [curve.around(i - 1).phase, curve.around(i + 1).phase];
    return { what, middle: (low + high) / 2, half: (high - low) / 2 };
  });
  const found = curve.between(camera, sections.flatMap(({ middle, half }) => NODES.map((node) => middle + half * node)));
  return sections.map((section, i) => ({ ...section, points: found.slice(NODES.length * i, NODES.length * (i + 1)) }));
}

function extremeOf({ what, points }) {
  const [field, sign] = EXTREMES[what],
    heights = points.map((point) => sign * point[field]),
    values = chebyshev(heights),
    grid = even(129, -1, 1),
    at = grid.reduce((best, x) => (chebyshevAt(values, x) > chebyshevAt(values, best) ? x : best), -1),
    place = newton(derived(values), at, Math.max(at - 1 / 64, -1), Math.min(at + 1 / 64, 1)),
    top = chebyshevAt(values, place),
    noise = most(points.map(angleError)),
    overshoot = tail(values) > 3 * noise ? Math.abs(top - most(heights)) : 0;
  return { value: sign * top, error: noise + tail(values) + overshoot };
}

// The place where the caustic's speed along its tangent changes sign, next to the middle of a section.
function cuspOf({ middle, half, points }) {
  const axes = oriented(points.map(({ major }) => major)),
    slopes = [0, 1, 2].map((k) => derived(chebyshev(points.map(({ direction }) => direction[k])))),
    speeds = NODES.map((node, j) => dot3(slopes.map((slope) => chebyshevAt(slope, node)), axes[j])),
    values = chebyshev(speeds),
    grid = even(129, -1 - 1e-9, 1 + 1e-9),
    on = Array.from(grid, (x) => chebyshevAt(values, x)),
    steps = Array.from({ length: 128 }, (_, i) => i).filter((i) => on[i] > 0 !== on[i + 1] > 0);
  if (!steps.length) return null;
  const i = steps.reduce((best, step) => (Math.abs(grid[step] + grid[step + 1]) < Math.abs(grid[best] + grid[best + 1]) ? step : best)),
    start = grid[i] + ((grid[i + 1] - grid[i]) * on[i]) / (on[i] - on[i + 1]),
    place = newton(values, start, grid[i], grid[i + 1]),
    slope = Math.abs(chebyshevAt(derived(values), place));
  const depth = chebyshevAt(chebyshev(points.map((point) => point.depth)), place);
  return { phase: middle + half * place, depth, half, missed: tail(values) ** 2 / slope };
}

function cuspsOf(camera, curve, sections) {
  const places = [];
  for (const section of sections) {
    const place = section.points.every((point) => point) ? cuspOf(section) : null;
    const same = (known) => Math.abs(mod(known.phase - place.phase + Math.PI, TWO_PI) - Math.PI) < 1e-3 * place.half;
    if (place && !places.some(same)) places.push(place);
  }
  if (!places.length) return [];
  const lines = new Lines(camera, places.map(({ phase }) => phase)),
    tips = polished(lines, places.map(() => curve.order), places.map(({ depth }) => depth));
  return tips.map((tip, i) => ({ ...tip, error: angleError(tip) + places[i].missed / Math.sin(tip.theta) }));
}

function kindOfCaustic({ isPoint, isResolved, sizeInErrors }, cusps, lost) {
  if (isPoint) return ["point", "the caustic is a point: it is not larger than its error"];
  if (!isResolved)
    return ["unresolved", `the caustic is only ${Math.round(sizeInErrors)} times its error: cusps cannot be counted`];
  if (lost) return ["unresolved", `${lost} cusps could not be traced`];
  if (cusps !== 4) return [`curve with ${cusps} cusps`, `${cusps} cusps instead of the four of an astroid`];
  return ["astroid", ""];
}

// A caustic as the page is told of it, its critical curve as the camera sees it.
function causticOf(camera, curve) {
  const { points, order, closed, onAxis } = curve,
    remarks = [...curve.remarks],
    sections = curve.isResolved ? sectionsOf(camera, curve) : [],
    numbers = {};
  let error = most(points.map(onAxis ? (point) => point.error : angleError));
  for (const [name, [field, sign]] of Object.entries(EXTREMES)) {
    numbers[name] = sign * most(points.map((point) => sign * point[field]));
    const section = sections.find(({ what }) => what === name);
    if (section?.points.every((point) => point)) {
      const extreme = extremeOf(section);
      numbers[name] = extreme.value;
      error = Math.max(error, extreme.error);
    } else if (curve.isResolved) {
      remarks.push(`${name} could not be refined between the points`);
      error += most(points.map((point, i) => stepsTo(point, points[(i + 1) % points.length])[0]));
    }
  }
  const atCusps = sections.filter(({ what }) => what === "cusp"),
    cusps = cuspsOf(camera, curve, atCusps),
    lost = atCusps.filter((section) => !section.points.every((point) => point)).length,
    [kind, remark] = kindOfCaustic(curve, cusps.length, lost),
    places = placesOf(camera, points);
  if (remark) remarks.push(remark);
  if (onAxis) {
    remarks.push("the point lies on the spin axis: phi' has no meaning and is given as 0");
    [numbers.phi_min, numbers.phi_max] = [0, 0];
    places.celestial.forEach((_, i) => (places.celestial[i] = i % 2 ? 0 : places.celestial[i]));
  }
  return {
    ...{ order, kind, closed, error, remarks, ...numbers, ...places },
    circuits: (numbers.phi_max - numbers.phi_min) / TWO_PI,
    residual: most(points.map(({ ratio }) => Math.abs(ratio))),
    cusps: cusps.map((tip) => ({ sky: camera.seen(skyOfSight(tip.sight)), celestial: [tip.theta, tip.azimuth], error: tip.error })),
  };
}
