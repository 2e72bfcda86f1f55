// Places for words beside what is drawn: the first of some at which no curve passes through them.

// Below, above, right and left of a place.
const beside = ([x, y], across, down) => [
  [x, y + down],
  [x, y - down],
  [x + across, y],
  [x - across, y],
];

// Below and above a place, ever farther.
const column = ([x, y], from, to) =>
  Array.from({ length: Math.floor((to - from) / 6) + 1 }, (_, i) => from + 6 * i).flatMap((far) => [
    [x, y + far],
    [x, y - far],
  ]);

// On a circle about a place, the first one in a direction.
const around = ([x, y], radius, turn) =>
  [0, 1, -1, 2, -2, 3].map((i) => [x + radius * Math.cos(turn + i), y + radius * Math.sin(turn + i)]);

// Whether a point of a line lies in a box about a spot.
const isCrossed = ([x, y], points, half, up) => points.some((p) => p && Math.abs(p[0] - x) < half && Math.abs(p[1] - y) < up);

// The first of the spots whose box no line crosses; else the first.
function clearSpot(spots, points, half, up) {
  return spots.find((spot) => !isCrossed(spot, points, half, up)) ?? spots[0];
}
