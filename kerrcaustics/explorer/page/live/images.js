// All images of a star, and whether they are: the search finds as many as the caustics require (images/search.py).

const MOST_STEPS = 80,
  FOUND = 1,
  UNSURE = 3,
  DELICATE = 1e-6,
  FOLD_STEP = 1e-3,
  FOLD_REACH = 0.5,
  FOLD_DISTANCE = 0.1,
  SAME = 1e-9,
  SAME_ERRORS = 10,
  ROUNDING = 4e-16;

// A camera's critical curves, caustics and sheets. They depend on its place alone, but for how the camera sees them.
function eventOf(camera, orders) {
  const curves = criticalCurves(camera, orders),
    missing = Array.from({ length: orders }, (_, k) => k + 1).filter((order) => !curves.some((curve) => curve.order === order));
  // The page's images need every curve whole.
  const unbroken = curves.findIndex((curve, k) => curve.order !== k + 1 || !curve.closed),
    whole = unbroken < 0 ? curves.length : unbroken;
  return {
    ...{ orders, missing, curves: curves.map((curve) => causticOf(camera, curve)) },
    sheets: whole === orders ? new Sheets(camera, curves) : null,
  };
}

// The map next to a critical curve, to second order: n' = c + a s T + e s^2 N for a step s in depth.
function foldOf(camera, { points }) {
  const lines = new Lines(camera, points.map(({ phase }) => phase)),
    numbers = points.map((_, i) => i),
    depths = (sign) => points.map(({ depth }) => Math.max(depth + sign * FOLD_STEP, 0)),
    beside = (sign) => traced(camera, lines.sky(numbers, depths(sign)), { beams: false }).direction,
    [outer, inner] = [beside(-1), beside(1)];
  return points.map(({ direction, major, phase, depth, order }, i) => {
    const [out, inside] = [row3(outer, i), row3(inner, i)],
      first = scaled3(less3(inside, out), 1 / (2 * FOLD_STEP)),
      second = [0, 1, 2].map((k) => (inside[k] + out[k] - 2 * direction[k]) / FOLD_STEP ** 2),
      tangent = dot3(major, first) < 0 ? scaled3(major, -1) : major,
      normal = cross3(direction, tangent);
    return { direction, tangent, normal, phase, depth, order, speed: dot3(tangent, first), bend: dot3(normal, second) / 2 };
  });
}

// Guesses of images next to a critical curve, on both sides of it: where the second order fits the star.
function foldStarts(camera, curve, star) {
  const fold = (curve.fold ??= foldOf(camera, curve)),
    fits = fold.map(({ direction, tangent, normal, speed, bend }) => {
      const away = less3(star, direction),
        step = dot3(away, tangent) / speed;
      return { step, miss: dot3(away, normal) - bend * step * step, near: dot3(away, direction) > -1 && Math.abs(step) < FOLD_REACH };
    }),
    starts = [];
  fits.forEach((one, i) => {
    const j = (i + 1) % fits.length,
      other = fits[j];
    if (!one.near || !other.near || Math.sign(one.miss) === Math.sign(other.miss)) return;
    const part = one.miss / (one.miss - other.miss),
      mixed = (a, b) => a + part * (b - a),
      step = mixed(one.step, other.step);
    starts.push({
      index: curve.order - (step < 0 ? 1 : 0),
      phase: mixed(fold[i].phase, fold[j].phase + (j ? 0 : TWO_PI)),
      depth: mixed(fold[i].depth, fold[j].depth) + step,
    });
  });
  return starts;
}

// Images by Newton's method from guesses, each once: index, direction N on the sky at rest, error.
function rootsFrom(sheets, stars, guesses, steps = MOST_STEPS) {
  const { camera } = sheets;
  if (!guesses.length) return [];
  const lines = new Lines(camera, guesses.map(({ phase }) => phase ?? 0)),
    sky = flat(guesses.map((guess, i) => guess.sky ?? skyOfSight(lines.sight(i, guess.depth)))),
    columns = [
      [sky, 3],
      [flat(stars), 3],
      [Float64Array.from(guesses, ({ index }) => index), 1],
    ],
    numbers = Float64Array.from([...camera.restFrame, 1, PIECES, steps]),
    found = kernels.run(`root${camera.onEquator ? "_equator" : ""}_sky`, numbers, columns, ["sky", "error", "state"], sheets.table);
  const images = [];
  found.state.forEach((state, i) => {
    const { index } = guesses[i];
    if (state === FOUND) images.push({ index, sky: row3(found.sky, i), error: found.error[i] });
    if (state === UNSURE) images.push(...rootByStraightSteps(camera, stars[i], index, row3(sky, i)));
  });
  return images;
}

// Newton's method along great circles, for rays with formulas of their own: those that leave nearly straight outward. The
// image in a list, or none.
function rootByStraightSteps(camera, star, index, start) {
  let [sky, trial, step, residual, part, taken, error] = [start, start, [0, 0, 0], Infinity, 1, 0, NaN];
  for (let turn = 0; turn < MOST_STEPS && part > 1e-4; turn++) {
    const beam = traced(camera, Float64Array.from(trial)),
      direction = row3(beam.direction, 0),
      distance = 2 * Math.asin(Math.min(gap3(star, direction) / 2, 1)),
      known = beam.known[0] && beam.status[0] === REACHED && beam.index[0] === index,
      allowed = known && distance < residual * (1 - taken / 3);
    if (allowed) {
      [sky, residual, step] = [trial, distance, pulledBack(beam.jacobian, direction, star, trial, distance)];
      error = (beam.error[0] + distance) / Math.abs(shapeOf(beam.jacobian, 0).minor);
      if (distance <= 2 * beam.error[0]) return [{ index, sky, error }];
    } else if (part === 1 && residual < 10 * beam.error[0]) return [{ index, sky, error }];
    part = allowed ? Math.min(4 * part, 1) : part / 4;
    const size = size3(step);
    if (!Number.isFinite(size) || !Number.isFinite(residual)) break;
    taken = part / Math.max(size / 0.3, 1);
    const angle = size * taken,
      ahead = angle ? Math.sin(angle) / size : taken;
    const next = [0, 1, 2].map((k) => sky[k] * Math.cos(angle) + step[k] * ahead);
    trial = scaled3(next, 1 / size3(next));
  }
  return [];
}

// The tangent of the sky along which a beam would bring the end of its ray to a star.
function pulledBack(jacobian, direction, star, sky, distance) {
  const way = less3(star, direction),
    [first, second] = polarBasis(direction).map((tangent) => dot3(tangent, way)),
    longer = distance / (Math.hypot(first, second) || 1),
    [a, b, e, f] = jacobian,
    area = a * f - b * e,
    [u, v] = [((f * first - b * second) * longer) / area, ((a * second - e * first) * longer) / area],
    [one, other] = tangentsAt(sky);
  return [0, 1, 2].map((k) => u * one[k] + v * other[k]);
}

const isSame = (one, other) =>
  one.index === other.index && gap3(one.sky, other.sky) < Math.max(SAME, SAME_ERRORS * (one.error + other.error));

const distinct = (images) =>
  images.filter((image, i) => !images.slice(0, i).some((one) => isSame(one, image))).sort((a, b) => a.index - b.index || a.sky[0] - b.sky[0]);

const countsBy = (images, orders) => Array.from({ length: orders }, (_, k) => images.filter(({ index }) => index === k).length);

// The images of one star on a sheet, followed from those of stars around it that have as many: where the map is so
// strongly sheared that the grid gives poor guesses.
function approached(sheets, star, index, count) {
  let seed = 1,
    images = [];
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647 - 0.5;
  for (let attempt = 0; attempt < 24 && images.length < count; attempt++) {
    const far = scaled3([random(), random(), random()], 0.6 * (random() + 0.5) ** 2),
      path = even(8, 1, 0).map((part) => part * part),
      places = Array.from(path, (part) => [0, 1, 2].map((k) => star[k] + part * far[k])).map((place) => scaled3(place, 1 / size3(place)));
    if (places.slice(0, -1).some((place) => sheets.expected(place).counts[index] !== count)) continue;
    let there = searchedFrom(sheets, places[0], sheets.starts(places[0], NARROW)).filter((image) => image.index === index);
    for (const place of places.slice(1)) there = rootsFrom(sheets, there.map(() => place), there, 16);
    images = distinct([...images, ...there]);
  }
  return images;
}

const searchedFrom = (sheets, star, guesses) => distinct(rootsFrom(sheets, guesses.map(() => star), guesses));

// The images of a star on the sky at rest, with the counts. known: images of a star beside it, to begin with.
function searchedImages(sheets, star, known = []) {
  const { windings, counts: expected } = sheets.expected(star),
    orders = expected.length,
    onCaustic = windings.map((winding) => winding.onCaustic),
    away = least(windings.map(({ distance }) => distance)),
    folds = () => sheets.curves.flatMap((curve, k) => (windings[k].distance < FOLD_DISTANCE ? foldStarts(sheets.camera, curve, star) : []));
  const inside = (starts) => starts.filter(({ index, depth }) => index < orders && (depth ?? 1) > 0);
  const isWhole = (images) => countsBy(images, orders).every((count, k) => count === expected[k]);
  let images = distinct(rootsFrom(sheets, known.map(() => star), known));
  const rounds = [() => sheets.starts(star, NARROW), folds, () => sheets.starts(star, WIDE)];
  // Next to a caustic both counts are put to the test.
  const isDelicate = away < DELICATE || onCaustic.some((flag) => flag);
  for (const starts of rounds)
    if (isDelicate || !isWhole(images)) images = distinct([...images, ...searchedFrom(sheets, star, inside(starts()))]);
  if (!isDelicate)
    countsBy(images, orders).forEach((count, k) => {
      if (count < expected[k]) images = distinct([...images, ...approached(sheets, star, k, expected[k])]);
    });
  const rings = sheets.curves.map((curve, k) => curve.isPoint && onCaustic[k]);
  images = images.filter(({ index }) => !rings[index] && !rings[index - 1]);
  return { images, counts: countsBy(images, orders), expected, onCaustic, rings };
}

// Images as a camera sees them: lists with one entry each.
function measured(camera, images) {
  const seen = images.map(({ sky }) => camera.seen(sky)),
    beams = traced(camera, flat(seen), { own: true });
  return {
    index: images.map(({ index }) => index),
    parity: images.map(({ index }) => (index % 2 ? -1 : 1)),
    magnification: images.map((_, i) => 1 / Math.abs(determinant(beams.jacobian, i))),
    redshift: images.map((_, i) => beams.redshift[i]),
    azimuth: images.map((_, i) => beams.azimuth[i]),
    error: images.map(({ error }, i) => {
      const stretch = camera.stretch(seen[i]);
      return error * stretch + (camera.speed ? ROUNDING * (1 + stretch) : 0);
    }),
    sky: seen,
  };
}

const determinant = (jacobian, i) => jacobian[4 * i] * jacobian[4 * i + 3] - jacobian[4 * i + 1] * jacobian[4 * i + 2];

// Whether a search found what the caustics require, on grids that are fine enough, of a star on none of them.
const isCertified = ({ isCoarse }, { counts, expected, onCaustic }) =>
  !onCaustic.some((flag) => flag) && counts.every((count, k) => count === expected[k] && !isCoarse[k]);

function imagesAt(event, camera, [theta, phi], known = []) {
  if (!event.sheets) return noImages(event);
  const search = searchedImages(event.sheets, fromAngles(theta, phi), known),
    { counts, expected, onCaustic, rings } = search,
    orders = onCaustic.flatMap((flag, k) => (flag ? [k + 1] : [])),
    remarks = [];
  for (const order of orders)
    remarks.push(
      rings[order - 1]
        ? `the star lies on the caustic of order ${order}, which is a point: its images of index ${order - 1} and ${order} are one ring`
        : `the star cannot be distinguished from the caustic of order ${order}: it may have two images more, or less; move it by more than its error`,
    );
  counts.forEach((count, k) => {
    if (count !== expected[k] && !rings[k] && !rings[k - 1])
      remarks.push(
        `index ${k}: the search found ${count} images, the caustics require ${expected[k]}; ` +
          "move the star or the camera a little and compare",
      );
  });
  const certified = isCertified(event.sheets, search);
  return { ...measured(camera, search.images), per_index: counts, expected, on_caustic: orders, certified, remarks, found: search.images };
}

// Where a critical curve could not be followed nothing is known of the images.
function noImages({ orders }) {
  const none = Array(orders).fill(0),
    remark = "a critical curve could not be followed all the way round: the program may know more";
  return { ...measuredNone(), per_index: none, expected: none, on_caustic: [], certified: false, remarks: [remark], found: [] };
}

const measuredNone = () => ({ index: [], parity: [], magnification: [], redshift: [], azimuth: [], error: [], sky: [] });
