// A page without a program: its answers are computed in the browser; where that is forbidden, they are the nearest of the
// states that it holds. Follows the parts in one script.

function kept(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return decoded(bytes);
}

// Shapes and waves of the stars of lessons.
function storedLayer({ lessons }, { want, state }) {
  const keyOf = (layer) => LAYERS[want].keyOf(layer.state);
  return lessons.map((lesson) => lesson[want] && kept(lesson[want])).find((layer) => layer && keyOf(layer) === keyOf({ state }));
}

function stillChannel(states) {
  const listeners = [];
  const views = states.views.map(kept);
  const orbits = states.orbits.map((row) => row.map(() => null));
  const tell = (answer) => setTimeout(() => listeners.forEach((heard) => heard(answer)), 0);
  const nearest = (list, gap) => list.reduce((best, one, i) => (gap(one) < gap(list[best]) ? i : best), 0);
  const unlike = (state) => (view) =>
    Math.abs(Math.log(1.0002 - view.state.spin) - Math.log(1.0002 - state.spin)) +
    4 * Math.abs(Math.log(view.state.radius / state.radius));

  // Stars of lessons are held as they are, with all longitudes where their camera circles the spin axis.
  const lessons = states.lessons.map(({ view, orbit }) => ({ view: kept(view), message: orbit && kept(orbit) }));
  const lessonOf = (state) => lessons.find(({ view }) => orbitKey(view.state) === orbitKey(state));
  const isStarOf = ({ view }, state) => starKey(view.state) === starKey(state);

  function closest(state) {
    const i = nearest(views, unlike(state)),
      j = nearest(states.thetas, (theta) => Math.abs(theta - state.theta));
    return { view: views[i], message: (orbits[i][j] ??= kept(states.orbits[i][j])) };
  }
  function answered({ id, want, state }) {
    const { chart, sphere } = state;
    if (want === "backdrop") return { kind: "backdrop", id, want, state, arrays: {} };
    if (LAYERS[want]) {
      const layer = storedLayer(states, { want, state });
      return layer ? { ...layer, id, want, state } : { kind: "refusal", id, want, line: ONLY_PROGRAM };
    }
    const lesson = lessonOf(state);
    if (lesson && want !== "orbit" && isStarOf(lesson, state))
      return { ...lesson.view, id, want, quality: "full", state: { ...lesson.view.state, chart, sphere } };
    const { view, message } = lesson?.message ? lesson : closest(state);
    const orbit = orbitOf(message);
    const frame = orbit.frames[nearest(orbit.frames, ({ phi }) => Math.abs(mod(phi - state.phi + 180, TURN) - 180))];
    const shown = { ...view.state, theta: message.state.theta, phi: frame.phi, chart, sphere, backdrop: "none" };
    if (want === "orbit") return { ...message, id, want, state: shown };
    const list = frame.images,
      none = list.map(() => null),
      counts = countsOf(list, view.state.orders);
    const images = {
      index: list.map((x) => x.index),
      parity: list.map((x) => (x.index % 2 ? -1 : 1)),
      magnification: list.map((x) => x.magnification),
      redshift: none,
      azimuth: none,
      error: list.map((x) => x.error),
      sky: list.map((x) => x.sky),
      per_index: counts,
      expected: counts,
      on_caustic: [],
      certified: frame.certified,
      remarks: [],
    };
    return { ...view, id, want, quality: "full", state: shown, images };
  }
  setTimeout(() => tell({ kind: "greeting", presets: [], allowed: views[0].allowed, ...states.words }), 0);
  const why = states.live ? "This browser forbids WebAssembly" : "This page was written without kernels for browsers";
  return {
    state: { ...views[0].state, ...stateOf(location.hash) },
    offered: { cameras: views.map((view) => view.state), thetas: states.thetas, why },
    listen: (heard) => listeners.push(heard),
    send: (text) => tell(answered(JSON.parse(text))),
  };
}

const states = JSON.parse(document.getElementById("states").textContent);
const isLive = !!states.live && canCompute();
const channel = isLive ? new LiveChannel(states.live, (question) => storedLayer(states, question)) : stillChannel(states);
if (isLive) channel.state = stateOf(location.hash);
channel.link = () => location.href;
channel.remember = (state) => {
  try {
    history.replaceState(null, "", `#${fragmentOf(state)}`);
  } catch {
    /* some browsers let no file do this */
  }
};
const embeds = new URLSearchParams(location.search).has("embed");
const options = { wholePage: true, invites: !location.hash, embeds };
window.explorer = channel.explorer = mount(document.getElementById("explorer"), channel, options);
window.addEventListener("hashchange", () => window.explorer.show(stateOf(location.hash)));
