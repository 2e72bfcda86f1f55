// Vectors of three numbers, polynomials and splines.

const TWO_PI = 2 * Math.PI;
const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const less3 = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const size3 = (a) => Math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
const cross3 = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled3 = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const gap3 = (a, b) => Math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2);
const row3 = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];

// Vectors one after the other.
function flat(vectors) {
  const width = vectors[0]?.length ?? 0,
    all = new Float64Array(width * vectors.length);
  for (let i = 0; i < vectors.length; i++) for (let k = 0; k < width; k++) all[width * i + k] = vectors[i][k];
  return all;
}

const mod = (x, y) => x - y * Math.floor(x / y);
const bounded = (x, low, high) => Math.min(Math.max(x, low), high);
const fromAngles = (theta, phi) => [Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)];
const even = (n, low, high) => Float64Array.from({ length: n }, (_, i) => low + ((high - low) * i) / (n - 1));
const most = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);

// Unit tangents (e_theta, e_phi) of the sphere; on the axis their limit along phi = 0.
function polarBasis([x, y, z]) {
  const around = Math.hypot(x, y),
    [c, d] = around ? [x / around, y / around] : [1, 0];
  return [
    [z * c, z * d, -around],
    [-d, c, 0],
  ];
}

// Two tangents of the sphere at a unit vector (Duff et al. 2017, J. Comput. Graph. Tech. 6(1)).
function tangentsAt([x, y, z]) {
  const sign = z >= 0 ? 1 : -1,
    c = -1 / (sign + z),
    d = x * y * c;
  return [
    [1 + sign * x * x * c, sign * d, -sign * x],
    [d, sign + y * y * c, -y],
  ];
}

// A root between two places at which a function differs in sign: halved until doubles end.
function bisected(f, low, high) {
  const before = f(low) > 0;
  for (let i = 0; i < 200; i++) {
    const middle = (low + high) / 2;
    if (middle === low || middle === high) break;
    if (f(middle) > 0 === before) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

// The number of the piece between rising nodes on which a place lies, or the nearest one.
function pieceAt(nodes, at) {
  let low = 0,
    high = nodes.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (nodes[middle] <= at) low = middle;
    else high = middle;
  }
  return low;
}

// A piecewise linear function through values at rising nodes.
function interpolated(at, nodes, values) {
  const i = pieceAt(nodes, at);
  if (nodes[i + 1] === nodes[i]) return values[i];
  return values[i] + ((values[i + 1] - values[i]) * bounded(at - nodes[i], 0, nodes[i + 1] - nodes[i])) / (nodes[i + 1] - nodes[i]);
}

// A periodic cubic spline through values at rising nodes of less than a period.
class Periodic {
  constructor(nodes, values, period = TWO_PI) {
    const n = nodes.length;
    this.nodes = Float64Array.from([...nodes, nodes[0] + period]);
    this.values = Float64Array.from([...values, values[0]]);
    this.period = period;
    const width = (i) => this.nodes[mod(i, n) + 1] - this.nodes[mod(i, n)];
    const rate = (i) => (this.values[mod(i, n) + 1] - this.values[mod(i, n)]) / width(i);
    // Slopes by which the second derivative is continuous, by a few hundred sweeps at most: neighbours count a quarter.
    const slopes = Float64Array.from({ length: n }, (_, i) => (rate(i - 1) + rate(i)) / 2);
    for (let sweep = 0, off = 1; sweep < 200 && off > 0; sweep++) {
      off = 0;
      for (let i = 0; i < n; i++) {
        const [before, after] = [width(i - 1), width(i)];
        const right = 3 * (after * rate(i - 1) + before * rate(i));
        const slope = (right - after * slopes[mod(i - 1, n)] - before * slopes[mod(i + 1, n)]) / (2 * (before + after));
        off = Math.max(off, Math.abs(slope - slopes[i]) - 1e-16 * Math.abs(slope));
        slopes[i] = slope;
      }
    }
    this.slopes = Float64Array.from([...slopes, slopes[0]]);
  }
  // Powers of the cubic of a piece, the highest first.
  powers(i) {
    const width = this.nodes[i + 1] - this.nodes[i];
    const rate = (this.values[i + 1] - this.values[i]) / width;
    const bend = (this.slopes[i] + this.slopes[i + 1] - 2 * rate) / width;
    return [bend / width, (rate - this.slopes[i]) / width - bend, this.slopes[i], this.values[i]];
  }
  at(place, derivative = 0) {
    const x = this.nodes[0] + mod(place - this.nodes[0], this.period);
    const i = pieceAt(this.nodes, x),
      ahead = x - this.nodes[i],
      [a, b, c, d] = this.powers(i);
    return derivative ? (3 * a * ahead + 2 * b) * ahead + c : ((a * ahead + b) * ahead + c) * ahead + d;
  }
}

// Polynomials through values at Chebyshev nodes.
const NODES = Array.from({ length: 17 }, (_, j) => -Math.cos((Math.PI * (j + 0.5)) / 17));

function chebyshev(values) {
  return NODES.map((_, k) => {
    const sum = values.reduce((total, value, j) => total + value * Math.cos((k * Math.PI * (16.5 - j)) / 17), 0);
    return ((k ? 2 : 1) * sum) / 17;
  });
}

function derived(coefficients) {
  const slopes = Array(coefficients.length + 1).fill(0);
  for (let k = coefficients.length - 1; k > 0; k--) slopes[k - 1] = (slopes[k + 1] ?? 0) + 2 * k * coefficients[k];
  slopes[0] /= 2;
  return slopes.slice(0, coefficients.length);
}

function chebyshevAt(coefficients, x) {
  let [one, two] = [0, 0];
  for (let k = coefficients.length - 1; k > 0; k--) [one, two] = [coefficients[k] + 2 * x * one - two, one];
  return coefficients[0] + x * one - two;
}

// A root of a polynomial by Newton's method from a place, within bounds.
function newton(coefficients, place, low, high) {
  const slopes = derived(coefficients);
  for (let i = 0; i < 5; i++) {
    const slope = chebyshevAt(slopes, place);
    if (slope) place = bounded(place - chebyshevAt(coefficients, place) / slope, low, high);
  }
  return place;
}
