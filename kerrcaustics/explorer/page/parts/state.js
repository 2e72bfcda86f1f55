// The state of the page: a camera, a star, and how they are shown.

const DEFAULTS = {
  spin: 0.5,
  radius: 6.03,
  inclination: 90,
  velocity: "circular",
  orders: 3,
  theta: 84,
  phi: 295,
  size: 0,
  frequency: 0,
  backdrop: "none",
  chart: "map",
  sphere: "inside",
};

function stateOf(fragment) {
  const given = new URLSearchParams(String(fragment).replace(/^#/, ""));
  const state = {};
  for (const [name, usual] of Object.entries(DEFAULTS)) {
    if (!given.has(name)) continue;
    const value = typeof usual === "number" ? numberOf(given.get(name)) : given.get(name);
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

// What belongs to a camera, to a star, to its shapes, to its waves, to an orbit, to a picture behind the curves.
const cameraOf = (s) => [s.spin, s.radius, s.inclination, s.velocity, s.orders].join();
const starKey = (s) => [s.theta, s.phi].join();
const shapesKey = (s) => [cameraOf(s), starKey(s), s.size].join();
const wavesKey = (s) => [cameraOf(s), starKey(s), s.frequency].join();
const orbitKey = (s) => [cameraOf(s), s.theta].join();
const backdropKey = (s) => [cameraOf(s), s.backdrop].join();

// 1 where phi' grows to the right, as one would see the celestial sphere from outside; -1 as one sees it looking out.
const sideOf = ({ sphere }) => (sphere === "outside" ? 1 : -1);
const seenFrom = ({ sphere }) => `seen from ${sphere === "outside" ? "outside" : "inside"}`;

// Numbers of a star that is moved: heights end at the poles, longitudes go round.
function starAt(theta, phi) {
  return { theta: clamp(theta, 0, 180), phi: mod(phi, TURN) };
}

// Why a number that is typed cannot be; no text if it can.
function complaintAbout(value, [low, high], unit = "") {
  if (!Number.isFinite(value)) return `Enter a number from ${low} to ${high}${unit}.`;
  if (value >= low && value <= high) return "";
  return `${value} is not allowed: enter a number from ${low} to ${high}${unit}.`;
}
