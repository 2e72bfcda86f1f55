// Colours, dashes and names of what is drawn.

// Curves, images and stars have the colours that they have in all other pictures: PALETTES (draw/palettes.py).
const COLOURS = {
  light: {
    ...PALETTES.light,
    ink: "#1c2330",
    soft: "#68748a",
    grid: "#d8dee8",
    shadow: "#dfe3ea",
    edge: "#8791a3",
    paper: "#ffffff",
    halo: "#ffffff",
  },
  dark: {
    ...PALETTES.dark,
    ink: "#eef2f8",
    soft: "#97a3b8",
    grid: "#293142",
    shadow: "#04060a",
    edge: "#5c677c",
    paper: "#10151f",
    halo: "#10151f",
  },
};
const orderColour = ({ order }, k) => order[(k - 1) % order.length];
const indexColour = ({ index }, k) => index[k % index.length];
const DASHES = [[], [], [9, 3], [2.5, 2.5], [9, 3, 2, 3]];
const NAMES = ["", "primary", "secondary", "tertiary", "4th order"];
// Behind curves a picture is as bright as this, and curves have a dark outline.
const DIM = 0.72;
const OVER_PICTURE = { ...COLOURS.dark, soft: COLOURS.dark.ink };
const OUTLINE = { stroke: "#000000", width: 4.5, alpha: 0.55 };
const FONTS = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

const imageSize = (magnification) => clamp(8 + 3 * Math.log10(magnification || 1e-9), 3.5, 17);

const box = (x, y, w, height) => [
  [x, y],
  [x + w, y],
  [x + w, y + height],
  [x, y + height],
];

const cross = ([x, y]) => [[x - 4, y - 4], [x + 4, y + 4], null, [x - 4, y + 4], [x + 4, y - 4]];

function drawStar(pen, [x, y], look) {
  const corners = [];
  const r = look.dragging ? 13 : look.small ? 5 : 10;
  for (let i = 0; i < 10; i++) {
    const angle = (i * Math.PI) / 5 - Math.PI / 2;
    const far = i % 2 ? 0.44 * r : r;
    corners.push([x + far * Math.cos(angle), y + far * Math.sin(angle)]);
  }
  const { star, ink } = look.colours;
  if (look.dragging) pen.disk(x, y, 22, { fill: star, alpha: 0.2 });
  for (const { part } of look.flashes) pen.disk(x, y, 10 + 26 * part, { stroke: star, width: 2, alpha: 1 - part });
  pen.line(corners, { fill: star, stroke: ink, width: look.small ? 0.7 : 1.4, closed: true, alpha: look.faint ? 0.35 : 1 });
}
