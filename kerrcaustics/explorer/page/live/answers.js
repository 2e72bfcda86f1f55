// Answers to questions of the page, with the fields that answers.py and page_data.py give them.

const MOST_CURVE_POINTS = 3000,
  MOST_TRACK_POINTS = 1500,
  MOMENTS = 360,
  // Cameras that are kept, some MB each.
  MOST_CAMERAS = 6;

const inDegrees = (angle) => angle / DEGREE;
const finiteOnly = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));
const array = (data, width) => ({ data, shape: width ? [data.length / width, width] : [data.length] });
const listed = (values, width) => array(Float64Array.from(values), width);

// Rows of an array, no more than so many of them, evenly.
function thinned(data, width, most) {
  const step = Math.ceil(data.length / width / most);
  return array(step > 1 ? data.filter((_, i) => Math.floor(i / width) % step === 0) : data, width);
}

class Answers {
  constructor(rules) {
    Object.assign(this, { rules, cameras: new Map(), skies: {} });
  }
  // The answer to a question, or the reason why there is none.
  answer({ id, want, state: given, window }) {
    try {
      const began = performance.now(),
        state = checkedState(given, this.rules),
        made = want === "orbit" ? this.orbit(state) : want === "backdrop" ? this.backdrop(state, window) : this.view(state, want);
      return { ...made, state, id, want, seconds: (performance.now() - began) / 1000 };
    } catch (error) {
      // The program's own lines are plain errors.
      const line = error.constructor === Error ? error.message : `This could not be computed (${error}): move a slider a little.`;
      return { kind: "refusal", line, id, want };
    }
  }
  // What is kept of a camera: itself, curves and sheets of its event once they are known, and the last images.
  kept(state) {
    const { spin, radius, inclination, velocity, orders } = state,
      key = [spin, radius, inclination, velocity, orders].join(),
      kept = this.cameras.get(key) ?? { camera: cameraOf(state), event: null };
    this.cameras.delete(key);
    this.cameras.set(key, kept);
    if (this.cameras.size > MOST_CAMERAS) this.cameras.delete(this.cameras.keys().next().value);
    return kept;
  }
  withEvent(state) {
    const kept = this.kept(state);
    kept.event ??= eventOf(kept.camera, state.orders);
    return kept;
  }
  view(state, want) {
    const { camera, event: known } = this.kept(state),
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
    const kept = this.withEvent(state),
      { event } = kept;
    if (quality === "full")
      Object.assign(view, { caustics: event.curves.map((curve) => this.drawn(view, curve)), missing_orders: event.missing });
    // Those of the star before lead to these.
    const images = imagesAt(event, camera, [state.theta * DEGREE, state.phi * DEGREE], kept.found);
    kept.found = images.found;
    view.images = this.numbersOf(images);
    view.arrays.images = listed(view.images.sky.flat(), 3);
    return view;
  }
  // The numbers of a curve, degrees; its points go into the arrays of a view.
  drawn(view, { sky, celestial, cusps = [], ...numbers }) {
    const { order } = numbers;
    view.arrays[`critical${order}`] = thinned(sky, 3, MOST_CURVE_POINTS);
    view.arrays[`caustic${order}`] = thinned(celestial.map(inDegrees), 2, MOST_CURVE_POINTS);
    if (numbers.circuits === undefined) return { order, cusps };
    for (const name of ["error", "theta_min", "theta_max", "phi_min", "phi_max"]) numbers[name] = inDegrees(numbers[name]);
    numbers.theta_extent = numbers.theta_max - numbers.theta_min;
    numbers.phi_extent = numbers.phi_max - numbers.phi_min;
    const cusp = ({ sky, celestial, error }) => ({ sky: [...sky], celestial: Array.from(celestial, inDegrees), error: inDegrees(error) });
    return { ...numbers, cusps: cusps.map(cusp) };
  }
  numbersOf(images) {
    const found = { sky: images.sky.map((direction) => [...direction]), certified: images.certified, remarks: images.remarks };
    for (const name of ["index", "parity", "per_index", "expected", "on_caustic"]) found[name] = [...images[name]];
    for (const name of ["magnification", "redshift"]) found[name] = finiteOnly(images[name]);
    for (const name of ["azimuth", "error"]) found[name] = finiteOnly(images[name].map(inDegrees));
    return found;
  }
  orbit(state) {
    const { camera, event } = this.withEvent(state),
      { period, phi, frames, tracks, events, certified, remarks } = orbitAt(event, camera, state.theta * DEGREE, MOMENTS),
      // Where nothing is known of images, there are none.
      lists = frames.map((frame) => frame.images ?? []),
      images = lists.flat(),
      first = [0];
    for (const list of lists) first.push(first.at(-1) + list.length);
    const arrays = {
      phi: listed(phi.map((angle) => mod(inDegrees(angle), 360))),
      first: listed(first),
      frame_sky: listed(images.flatMap(({ sky }) => [...sky]), 3),
      frame_numbers: listed(images.flatMap(({ index, magnification, error }) => [index, magnification, inDegrees(error)]), 3),
      frame_certified: listed(frames.map((frame) => Number(frame.certified))),
    };
    tracks.forEach(({ sky, moment, magnification, index }, i) => {
      const light = Array.from(moment, (part, j) => [part, Number.isFinite(magnification[j]) ? magnification[j] : 0, index[j]]);
      arrays[`track${i}`] = thinned(sky, 3, MOST_TRACK_POINTS);
      arrays[`light${i}`] = thinned(Float64Array.from(light.flat()), 3, MOST_TRACK_POINTS);
    });
    const pair = ({ kind, order, part, phi: angle, sky, error, at_cusp }) => ({
      ...{ kind, order, part, at_cusp, phi: inDegrees(angle), sky: [...sky], error: finiteOnly([inDegrees(error)])[0] },
    });
    const lines = tracks.map(({ closed, error }) => ({ closed, error: inDegrees(error) }));
    return { kind: "orbit", period, tracks: lines, events: events.map(pair), certified, remarks, arrays };
  }
  backdrop(state, window) {
    const { camera } = this.kept(state),
      axes = shadowAxes(camera, shadowEdge(camera, EDGE_POINTS)),
      sky = (this.skies[state.backdrop] ??= skyOf(state.backdrop, this.rules));
    if (!sky) return { kind: "backdrop", window, arrays: {} };
    sky.itself ??= skyItself(sky);
    const lensed = picture(sky, raysOf(camera, windowSky(axes, window, LENSED_SIZE)), LENSED_SIZE);
    return { kind: "backdrop", window, arrays: { lensed, celestial: sky.itself } };
  }
}
