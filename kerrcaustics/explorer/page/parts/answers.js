// Answers of the program: read, and compared with those before.

function decoded(bytes) {
  const view =
    bytes instanceof ArrayBuffer ? new DataView(bytes) : new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const size = view.getUint32(4, true);
  const record = JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, view.byteOffset + 8, size)));
  const arrays = {};
  for (const [name, { offset, type, shape }] of Object.entries(record.arrays)) {
    const count = shape.reduce((a, b) => a * b, 1);
    const from = view.byteOffset + 8 + size + offset;
    // A copy: the place in the message need not be a multiple of four.
    const data = view.buffer.slice(from, from + count * (type === "f4" ? 4 : 1));
    arrays[name] = { data: type === "f4" ? new Float32Array(data) : new Uint8Array(data), shape };
  }
  return { ...record, arrays };
}

const rows = ({ data, shape }) =>
  Array.from({ length: shape[0] }, (_, i) => Array.from(data.subarray(i * shape[1], (i + 1) * shape[1])));

function curvesOf(view) {
  return view.caustics.map((numbers) => ({
    ...numbers,
    sky: rows(view.arrays[`critical${numbers.order}`]),
    celestial: rows(view.arrays[`caustic${numbers.order}`]),
  }));
}

function orbitOf(answer) {
  const { arrays } = answer;
  const numbers = rows(arrays.frame_numbers),
    sky = rows(arrays.frame_sky),
    first = arrays.first.data;
  const frames = Array.from(arrays.phi.data, (phi, i) => {
    const images = [];
    for (let j = first[i]; j < first[i + 1]; j++)
      images.push({ sky: sky[j], index: numbers[j][0], magnification: numbers[j][1], error: numbers[j][2] });
    return { phi, images, certified: arrays.frame_certified.data[i] === 1 };
  });
  const tracks = answer.tracks.map((numbers, i) => ({
    ...numbers,
    sky: rows(arrays[`track${i}`]),
    light: rows(arrays[`light${i}`]),
  }));
  return { ...answer, frames, tracks };
}

function imagesOf({ images }) {
  return images.index.map((index, i) => ({
    index,
    sky: images.sky[i],
    magnification: images.magnification[i],
    redshift: images.redshift[i],
    error: images.error[i],
    azimuth: images.azimuth[i],
  }));
}

function countsOf(images, most) {
  const counts = Array(most).fill(0);
  images.forEach(({ index }) => {
    counts[index] += 1;
  });
  return counts;
}

// Pairs that one set of images has more than the other, with the places where they are: the two that are closest to each
// other; of the highest order, one is seen, the closest to the curve. Index k changes by pairs of orders k and k + 1.
function pairsBorn(before, after, orders, curves) {
  const old = countsOf(before, orders),
    now = countsOf(after, orders),
    born = [];
  let pairs = 0;
  for (let order = 1; order <= orders; order++) {
    pairs = now[order - 1] - old[order - 1] - pairs;
    if (pairs > 0)
      born.push({
        order,
        sky: placeOfPair(after, order, order === orders ? (curves.find((c) => c.order === order)?.sky ?? []) : null),
      });
  }
  return born.filter(({ sky }) => sky);
}

function placeOfPair(images, order, curve) {
  const others = curve ?? images.filter(({ index }) => index === order).map(({ sky }) => sky);
  let best = 200,
    found = null;
  for (const { index, sky } of images)
    if (index === order - 1)
      for (const other of others) {
        const gap = apart(sky, other);
        if (gap < best) {
          best = gap;
          found = middle(sky, other);
        }
      }
  return found;
}
