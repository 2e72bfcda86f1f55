// Pictures behind the curves: a sky as the camera sees it, sampled along rays, and the sky itself. RGBA, row by row.

// Rows and columns of the camera's picture; rows of the sky's own.
const LENSED_SIZE = 440,
  SKY_ROWS = 360,
  EDGE_POINTS = 240;
const DEGREE = Math.PI / 180;

const linear = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
const encoded = (light) => 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * Math.min(1, light) ** (1 / 2.4) - 0.055);
const lightOf = (colour) => [1, 3, 5].map((i) => linear(parseInt(colour.slice(i, i + 2), 16) / 255));

// As scenes/checkerboard.py draws it: swatches with gaps, coloured by latitude, every second one darker.
class Checkerboard {
  constructor({ rows, columns, gap, darker, colours, gapColour }) {
    const stops = colours.map(lightOf);
    const mixed = (row) => {
      const place = ((row + 0.5) / rows) * (stops.length - 1),
        i = Math.min(stops.length - 2, Math.floor(place));
      return stops[i].map((part, k) => part + (place - i) * (stops[i + 1][k] - part));
    };
    Object.assign(this, { rows, columns, half: 0.5 - gap / 2 });
    const pixel = (light) => light.map(encoded);
    const bright = Array.from({ length: rows }, (_, row) => mixed(row));
    this.pairs = bright.map((light) => [pixel(light), pixel(light.map((part) => darker * part))]);
    this.gap = pixel(lightOf(gapColour));
  }
  pixel(x, y, z) {
    const along = (Math.acos(bounded(z, -1, 1)) / Math.PI) * this.rows,
      round = (mod(Math.atan2(y, x), TWO_PI) / TWO_PI) * this.columns,
      [row, column] = [Math.min(this.rows - 1, Math.floor(along)), Math.floor(round)];
    const isGap = Math.abs(along - row - 0.5) > this.half || Math.abs(round - column - 0.5) > this.half;
    return isGap ? this.gap : this.pairs[row][(row + column) % 2];
  }
}

// Stars as small discs of light, one in each cell of a band of latitude, before a glow along a great circle.
class Stars {
  constructor(bands = 45) {
    let seed = 7;
    const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
    const star = (band, cell, cells) => {
      const part = 0.1 + 0.8 * random(),
        height = (1 - part) * Math.cos((band * Math.PI) / bands) + part * Math.cos(((band + 1) * Math.PI) / bands),
        warmth = random(),
        light = 0.15 + 1.5 * random() ** 5,
        phi = ((cell + 0.1 + 0.8 * random()) * TWO_PI) / cells;
      return { at: fromAngles(Math.acos(height), phi), light: [0.75 + 0.4 * warmth, 0.9, 1.2 - 0.45 * warmth].map((x) => light * x) };
    };
    this.bands = Array.from({ length: bands }, (_, band) => {
      const cells = Math.max(3, Math.round(2 * bands * Math.sin(((band + 0.5) * Math.PI) / bands)));
      return Array.from({ length: cells }, (_, cell) => star(band, cell, cells));
    });
    this.pole = fromAngles(1.05, 2.2);
  }
  pixel(x, y, z) {
    const glow = 0.035 * Math.exp(-((dot3([x, y, z], this.pole) / 0.2) ** 2)),
      light = [0.9 * glow, 0.95 * glow, 1.1 * glow],
      count = this.bands.length,
      band = Math.min(count - 1, Math.floor((Math.acos(bounded(z, -1, 1)) / Math.PI) * count)),
      part = mod(Math.atan2(y, x), TWO_PI) / TWO_PI;
    for (let i = Math.max(0, band - 1); i <= Math.min(count - 1, band + 1); i++) {
      const cells = this.bands[i],
        middle = Math.floor(part * cells.length);
      for (let j = middle - 1; j <= middle + 1; j++) {
        const { at, light: own } = cells[mod(j, cells.length)],
          share = Math.exp((2 * dot3([x, y, z], at) - 2) / 6e-5);
        for (let k = 0; k < 3; k++) light[k] += share * own[k];
      }
    }
    return light.map(encoded);
  }
}

// Colours of directions; black where there is none.
function picture(sky, directions, width) {
  const count = directions.length / 3,
    data = new Uint8ClampedArray(4 * count);
  for (let i = 0; i < count; i++) {
    const [x, y, z] = row3(directions, i);
    if (!Number.isNaN(x)) data.set(sky.pixel(x, y, z), 4 * i);
    data[4 * i + 3] = 255;
  }
  return { data, shape: [count / width, width, 4] };
}

// theta' downward, phi' to the right.
function skyItself(sky, rows = SKY_ROWS) {
  const directions = new Float64Array(6 * rows * rows),
    angle = (i) => ((i + 0.5) * Math.PI) / rows;
  for (let i = 0, at = 0; i < rows; i++)
    for (let j = 0; j < 2 * rows; j++, at += 3) directions.set(fromAngles(angle(i), angle(j)), at);
  return picture(sky, directions, 2 * rows);
}

// Directions N of pixels of a window [right, up, side] in degrees: distances from the shadow's middle are true.
function windowSky([middle, right, up], [across, above, field], size) {
  const sky = new Float64Array(3 * size * size),
    step = field / size,
    half = (size - 1) / 2;
  for (let i = 0, at = 0; i < size; i++)
    for (let j = 0; j < size; j++, at += 3) {
      const [x, y] = [(across + (j - half) * step) * DEGREE, (above + (half - i) * step) * DEGREE],
        angle = Math.hypot(x, y),
        [c, s] = [Math.cos(angle), angle ? Math.sin(angle) / angle : 1];
      for (let k = 0; k < 3; k++) sky[at + k] = c * middle[k] + s * (x * right[k] + y * up[k]);
    }
  return sky;
}

const skyOf = (name, { checkerboard }) => ({ stars: () => new Stars(), checkerboard: () => new Checkerboard(checkerboard) })[name]?.();
