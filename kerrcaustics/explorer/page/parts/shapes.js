// The images of a star of finite size.

// Limbs of a star of finite size: directions on the sky, cut where the index changes.
function shapesOf(answer) {
  const limbs = Object.values(answer.arrays).map((array) => {
    const points = rows(array);
    const arcs = [];
    points.forEach(([, , , index], i) => {
      const next = points[(i + 1) % points.length].slice(0, 3);
      if (!i || arcs.at(-1).index !== index) arcs.push({ index, sky: [points[i].slice(0, 3)] });
      arcs.at(-1).sky.push(next);
    });
    return { sky: points.map((point) => point.slice(0, 3)), arcs };
  });
  return { ...answer, limbs };
}

// The light of a star of finite size.
function lightOf(shapes) {
  if (!shapes) return [];
  const { total, error, per_index, certified, remarks } = shapes;
  const shares = per_index.map((share, k) => `${short(share)} of index ${k}`).join(", ");
  const certificate = certified ? "certified" : `not certified: ${remarks.join(" ")}`;
  return [`The star as a disc: magnification ${short(total, 6)} ± ${short(error, 2)}, ${shares}; ${certificate}.`];
}

class Shapes {
  constructor(explorer) {
    this.explorer = explorer;
  }
  // Of a star that stands still, once its images are there.
  ask() {
    const { explorer } = this;
    const request = explorer.request();
    const isMoving = explorer.dragging || explorer.playback.running || explorer.quiz.hides;
    if (!request.size || isMoving || !isWhole(explorer.freshness)) return;
    const key = shapesKey(request);
    const isAsked = explorer.questions.isAsked("shapes", ({ state }) => shapesKey(state) === key);
    if (explorer.model.shapes?.key !== key && !isAsked) explorer.ask("shapes");
  }
  take(answer, { state }) {
    const { explorer } = this;
    const key = shapesKey(state);
    if (key === shapesKey(explorer.request()) && !explorer.quiz.hides)
      explorer.model.shapes = { ...shapesOf(answer), key };
  }
  // Those of another star.
  drop() {
    const { explorer } = this;
    if (explorer.model.shapes?.key !== shapesKey(explorer.request())) explorer.model.shapes = null;
  }
}
