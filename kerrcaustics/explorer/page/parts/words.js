// Words on the panels: the hole, left and right, the direction in which the camera moves.

const HALF_WORD = 32;

function skyWords(pen, panel, f, { axes, motion, edge }, { soft, ink, halo }, points) {
  const word = (x, y, text, more = {}) => pen.text(x, y, text, { fill: soft, size: 12, halo, ...more });
  word(8, 12, "left", { align: "left" });
  word(f.w - 8, 12, "right", { align: "right" });
  const [low, high] = span(edge.map((n) => panel.spot(n, axes, f)[0]));
  if (high - low > 44) word(...panel.spot(axes[0], axes, f), "hole", { fill: ink });
  if (motion) motionMark(pen, panel.spot(motion, axes, f), f, { ink, halo }, points);
}

// The point of an arrow that comes to the reader; an arrow at the rim where the direction is outside of what is shown.
function motionMark(pen, at, f, { ink, halo }, points) {
  const [x, y] = [clamp(at[0], 20, f.w - 20), clamp(at[1], 40, f.height - 52)];
  if (x === at[0] && y === at[1]) {
    pen.disk(x, y, 7, { fill: halo, stroke: ink, width: 1.6 });
    pen.disk(x, y, 2, { fill: ink });
  } else rimArrow(pen, [x, y], Math.atan2(at[1] - y, at[0] - x), { ink, halo });
  const spots = [...beside([x, y], 44, 25), ...beside([x, y], 60, 45)].map(([u, v]) => [
    clamp(u, HALF_WORD, f.w - HALF_WORD),
    clamp(v, 24, f.height - 20),
  ]);
  const [middle, row] = clearSpot(spots, points, HALF_WORD, 14);
  ["direction", "of motion"].forEach((word, i) =>
    pen.text(middle, row - 7 + 14 * i, word, { fill: ink, size: 12, halo }),
  );
}

function rimArrow(pen, [x, y], turn, { ink, halo }) {
  const at = (r, a) => [x + r * Math.cos(turn + a), y + r * Math.sin(turn + a)];
  const line = [at(10, Math.PI), at(10, 0), null, at(6, 1), at(10, 0), at(6, -1)];
  pen.line(line, { stroke: halo, width: 5 });
  pen.line(line, { stroke: ink, width: 2 });
}

// The place on the celestial sphere to which a straight line from the camera through the hole would lead.
function behindHole({ inclination }) {
  return [180 - inclination, 180];
}
