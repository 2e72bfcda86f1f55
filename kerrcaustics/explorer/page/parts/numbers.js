// Numbers, angles and places: no page is needed for what stands here.

const RAD = Math.PI / 180;
const TURN = 360;

const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
const mod = (x, y) => ((x % y) + y) % y;
const round = (x, digits) => Number(x.toPrecision(digits));
// A number as users type it, with a point or a comma before the decimals; NaN for anything else.
function numberOf(text) {
  const plain = String(text).trim().replace("−", "-").replace(",", ".");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const apart = (a, b) => Math.acos(clamp(dot(a, b), -1, 1)) / RAD;

function middle(a, b) {
  const sum = a.map((x, i) => x + b[i]);
  const length = Math.hypot(...sum) || 1;
  return sum.map((x) => x / length);
}

function place(theta, phi) {
  const across = Math.sin(theta * RAD);
  return [across * Math.cos(phi * RAD), across * Math.sin(phi * RAD), Math.cos(theta * RAD)];
}

// Points of a small circle about a direction, degrees.
function smallCircle(n, radius, count = 120) {
  const across = Math.hypot(n[0], n[1]);
  const [c, s] = across > 0 ? [n[0] / across, n[1] / across] : [1, 0];
  const [south, east] = [
    [n[2] * c, n[2] * s, -across],
    [-s, c, 0],
  ];
  const [away, toward] = [Math.sin(radius * RAD), Math.cos(radius * RAD)];
  return Array.from({ length: count + 1 }, (_, i) => {
    const [a, b] = [Math.cos((2 * Math.PI * i) / count), Math.sin((2 * Math.PI * i) / count)];
    return n.map((x, k) => toward * x + away * (a * south[k] + b * east[k]));
  });
}

function turned({ lon, lat }) {
  return [Math.cos(lon * RAD), Math.sin(lon * RAD), Math.cos(lat * RAD), Math.sin(lat * RAD)];
}

function span(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return [low, high];
}

function short(x, digits = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e-3 && size < 1e5) return String(Number(x.toPrecision(digits)));
  return raised(x.toExponential(Math.max(0, digits - 2)));
}

function raised(text) {
  const power = (_, sign, digits) => `×10${sign ? "⁻" : ""}${[...digits].map((d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]).join("")}`;
  return text.replace(/e\+?(-?)(\d+)$/, power);
}

// Round values from low to high, at most so many.
const SMALL_STEPS = Array.from({ length: 30 }, (_, i) => Number(`${[1, 2, 5][i % 3]}e${Math.floor(i / 3) - 10}`));
const STEPS = [...SMALL_STEPS, 1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360, 720];

function ticks(low, high, most) {
  const step = STEPS.find((size) => (high - low) / size <= most) ?? 1800;
  const values = [];
  for (let i = Math.ceil(low / step); i * step <= high; i++) values.push(Number((i * step).toFixed(12)));
  return values;
}
