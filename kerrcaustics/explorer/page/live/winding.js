// Winding of caustics about a star: the counts of images without a search for them (curves/winding.py). A caustic is a
// polygon of great circles; sides close to a star are halved for it.

const CAUTION = 4,
  MOST_HALVINGS = 45;

// A side from point to point; height: an upper bound for the distance of the caustic from it at cusps.
function sideOf(first, second, atCusp, heightAtCusp) {
  const [one, other] = [first.direction, second.direction],
    step = less3(other, one),
    chord = size3(step),
    bend = size3(cross3(first.major, second.major)),
    lean = size3(cross3(scaled3(step, 1 / (chord || 1)), first.major)),
    height = atCusp ? heightAtCusp : chord * Math.max(bend, 2 * lean),
    error = BLUR_ERRORS * Math.max(first.error, second.error),
    normal = cross3(one, step),
    south = normal[2] < 0 ? normal : scaled3(normal, -1),
    azimuth = Math.atan2(one[1], one[0]),
    change = Math.atan2(one[0] * other[1] - one[1] * other[0], one[0] * other[0] + one[1] * other[1]);
  // The azimuth of the end itself, not a sum, so that neighbouring sides leave no gap.
  let end = Math.atan2(other[1], other[0]);
  end += TWO_PI * Math.round((azimuth + change - end) / TWO_PI);
  return {
    ...{ first, second, atCusp, height, error, south, chord },
    margin: CAUTION * height + error,
    west: Math.min(azimuth, end),
    east: Math.max(azimuth, end),
    sign: Math.sign(change),
    middle: scaled3([one[0] + other[0], one[1] + other[1], one[2] + other[2]], 0.5),
  };
}

function distanceFrom({ first, second, chord }, star) {
  const [side, way] = [less3(second.direction, first.direction), less3(star, first.direction)],
    part = chord ? bounded(dot3(side, way) / chord ** 2, 0, 1) : 0;
  return size3(less3(way, scaled3(side, part)));
}

// Whether a side between two azimuths passes over another one, whole turns aside.
const covers = (west, east, phi) =>
  (west < phi && phi <= east) || (west < phi - TWO_PI && phi - TWO_PI <= east) || (west < phi + TWO_PI && phi + TWO_PI <= east);

// The signed crossing of the meridian from a star to the north pole by a side.
function crossing(side, star, phi) {
  return covers(side.west, side.east, phi) && dot3(side.south, less3(star, side.first.direction)) > 0 ? side.sign : 0;
}

// The sides of a caustic: next to a cusp it turns back, and leaves them by no more than those around are long.
function sidesOf({ points }) {
  const n = points.length,
    next = points.map((_, i) => points[(i + 1) % n]),
    chords = points.map((point, i) => gap3(point.direction, next[i].direction)),
    along = points.map((point, i) => Math.sign(dot3(less3(next[i].direction, point.direction), point.major))),
    turns = points.map((point, i) => along[i] * Math.sign(dot3(point.major, next[i].major)) !== along[(i + 1) % n]);
  return points.map((point, i) => {
    const atCusp = turns[i] || turns[mod(i - 1, n)],
      longest = Math.max(chords[i], chords[mod(i - 1, n)], chords[(i + 1) % n]),
      second = i < n - 1 ? next[i] : { ...next[i], phase: next[i].phase + TWO_PI };
    return sideOf(point, second, atCusp, longest);
  });
}

// The winding of a caustic about a star: {count, onCaustic, distance}.
function windingOf(camera, curve, star) {
  if (curve.isPoint) {
    const distance = gap3(star, curve.middle);
    return { count: 0, onCaustic: distance <= curve.blur, distance };
  }
  const sides = (curve.sides ??= sidesOf(curve)),
    table = (curve.table ??= tableOf(sides)),
    [x, y, z] = star,
    phi = Math.atan2(y, x),
    result = { count: 0, onCaustic: false, distance: Infinity };
  for (let i = 0, t = 0; i < sides.length; i++, t += WIDTH) {
    const [p, q, r] = [x - table[t], y - table[t + 1], z - table[t + 2]],
      reach = table[t + 3] + Math.max(table[t + 4], result.distance);
    // What is far from a side counts as its straight line does.
    if (p * p + q * q + r * r <= reach * reach) {
      const away = distanceFrom(sides[i], star);
      result.distance = Math.min(result.distance, away);
      if (away <= table[t + 4]) {
        divided(camera, curve, sides[i], star, phi, result, 0);
        continue;
      }
    }
    if (covers(table[t + 5], table[t + 6], phi)) result.count += crossing(sides[i], star, phi);
  }
  return result;
}

// What a count reads of all sides: middle, half length, margin, western and eastern end.
const WIDTH = 7;
const tableOf = (sides) => Float64Array.from(sides.flatMap(({ middle, chord, margin, west, east }) => [...middle, chord / 2, margin, west, east]));

function divided(camera, curve, side, star, phi, result, halvings) {
  const near = distanceFrom(side, star);
  result.distance = Math.min(result.distance, near);
  if (near > side.margin) {
    result.count += crossing(side, star, phi);
    return;
  }
  const [middle] =
    side.height <= side.error || halvings === MOST_HALVINGS || result.onCaustic
      ? [null]
      : curve.between(camera, [(side.first.phase + side.second.phase) / 2]);
  if (!middle) {
    // What no halving settles.
    result.onCaustic = true;
    result.count += crossing(side, star, phi);
    return;
  }
  for (const half of [
    sideOf(side.first, middle, side.atCusp, side.height / 4),
    sideOf(middle, side.second, side.atCusp, side.height / 4),
  ])
    divided(camera, curve, half, star, phi, result, halvings + 1);
}

// Signed numbers of times that the image of a grid (lines of nodes) covers a star: a cell is two spherical triangles.
function degreeOf(grid, columns, star) {
  const at = (i) => grid[3 * i] * star[0] + grid[3 * i + 1] * star[1] + grid[3 * i + 2] * star[2];
  const side = (i, j) =>
    (grid[3 * i + 1] * grid[3 * j + 2] - grid[3 * i + 2] * grid[3 * j + 1]) * star[0] +
    (grid[3 * i + 2] * grid[3 * j] - grid[3 * i] * grid[3 * j + 2]) * star[1] +
    (grid[3 * i] * grid[3 * j + 1] - grid[3 * i + 1] * grid[3 * j]) * star[2];
  const rows = grid.length / 3 / columns;
  let total = 0;
  const triangle = (one, two, three, middle) => {
    if (middle > 0 && one > 0 && two > 0 && three > 0) total += 1;
    if (middle > 0 && one < 0 && two < 0 && three < 0) total -= 1;
  };
  for (let i = 0; i < rows - 1; i++)
    for (let j = 0; j < columns - 1; j++) {
      const a = i * columns + j,
        [b, c, d] = [a + columns, a + 1, a + columns + 1],
        over = side(a, d);
      triangle(side(a, b), side(b, d), -over, at(a) + at(b) + at(d));
      triangle(over, -side(c, d), -side(a, c), at(a) + at(d) + at(c));
    }
  return total;
}
