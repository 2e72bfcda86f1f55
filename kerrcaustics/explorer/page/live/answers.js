// Answers to questions of the page, with the fields that answers.py and page_data.py give them.

const MOST_CURVE_POINTS = 3000,
  MOST_TRACK_POINTS = 1500,
  MOMENTS = 360,
  // Cameras that are kept, some MB each.
  MOST_CAMERAS = 6;

const inDegrees = (angle) => angle / DEGREE;
const finiteOnly = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));
const array = (data, width, factor = 1) => ({ data: factor === 1 ? data : data.map((x) => x * factor), shape: [data.length / width, width] });

// Rows of an array, no more than so many of them, evenly.
function thinned(data, width, most) {
  const step = Math.ceil(data.length / width / most);
  return step > 1 ? data.filter((_, i) => Math.floor(i / width) % step === 0) : data;
}

class Answers {
  constructor(rules) {
    Object.assign(this, { rules, cameras: new Map(), skies: {} });
  }
  // The answer to a question, or the reason why there is none.
  answer({ id, want, state: given, window }) {
    try {
      const began = performance.now(),
        state = checkedState(given, this.rules);
      const makers = { orbit: () => this.orbit(state), backdrop: () => this.backdrop(state, window) };
      const made = (makers[want] ?? (() => this.view(state, want)))();
      return { ...made, state, id, want, seconds: (performance.now() - began) / 1000 };
    } catch (error) {
      // The program's own lines are plain errors.
      const isLine = error.constructor === Error;
      const line = isLine ? error.message : `This could not be computed (${error.name}): move a slider a little.`;
      return { kind: "refusal", line, id, want, detail: error.stack };
    }
  }
  // What is kept of a camera: itself, and the curves and sheets of an event once they are known.
  camera(state) {
    const { spin, radius, inclination, velocity, orders } = state,
      key = [spin, radius, inclination, velocity, orders].join(),
      kept = this.cameras.get(key) ?? { camera: cameraOf(state), event: null };
    this.cameras.delete(key);
    this.cameras.set(key, kept);
    if (this.cameras.size > MOST_CAMERAS) this.cameras.delete(this.cameras.keys().next().value);
    return kept;
  }
  event(state) {
    const kept = this.camera(state);
    return (kept.event ??= eventOf(kept.camera, state.orders));
  }
  view(state, want) {
    const { camera, event: known } = this.camera(state),
      quality = want === "draft" && known ? "full" : want,
      texts = { address: addressOf(state, this.rules), commands: commandsOf(state), python: pythonOf(state) },
      view = { kind: "view", quality, ...texts, has_orbit: hasOrbit(state), allowed: allowedOf(state, this.rules), arrays: {} };
    if (quality !== "star") {
      const edge = shadowEdge(camera, EDGE_POINTS);
      view.arrays.edge = array(edge, 3);
      Object.assign(view, { axes: shadowAxes(camera, edge), motion: camera.motion });
    }
    if (quality === "draft") {
      view.caustics = coarseCurves(camera, state.orders).map((curve) => this.drawn(view, curve));
      return view;
    }
    const event = this.event(state),
      kept = this.camera(state);
    if (quality === "full") {
      view.caustics = event.curves.map((curve) => this.drawn(view, curve));
      view.missing_orders = event.missing;
    }
    // Those of the star before lead to these.
    const images = imagesAt(event, camera, [state.theta * DEGREE, state.phi * DEGREE], kept.found);
    kept.found = images.found;
    view.images = this.numbersOf(images);
    view.arrays.images = { data: Float64Array.from(images.sky.flat()), shape: [images.sky.length, 3] };
    return view;
  }
  // The numbers of a curve, degrees; its points go into the arrays of a view.
  drawn(view, { sky, celestial, cusps = [], ...numbers }) {
    const { order } = numbers;
    view.arrays[`critical${order}`] = array(thinned(sky, 3, MOST_CURVE_POINTS), 3);
    view.arrays[`caustic${order}`] = array(thinned(celestial, 2, MOST_CURVE_POINTS), 2, 1 / DEGREE);
    if (numbers.circuits === undefined) return { order, cusps };
    for (const name of ["error", "theta_min", "theta_max", "phi_min", "phi_max"]) numbers[name] = inDegrees(numbers[name]);
    numbers.theta_extent = numbers.theta_max - numbers.theta_min;
    numbers.phi_extent = numbers.phi_max - numbers.phi_min;
    const places = cusps.map((cusp) => ({
      sky: Array.from(cusp.sky),
      celestial: Array.from(cusp.celestial, inDegrees),
      error: inDegrees(cusp.error),
    }));
    return { ...numbers, cusps: places };
  }
  numbersOf(images) {
    const { index, parity, magnification, redshift, azimuth, error, sky } = images;
    return {
      index: Array.from(index),
      parity: Array.from(parity),
      magnification: finiteOnly(magnification),
      redshift: finiteOnly(redshift),
      azimuth: finiteOnly(azimuth.map(inDegrees)),
      error: finiteOnly(error.map(inDegrees)),
      sky: sky.map((direction) => Array.from(direction)),
      per_index: Array.from(images.per_index),
      expected: Array.from(images.expected),
      on_caustic: Array.from(images.on_caustic),
      certified: images.certified,
      remarks: images.remarks,
    };
  }
  orbit(state) {
    const { camera } = this.camera(state);
    if (!hasOrbit(state)) throw Error("This camera does not circle the spin axis: it has no orbit.");
    const { period, phi, frames, tracks, events, certified, remarks } = orbitAt(this.event(state), camera, state.theta * DEGREE, MOMENTS);
    const first = [0],
      images = frames.flatMap((frame) => frame.images ?? []);
    for (const frame of frames) first.push(first.at(-1) + (frame.images ?? []).length);
    const whole = (data, width) => ({ data: Float64Array.from(data), shape: width ? [data.length / width, width] : [data.length] });
    const arrays = {
      phi: whole(Array.from(phi, (angle) => mod(inDegrees(angle), 360))),
      first: whole(first),
      frame_sky: whole(images.flatMap(({ sky }) => Array.from(sky)), 3),
      frame_numbers: whole(images.flatMap(({ index, magnification, error }) => [index, magnification, inDegrees(error)]), 3),
      frame_certified: whole(frames.map((frame) => Number(frame.certified))),
    };
    tracks.forEach(({ sky, moment, magnification, index }, i) => {
      const light = Array.from(moment, (part, j) => [part, Number.isFinite(magnification[j]) ? magnification[j] : 0, index[j]]);
      arrays[`track${i}`] = array(thinned(sky, 3, MOST_TRACK_POINTS), 3);
      arrays[`light${i}`] = array(thinned(Float64Array.from(light.flat()), 3, MOST_TRACK_POINTS), 3);
    });
    const lines = tracks.map(({ closed, error }) => ({ closed, error: inDegrees(error) }));
    const pairs = events.map(({ kind, order, part, phi, sky, error, at_cusp }) => ({
      ...{ kind, order, part, at_cusp, phi: inDegrees(phi), sky: Array.from(sky) },
      error: finiteOnly([inDegrees(error)])[0],
    }));
    return { kind: "orbit", period, tracks: lines, events: pairs, certified, remarks, arrays };
  }
  backdrop(state, window) {
    const { backdrop: name } = state;
    if (name === "none") return { kind: "backdrop", window, arrays: {} };
    const { camera } = this.camera(state),
      edge = shadowEdge(camera, EDGE_POINTS),
      axes = shadowAxes(camera, edge),
      part = window ?? usualWindow(axes, coarseCurves(camera, 1)[0]?.sky ?? edge),
      { sky, itself } = this.sky(name);
    const lensed = picture(sky, raysOf(camera, windowSky(axes, part, LENSED_SIZE)), LENSED_SIZE);
    return { kind: "backdrop", window: part, arrays: { lensed, celestial: itself } };
  }
  sky(name) {
    const made = () => (name === "stars" ? new Stars() : new Checkerboard(this.rules.checkerboard));
    const kept = (this.skies[name] ??= { sky: made() });
    kept.itself ??= skyItself(kept.sky);
    return kept;
  }
}
