// Kernels of the program, compiled to WebAssembly: rays and beams, and Newton's method on the sky map.

// Rays of one call, so that memory stays as it is; bytes of a table.
const BLOCK = 2048;
const TABLE_BYTES = 8192 * 32;
const WIDTHS = { f: 8, i: 1, b: 1 };
const LEAST_K = 2,
  MOST_K = 2.001;
const REACHED = 0,
  CAPTURED = 1;

class Kernels {
  constructor(exports, layout) {
    Object.assign(this, { exports, layout, table: null });
    this.start = (exports.__heap_base.value + 15) & ~15;
    const words = Math.max(...Object.values(layout).map(({ columns, outputs }) => columns + outputs.reduce((n, [, , size]) => n + size, 0)));
    const bytes = this.start + TABLE_BYTES + 16 * (words + 8) * 2 + 8 * BLOCK * words;
    const pages = Math.ceil(bytes / 65536) - exports.memory.buffer.byteLength / 65536;
    if (pages > 0) exports.memory.grow(pages);
  }
  // Outputs of the names wanted, for numbers of the call and columns [[array, numbers of a ray], ...].
  run(name, numbers, columns, wanted, table = null) {
    const { outputs } = this.layout[name],
      count = columns[0][0].length / columns[0][1],
      results = {};
    for (const [output, kind, size] of outputs)
      if (wanted.includes(output)) results[output] = new (kind === "f" ? Float64Array : Int8Array)(size * count);
    for (let from = 0; from < count; from += BLOCK)
      this.block(name, numbers, columns, results, table, from, Math.min(BLOCK, count - from));
    return results;
  }
  block(name, numbers, columns, results, table, from, count) {
    const { buffer } = this.exports.memory,
      reals = new Float64Array(buffer),
      words = new Int32Array(buffer),
      bytes = new Int8Array(buffer);
    let free = this.start + TABLE_BYTES;
    const taken = (size) => (free += Math.ceil(size / 16) * 16) - Math.ceil(size / 16) * 16;
    if (table && table !== this.table) reals.set(table, this.start / 8);
    this.table = table ?? this.table;
    const given = taken(8 * numbers.length);
    reals.set(numbers, given / 8);
    const slots = [];
    for (const [array, size] of columns) {
      const at = taken(8 * size * count);
      reals.set(array.subarray(from * size, (from + count) * size), at / 8);
      for (let part = 0; part < size; part++) slots.push([at + 8 * part, size]);
    }
    if (table) slots.push([this.start, table.length / 4]);
    const made = this.layout[name].outputs.map(([output, kind, size]) => ({ output, kind, size, at: taken(WIDTHS[kind] * size * count) }));
    const outSlots = made.flatMap(({ kind, size, at }) => Array.from({ length: size }, (_, part) => [at + WIDTHS[kind] * part, size]));
    const listed = (list) => {
      const at = taken(16 * list.length);
      list.forEach(([address, stride], i) => words.set([address, 0, stride, 0], at / 4 + 4 * i));
      return at;
    };
    this.exports[name](given, listed(slots), listed(outSlots), BigInt(count));
    for (const { output, kind, size, at } of made)
      if (results[output]) {
        const whole = kind === "f" ? reals : bytes,
          place = kind === "f" ? at / 8 : at;
        results[output].set(whole.subarray(place, place + size * count), size * from);
      }
  }
}

let kernels = null;

async function loadKernels(bytes, layout) {
  const { instance } = await WebAssembly.instantiate(bytes, {});
  kernels = new Kernels(instance.exports, layout);
  return kernels;
}

const OF_RAYS = ["direction", "azimuth", "status", "error", "closed_form", "redshift"];
const OF_BEAMS = [...OF_RAYS, "jacobian", "index", "diameter_error"];

// Rays, or beams, of directions on the camera's own sky or on that at rest. `known` is 0 where no formula holds: the
// program integrates those.
function traced(camera, sky, { beams = true, own = false } = {}) {
  const [kind, wanted] = beams ? ["beams", OF_BEAMS] : ["rays", OF_RAYS],
    frame = own ? camera.frame : camera.restFrame,
    found = kernels.run(`${kind}${camera.onEquator ? "_equator" : ""}_sky`, frame, [[sky, 3]], wanted),
    rest = [];
  found.known = found.closed_form;
  found.closed_form.forEach((holds, i) => {
    if (!holds && found.status[i] !== CAPTURED) rest.push(i);
    if (found.status[i] === CAPTURED) found.known[i] = 1;
  });
  if (rest.length) {
    const short = kernels.run("short_beams_sky", frame, [[flat(rest.map((i) => row3(sky, i))), 3]], wanted);
    rest.forEach((i, j) => {
      if (!short.closed_form[j]) return;
      for (const name of wanted) {
        const size = found[name].length / found.known.length;
        for (let part = 0; part < size; part++) found[name][size * i + part] = short[name][size * j + part];
      }
    });
  }
  return found;
}

// Directions n' of rays on the camera's own sky, NaN where they fall in or where no formula holds.
function raysOf(camera, sky) {
  const { direction, status, known } = traced(camera, sky, { beams: false, own: true });
  status.forEach((state, i) => {
    if (state !== REACHED || !known[i]) direction.fill(NaN, 3 * i, 3 * i + 3);
  });
  return direction;
}

// Diameters of a beam, the minor one with the sign of its determinant, and its major axis as an angle from e_theta.
function shapeOf(jacobian, i) {
  const [a, b, c, d] = jacobian.subarray(4 * i, 4 * i + 4),
    even = Math.hypot(a + d, c - b) / 2,
    odd = Math.hypot(a - d, c + b) / 2;
  return { major: even + odd, minor: even - odd, angle: (Math.atan2(c - b, a + d) + Math.atan2(c + b, a - d)) / 2 };
}
