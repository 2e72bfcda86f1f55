// A star during one orbit of the camera: its images at even moments, the moments at which it crosses caustics, and the
// tracks of its images between these.

// Crossings of a critical curve's caustic with a circle of latitude: where theta' of its points passes that of the star.
function crossingsOf(camera, curve, theta) {
  if (curve.isPoint) return [];
  const off = (point) => point.theta - theta,
    roots = curve.points.flatMap((low, i) => {
      const high = curve.around(i + 1);
      return off(low) > 0 === off(high) > 0 ? [] : [{ low, high, point: Math.abs(off(low)) < Math.abs(off(high)) ? low : high, weights: [1, 1] }];
    });
  // The Illinois rule: the weight of an end that stays is halved.
  for (let turn = 0; turn < 30; turn++) {
    const open = roots.filter(({ low, high, point }) => Math.abs(off(point)) > 0.1 * point.error && high.phase - low.phase > 4e-16 * TWO_PI);
    if (!open.length) break;
    const phases = open.map(({ low, high, weights: [a, b] }) => {
      const [before, after] = [a * off(low), b * off(high)];
      return low.phase + ((high.phase - low.phase) * before) / (before - after);
    });
    curve.between(camera, phases).forEach((point, i) => {
      const root = open[i];
      if (!point) root.lost = root.high = root.low;
      else if (off(point) > 0 === off(root.low) > 0) Object.assign(root, { low: point, point, weights: [1, root.weights[1] / 2] });
      else Object.assign(root, { high: point, point, weights: [root.weights[0] / 2, 1] });
    });
  }
  return roots.map(({ point, lost }) => ({ point: { ...point }, isLost: !!lost }));
}

// The event at a crossing: what is known of its point alone.
function eventAt(camera, curve, cusps, { point, isLost }, theta, sense) {
  const [x, y] = point.direction,
    around = Math.hypot(x, y),
    across = dot3([-y / around, x / around, 0], cross3(point.direction, point.major)),
    cusp = cusps.find(({ celestial, error }) => Math.hypot(celestial[0] - theta, celestial[1] - point.azimuth) < 10 * error + 1e-9),
    error = cusp?.error ?? (point.error + Math.abs(point.theta - theta)) / (Math.sin(theta) * Math.abs(across));
  return {
    order: curve.order,
    part: mod((-sense * point.azimuth) / TWO_PI, 1),
    phi: mod(point.azimuth, TWO_PI),
    sky: camera.seen(skyOfSight(point.sight)),
    error: Number.isFinite(error) ? error : null,
    at_cusp: !!cusp,
    isLost,
  };
}

// Events with their kinds, in order of time: images are counted a moment before each and a moment after.
function withKinds(sheets, events, theta, sense) {
  const sorted = events.sort((one, other) => one.part - other.part);
  return sorted.map((event, i) => {
    const gaps = [1, -1].map((way) => mod(way * (sorted.at((i + way) % sorted.length).part - event.part), 1) || 1),
      pause = TWO_PI * Math.min(1e-3, ...gaps.map((gap) => gap / 3)),
      count = (way) => sheets.expected(fromAngles(theta, event.phi - way * sense * pause)).counts[event.order - 1];
    return { ...event, kind: count(1) > count(-1) ? "creation" : "annihilation" };
  });
}

// Images of one moment, each with that of the next it becomes; those that vanish have none.
function links(before, after, vanishing) {
  const pairs = before.flatMap((one, i) => after.flatMap((other, j) => (one.index === other.index ? [{ i, j, gap: gap3(one.sky, other.sky) }] : []))),
    next = before.map(() => -1),
    taken = new Set(),
    left = countsBy(before, vanishing.length).map((count, k) => count - vanishing[k]);
  pairs.sort((one, other) => one.gap - other.gap);
  for (const { i, j } of pairs) {
    const { index } = before[i];
    if (next[i] >= 0 || taken.has(j) || left[index] <= 0) continue;
    [next[i], left[index]] = [j, left[index] - 1];
    taken.add(j);
  }
  return next;
}

// Tracks: what each image becomes from moment to moment, from the event in which it appears to that in which it vanishes.
function tracksOf(moments, events) {
  const n = moments.length,
    orders = moments[0].orders,
    between = (i) => events.filter(({ part }) => Math.floor(part * n) % n === i),
    next = moments.map(({ images }, i) => {
      const vanishing = Array(orders).fill(0);
      for (const { kind, order } of between(i))
        if (kind === "annihilation") [order - 1, order].forEach((k) => (k < orders ? (vanishing[k] += 1) : 0));
      return links(images, moments[(i + 1) % n].images, vanishing);
    }),
    first = moments.map(({ images }) => images.map(() => true)),
    tracks = [];
  next.forEach((row, i) => row.forEach((j) => (j >= 0 ? (first[(i + 1) % n][j] = false) : 0)));
  const seen = moments.map(({ images }) => images.map(() => false));
  const eventNear = (i, { index, sky }, kind) =>
    between(i)
      .filter((event) => event.kind === kind && (event.order === index || event.order === index + 1))
      .sort((one, other) => gap3(one.sky, sky) - gap3(other.sky, sky))[0];
  const follow = (i, j, closed) => {
    const nodes = [];
    const start = moments[i].images[j],
      born = closed ? null : eventNear(mod(i - 1, n), start, "creation");
    if (born) nodes.push({ ...start, sky: born.sky, part: born.part, magnification: 0 });
    let image = start;
    while (j >= 0 && !seen[i][j]) {
      seen[i][j] = true;
      image = moments[i].images[j];
      nodes.push({ ...image, part: i / n });
      [i, j] = [(i + 1) % n, next[i][j]];
    }
    const dead = j < 0 ? eventNear(mod(i - 1, n), image, "annihilation") : null;
    if (dead) nodes.push({ ...image, sky: dead.sky, part: dead.part, magnification: 0 });
    tracks.push({ closed, nodes });
  };
  first.forEach((row, i) => row.forEach((isFirst, j) => isFirst && follow(i, j, false)));
  seen.forEach((row, i) => row.forEach((was, j) => was || follow(i, j, true)));
  return tracks;
}

// True where the counts of all moments change by their events alone.
function isAccounted(moments, events) {
  return moments.every(({ counts }, i) => {
    const change = counts.map(() => 0),
      n = moments.length;
    for (const { part, kind, order } of events)
      if (Math.floor(part * n) % n === i) [order - 1, order].forEach((k) => (change[k] += kind === "creation" ? 1 : -1));
    return counts.every((count, k) => count + change[k] === moments[(i + 1) % n].counts[k]);
  });
}

function orbitAt(event, camera, theta, number) {
  if (!camera.angularVelocity)
    throw new Error(
      "Argument `camera` must orbit the spin axis, so that stars have tracks: choose another velocity, and another " +
        "place if it is on the axis.",
    );
  const sense = Math.sign(camera.angularVelocity),
    { sheets } = event,
    phi = Array.from({ length: number }, (_, i) => mod((-sense * TWO_PI * i) / number, TWO_PI));
  const period = TWO_PI / Math.abs(camera.angularVelocity);
  if (!sheets) {
    const none = noImages(event);
    return { period, phi, frames: phi.map(() => none), tracks: [], events: [], certified: false, remarks: none.remarks };
  }
  const events = withKinds(
    sheets,
    sheets.curves.flatMap((curve, k) => {
      const { cusps } = event.curves[k];
      return crossingsOf(camera, curve, theta).map((root) => eventAt(camera, curve, cusps, root, theta, sense));
    }),
    theta,
    sense,
  );
  const moments = [];
  let known = [];
  for (const angle of phi) {
    const search = searchedImages(sheets, fromAngles(theta, angle), known);
    known = search.images;
    moments.push({ ...search, orders: event.orders });
  }
  const every = measured(camera, moments.flatMap(({ images }) => images));
  let place = 0;
  for (const moment of moments)
    moment.images = moment.images.map(({ index }) => {
      const i = place++;
      return { index, sky: every.sky[i], magnification: every.magnification[i], error: every.error[i] };
    });
  const remarks = [];
  if (events.some(({ isLost }) => isLost)) remarks.push("a crossing of a caustic could not be found exactly");
  if (!isAccounted(moments, events)) remarks.push("images come and go that no crossing of a caustic explains: the program may know more");
  for (const { isPoint, order, blur, middle } of sheets.curves)
    if (isPoint && Math.abs(Math.acos(bounded(middle[2] / size3(middle), -1, 1)) - theta) <= blur)
      remarks.push(`the star passes through the caustic of order ${order}, which is a point`);
  const frames = moments.map((moment) => ({ images: moment.images, certified: isCertified(sheets, moment) }));
  return {
    period,
    phi,
    frames,
    events,
    tracks: tracksOf(moments, events).map(({ closed, nodes }) => ({
      closed,
      error: most(nodes.map(({ error }) => error)),
      sky: flat(nodes.map(({ sky }) => sky)),
      moment: nodes.map(({ part }) => part),
      magnification: nodes.map(({ magnification }) => magnification),
      index: nodes.map(({ index }) => index),
    })),
    certified: !remarks.length && frames.every(({ certified }) => certified),
    remarks,
  };
}
