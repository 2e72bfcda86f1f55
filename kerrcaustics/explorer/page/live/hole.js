// The hole, cameras at events outside it, and the edge of its shadow (spacetime/ of the package; JTFT appendix A.1).
// Vectors of the fiducial observer have components (r, theta, phi); directions N on a sky (x, y, z).

const horizonOf = (spin) => 1 + Math.sqrt((1 - spin) * (1 + spin));
const photonOrbits = (spin) => [-spin, spin].map((a) => 2 * (1 + Math.cos((2 / 3) * Math.acos(a))));

// Whole numbers by which doubles stand exactly, and sums of products of them as a double: their rounding alone would cost
// all digits next to the horizon and to the photon orbit.
const SCALE = 110n;
const whole = (x) => BigInt(Math.round(x * 2 ** Number(SCALE)));
const real = (n, power) => Number(n) / 2 ** (Number(SCALE) * power);

function horizonFunction(spin, radius) {
  const [r, a] = [whole(radius), whole(spin)];
  return real(r * (r - (2n << SCALE)) + a * a, 2);
}

function circularSlowness(spin, radius) {
  const root = Math.sqrt(radius),
    [r, a, three] = [whole(radius), whole(spin), 3n << SCALE];
  const excess =
    radius < 3
      ? real(((4n * a * a) << SCALE) - r * (three - r) ** 2n, 3) / (2 * spin + root * (3 - radius))
      : root * (radius - 3) + 2 * spin;
  return (radius * root * excess) / (radius * root + spin) ** 2;
}

function circularSpeed(spin, radius, delta) {
  const root = Math.sqrt(radius);
  const angular = (radius - spin) ** 2 + (2 * spin * root * (radius - 1)) / (1 + root);
  return angular / (Math.sqrt(delta) * (radius * root + spin));
}

// Numbers of a frame as kernels take them: those of the hole and the place, speed, slowness, basis, zoom, start.
class LiveCamera {
  constructor({ spin, radius, inclination, velocity }) {
    const angle = inclination === 90 ? Math.PI / 2 : inclination * (Math.PI / 180);
    Object.assign(this, { spin, radius, velocity, onEquator: inclination === 90 });
    this.cos = this.onEquator ? 0 : Math.cos(angle);
    this.sin = inclination === 180 ? 0 : Math.sin(angle);
    const sigma = radius ** 2 + (spin * this.cos) ** 2,
      delta = horizonFunction(spin, radius),
      big = (radius ** 2 + spin ** 2) ** 2 - spin ** 2 * delta * (1 - this.cos ** 2);
    Object.assign(this, { delta, lapse: Math.sqrt((sigma * delta) / big), shift: (2 * spin * radius) / big });
    this.scale = Math.sqrt(big / sigma);
    this.rootSigma = Math.sqrt(sigma);
    this.rootSigmaDelta = Math.sqrt(sigma * delta);
    const still = (sigma - 2 * radius) / sigma;
    const named = {
      fiducial: () => [0, 1],
      static: () => [(-this.shift * this.scale * this.sin) / this.lapse, still / this.lapse ** 2],
      circular: () => [circularSpeed(spin, radius, delta), circularSlowness(spin, radius) / this.lapse ** 2],
    };
    [this.speed, this.slowness] = named[velocity]();
    if (this.speed === 0) this.slowness = 1;
    this.motion = this.speed ? [0, Math.sign(this.speed), 0] : null;
    this.frame = this.numbers(this.speed, this.slowness);
    this.restFrame = this.numbers(0, 1);
  }
  numbers(speed, slowness) {
    const { spin, radius, sin, cos, lapse, shift, scale, rootSigma, rootSigmaDelta } = this;
    const start = radius + 2 * Math.log(radius);
    const place = [spin, radius, sin, cos, lapse, shift, scale, rootSigma, rootSigmaDelta];
    return Float64Array.from([...place, speed, slowness, 1, 0, 0, 0, 0, 1, 0, -1, 0, 1, start]);
  }
  get angularVelocity() {
    const own = this.sin > 0 ? (this.lapse * this.speed) / (this.scale * this.sin) : 0,
      turning = this.shift + own;
    return this.sin > 0 && Math.abs(turning) > 1e-12 * (Math.abs(this.shift) + Math.abs(own)) ? turning : 0;
  }
  // 1 - beta y and beta - y of a direction, without cancellation at high speed.
  doppler([x, y, z]) {
    const sense = this.speed >= 0 ? 1 : -1,
      beta = Math.abs(this.speed),
      toward = sense * y;
    if (beta <= 0.5) return [1 - this.speed * y, this.speed - y];
    const near = toward > 0 ? (x * x + z * z) / (1 + toward) : 1 - toward,
      slow = this.slowness / (1 + beta);
    return [slow + beta * near, sense * (near - slow)];
  }
  // N on the camera's own sky, of N on that of the fiducial observer; and lengths there by those here.
  seen([x, y, z]) {
    if (!this.speed) return [x, y, z];
    const [boost, aside] = this.doppler([-x, -y, -z]),
      shrink = Math.sqrt(this.slowness);
    const there = [(shrink * x) / boost, aside / boost, (shrink * z) / boost];
    return scaled3(there, 1 / size3(there));
  }
  stretch(seen) {
    return this.doppler(seen)[0] / Math.sqrt(this.slowness);
  }
  // k = q + b^2 of the photon that moves along (r, theta, phi) here.
  k([, theta, phi]) {
    const energy = 1 / (this.lapse + this.shift * this.scale * this.sin * phi);
    return (energy * this.rootSigma * theta) ** 2 + (energy * this.scale * phi) ** 2 - (this.spin * this.cos) ** 2;
  }
}

// A camera; an Error with the program's own line where none has the velocity.
function cameraOf(values) {
  const camera = new LiveCamera(values),
    { velocity, spin, radius, cos } = camera;
  const notAbove = (limit) => {
    const texts = [radius, limit].map(digits12);
    return `(radius ${texts[0]} is not above ${texts[0] === texts[1] ? limit : texts[1]}).`;
  };
  if (velocity === "static" && !(camera.slowness > 0))
    throw Error(`Argument \`velocity\` must not be static at or inside the ergosphere ${notAbove(1 + Math.sqrt(1 - (spin * cos) ** 2))}`);
  if (velocity !== "circular") return camera;
  const refused = "Argument `velocity` must not be circular";
  if (cos !== 0) throw Error(`${refused} off the equator (inclination ${digits12(values.inclination)} degrees is not 90).`);
  const [orbit] = photonOrbits(spin);
  if (!(radius > orbit && camera.slowness > 0)) throw Error(`${refused} at or inside the photon orbit ${notAbove(orbit)}`);
  return camera;
}

const skyOfSight = ([r, theta, phi]) => [r, phi, -theta];
const sightOfSky = ([x, y, z]) => [x, -z, y];

// Radius and Carter constant of the spherical photon orbit with axial angular momentum b.
function orbitOfImpact(a, b) {
  const p = 1 - (a * a + a * b) / 3,
    h = (1 - a) * (1 + a),
    disc = h * h - p ** 3;
  let x;
  if (disc > 0) {
    const cube = Math.cbrt(h + Math.sqrt(disc));
    x = cube + p / (cube || 1);
  } else x = 2 * Math.sqrt(Math.max(p, 0)) * Math.cos(Math.atan2(Math.sqrt(Math.max(-disc, 0)), h) / 3);
  for (let i = 0; i < 2; i++) if (x * x > p) x -= (x ** 3 - 3 * p * x - 2 * h) / (3 * (x * x - p));
  const r = 1 + x;
  return [r, (2 * r ** 3 + (a * a - b * b) * r + (b - a) ** 2) / x];
}

// Least and largest p_phi / sin(theta) on the shadow edge, where p_theta vanishes.
function momentumRange(camera) {
  const { spin: a, sin, cos } = camera;
  const potential = (momentum) => orbitOfImpact(a, momentum * sin)[1] - cos * cos * (momentum - a) * (momentum + a);
  const ends = photonOrbits(a).map((r, i) => {
    const limit = (i ? -1 : 1) * Math.sqrt(27);
    const equatorial = a > 1e-3 ? -(r ** 3 - 3 * r ** 2 + a * a * r + a * a) / (a * (r - 1)) : limit - 2 * a;
    if (camera.onEquator && a > 1e-3) return equatorial;
    let far = Math.abs(equatorial) < 8 * sin ? equatorial / sin : 8 * Math.sign(equatorial);
    for (let step = 0; step < 60 && potential(far) >= 0; step++) far *= 1 + 1e-3;
    return bisected(potential, 0, far);
  });
  return ends.reverse();
}

// Lines of sight (r, theta, phi) of the shadow edge at edge phases: 0 is the prograde end, pi the retrograde one.
function edgeSights(camera, phases) {
  const { spin: a, sin, cos, radius: r } = camera,
    [low, high] = (camera.momenta ??= momentumRange(camera)),
    sights = new Float64Array(3 * phases.length);
  phases.forEach((phase, i) => {
    const momentum = (high + low) / 2 + ((high - low) / 2) * Math.cos(phase),
      [orbit, q] = orbitOfImpact(a, momentum * sin),
      square = Math.max(q - cos * cos * (momentum - a) * (momentum + a), 0),
      radial = (r - orbit) * Math.sqrt(r * r + 2 * orbit * r - (a * a * q) / (orbit * orbit));
    const motion = [
      radial / camera.rootSigmaDelta,
      (Math.sqrt(square) * Math.sign(Math.sin(phase))) / camera.rootSigma,
      momentum / camera.scale,
    ];
    sights.set(scaled3(motion, -1 / size3(motion)), 3 * i);
  });
  return sights;
}

// Edge phases at parts of the way round, evenly both on the sky and in edge phase.
function evenPhases(camera, parts, seen = (sky) => sky) {
  const n = 1024,
    places = even(n + 1, 0, 1);
  let phases = even(n + 1, 0, TWO_PI),
    sums;
  for (let round = 0; round <= 30; round++) {
    const sights = edgeSights(camera, phases),
      sky = Array.from(phases, (_, i) => seen(skyOfSight(row3(sights, i)))),
      ways = Array.from({ length: n }, (_, i) => gap3(sky[i + 1], sky[i])),
      length = Math.max(ways.reduce((a, b) => a + b, 0), 1e-300),
      steps = ways.map((way, i) => way / length + (phases[i + 1] - phases[i]) / TWO_PI);
    sums = new Float64Array(n + 1);
    steps.forEach((step, i) => (sums[i + 1] = sums[i] + step));
    const total = sums[n];
    sums.forEach((sum, i) => (sums[i] = sum / total));
    if (round === 30 || most(steps) <= (1.5 * total) / n) break;
    phases = places.map((part) => interpolated(part, sums, phases));
  }
  return Float64Array.from(parts, (part) => interpolated(part, sums, phases));
}

// Directions N of n points of the shadow edge.
function shadowEdge(camera, n) {
  const phases = evenPhases(camera, even(n + 1, 0, 1).slice(0, n), (sky) => camera.seen(sky)),
    sights = edgeSights(camera, phases);
  return flat(Array.from(phases, (_, i) => camera.seen(skyOfSight(row3(sights, i)))));
}

// Forward to the middle of the shadow, right and up.
function shadowAxes(camera, edge) {
  const n = edge.length / 3,
    area = [0, 0, 0];
  for (let i = 0; i < n; i++) cross3(row3(edge, i), row3(edge, (i + 1) % n)).forEach((part, k) => (area[k] += part));
  const forward = scaled3(area, 1 / size3(area));
  // Up is against e_theta, which is -z on the sky.
  const level = less3([0, 0, 1], scaled3(forward, forward[2])),
    up = scaled3(level, 1 / size3(level));
  return [forward, cross3(forward, up), up];
}
