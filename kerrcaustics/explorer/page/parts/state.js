// The state of the page: a camera, a star, and how they are shown.

const DEFAULTS = {
  spin: 0.999,
  radius: 6.03,
  inclination: 90,
  velocity: "circular",
  orders: 3,
  theta: 84,
  phi: 60,
  backdrop: "none",
  chart: "map",
};

const horizon = (a) => 1 + Math.sqrt(1 - a * a);
const photonOrbit = (a) => 2 * (1 + Math.cos((2 / 3) * Math.acos(-a)));

function stateOf(fragment) {
  const given = new URLSearchParams(String(fragment).replace(/^#/, ""));
  const state = {};
  for (const [name, usual] of Object.entries(DEFAULTS)) {
    if (!given.has(name)) continue;
    const value = typeof usual === "number" ? Number(given.get(name)) : given.get(name);
    if (typeof usual !== "number" || Number.isFinite(value)) state[name] = value;
  }
  return state;
}

function fragmentOf(state) {
  const text = (value) => (typeof value === "number" ? Number(value.toPrecision(12)) : value);
  return Object.keys(DEFAULTS)
    .map((name) => `${name}=${encodeURIComponent(text(state[name]))}`)
    .join("&");
}

// What belongs to a camera, to an orbit, to a picture behind the curves.
const cameraOf = (s) => [s.spin, s.radius, s.inclination, s.velocity, s.orders].join();
const orbitKey = (s) => [cameraOf(s), s.theta].join();
const backdropKey = (s) => [cameraOf(s), s.backdrop].join();

// The nearest state that a camera can have.
function settle(state, wantedVelocity) {
  state.spin = clamp(state.spin, 0, 0.9999);
  state.radius = clamp(state.radius, round(1.01 * horizon(state.spin) + 5e-5, 5), 1000);
  state.inclination = clamp(state.inclination, 0, 180);
  state.theta = clamp(state.theta, 0, 180);
  state.phi = mod(state.phi, TURN);
  const isLevel = state.inclination === 90;
  const ergosphere = 1 + Math.sqrt(1 - (state.spin * Math.cos(state.inclination * RAD)) ** 2);
  const can = {
    circular: isLevel && state.radius > photonOrbit(state.spin) * 1.001,
    static: state.radius > 1.001 * ergosphere,
    fiducial: true,
  };
  state.velocity = can[wantedVelocity] ? wantedVelocity : "fiducial";
}
