// Layers that can be switched on: the images of a star of finite size, and the waves of a star.

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

// The waves of a star: [frequency, |F|, error] by frequency.
function wavesOf(answer) {
  return { ...answer, spectrum: rows(answer.arrays.spectrum) };
}

function wavesWords(waves) {
  if (!waves) return [];
  const { frequency, modulus, error, method, sum } = waves;
  const certificate = waves.certified ? "" : ` Not certified: ${waves.remarks.join(" ")}`;
  const field = `Its waves at ωM = ${short(frequency)}: |F| = ${short(modulus, 5)} ± ${short(error, 2)}`;
  return [`${field} (${method}); added without phases, all images would give ${short(sum, 4)}.${certificate}`];
}

const LAYERS = {
  shapes: { isOn: ({ size }) => size > 0, keyOf: shapesKey, read: shapesOf },
  waves: { isOn: ({ frequency }) => frequency > 0, keyOf: wavesKey, read: wavesOf },
};

class Layers {
  constructor(explorer) {
    this.explorer = explorer;
  }
  // Of a star that stands still, once its images are there.
  ask() {
    const { explorer } = this;
    const request = explorer.request();
    const isMoving = explorer.dragging || explorer.playback.running || explorer.quiz.hides;
    if (isMoving || !isWhole(explorer.freshness)) return;
    for (const [name, { isOn, keyOf }] of Object.entries(LAYERS)) {
      const key = keyOf(request);
      const isAsked = explorer.questions.isAsked(name, ({ state }) => keyOf(state) === key);
      if (isOn(request) && explorer.model[name]?.key !== key && !isAsked) explorer.ask(name);
    }
  }
  take(name, answer, { state }) {
    const { explorer } = this;
    const { keyOf, read } = LAYERS[name];
    const key = keyOf(state);
    if (key === keyOf(explorer.request()) && !explorer.quiz.hides) explorer.model[name] = { ...read(answer), key };
  }
  // Those of another star.
  drop() {
    const { model } = this.explorer;
    const request = this.explorer.request();
    for (const [name, { keyOf }] of Object.entries(LAYERS))
      if (model[name]?.key !== keyOf(request)) model[name] = null;
  }
}
