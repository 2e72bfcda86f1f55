// Pictures as the frames of a GIF, which plays everywhere: no program and no page is needed.

const GIF = { colours: 255, same: 255, most: 4096, clear: 256, end: 257 };

const cellOf = (data, i) => ((data[i] & 248) << 7) | ((data[i + 1] & 248) << 2) | (data[i + 2] >> 3);

// The colours that most pixels have, each the mean of a small cell of colours.
class Palette {
  constructor(pictures) {
    const [count, sums] = [new Uint32Array(32768), new Float64Array(3 * 32768)];
    for (const data of pictures)
      for (let i = 0; i < data.length; i += 4) {
        const cell = cellOf(data, i);
        count[cell] += 1;
        for (let k = 0; k < 3; k++) sums[3 * cell + k] += data[i + k];
      }
    const cells = [...count.keys()].filter((cell) => count[cell]).sort((a, b) => count[b] - count[a]);
    const mean = (cell) => [0, 1, 2].map((k) => Math.round(sums[3 * cell + k] / count[cell]));
    this.colours = cells.slice(0, GIF.colours).map(mean);
    this.entries = new Int16Array(32768).fill(-1);
  }
  entry(data, i) {
    const cell = cellOf(data, i);
    if (this.entries[cell] < 0) this.entries[cell] = this.closest([data[i], data[i + 1], data[i + 2]]);
    return this.entries[cell];
  }
  closest(colour) {
    const gap = (other) => other.reduce((sum, x, k) => sum + (x - colour[k]) ** 2, 0);
    const gaps = this.colours.map(gap);
    return gaps.indexOf(Math.min(...gaps));
  }
}

class Gif {
  // delay: hundredths of a second.
  constructor(w, height, palette, delay) {
    Object.assign(this, { w, height, palette, delay, bytes: [], before: null });
    this.write([..."GIF89a"].map((letter) => letter.charCodeAt(0)));
    this.write([...this.word(w), ...this.word(height), 0xf7, 0, 0]);
    for (let i = 0; i < 256; i++) this.write(palette.colours[i] ?? [0, 0, 0]);
    // Again and again.
    this.write([0x21, 0xff, 11, ...[..."NETSCAPE2.0"].map((letter) => letter.charCodeAt(0)), 3, 1, 0, 0, 0]);
  }
  word(x) {
    return [x & 255, x >> 8];
  }
  write(bytes) {
    for (const byte of bytes) this.bytes.push(byte);
  }
  // Pixels that stay as they are, are transparent: most of them do.
  add(data) {
    const now = new Uint8Array(this.w * this.height);
    for (let i = 0; i < now.length; i++) now[i] = this.palette.entry(data, 4 * i);
    const { before } = this;
    const pixels = before ? now.map((entry, i) => (entry === before[i] ? GIF.same : entry)) : now;
    this.before = now;
    this.write([0x21, 0xf9, 4, before ? 5 : 4, ...this.word(this.delay), GIF.same, 0]);
    this.write([0x2c, 0, 0, 0, 0, ...this.word(this.w), ...this.word(this.height), 0, 8]);
    const codes = packed(pixels);
    for (let i = 0; i < codes.length; i += 255) {
      const block = codes.slice(i, i + 255);
      this.write([block.length, ...block]);
    }
    this.write([0]);
  }
  whole() {
    return Uint8Array.from([...this.bytes, 0x3b]);
  }
}

class Bits {
  constructor() {
    Object.assign(this, { bytes: [], held: 0, count: 0 });
  }
  write(code, size) {
    this.held |= code << this.count;
    this.count += size;
    while (this.count >= 8) this.flush();
  }
  flush() {
    this.bytes.push(this.held & 255);
    this.held >>>= 8;
    this.count -= 8;
  }
}

// Bytes after Lempel, Ziv & Welch: codes of 9 to 12 bits.
function packed(pixels) {
  const bits = new Bits();
  let [table, next, size, prefix] = [new Map(), GIF.end + 1, 9, pixels[0]];
  bits.write(GIF.clear, size);
  for (let i = 1; i < pixels.length; i++) {
    const key = (prefix << 8) | pixels[i];
    const known = table.get(key);
    if (known !== undefined) {
      prefix = known;
      continue;
    }
    bits.write(prefix, size);
    prefix = pixels[i];
    if (next === GIF.most) {
      bits.write(GIF.clear, size);
      [table, next, size] = [new Map(), GIF.end + 1, 9];
    } else {
      if (next >= 1 << size) size += 1;
      table.set(key, next++);
    }
  }
  bits.write(prefix, size);
  bits.write(GIF.end, size);
  if (bits.count > 0) bits.flush();
  return bits.bytes;
}
