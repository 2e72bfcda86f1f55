// Colours, dashes and names of what is drawn.

// Colours of Okabe and Ito: told apart by colour-blind readers. Index k has the colour of the critical curve of order k.
const COLOURS = {
  light: {
    order: ["#b07400", "#0072b2", "#c44e00", "#00795a", "#a8467d"],
    ink: "#1c2330",
    soft: "#68748a",
    grid: "#d8dee8",
    shadow: "#dfe3ea",
    edge: "#8791a3",
    paper: "#ffffff",
    star: "#e69f00",
    halo: "#ffffff",
  },
  dark: {
    order: ["#f2c14e", "#56b4e9", "#ff8a3d", "#2fd0a0", "#ec9fce"],
    ink: "#eef2f8",
    soft: "#97a3b8",
    grid: "#293142",
    shadow: "#04060a",
    edge: "#5c677c",
    paper: "#10151f",
    star: "#ffc83d",
    halo: "#10151f",
  },
};
const DASHES = [[], [], [9, 3], [2.5, 2.5], [9, 3, 2, 3]];
const NAMES = ["", "primary", "secondary", "tertiary", "4th order"];
// Behind curves a picture is as bright as this, and curves have a dark outline.
const DIM = 0.72;
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
  const r = look.dragging ? 13 : 10;
  for (let i = 0; i < 10; i++) {
    const angle = (i * Math.PI) / 5 - Math.PI / 2;
    const far = i % 2 ? 0.44 * r : r;
    corners.push([x + far * Math.cos(angle), y + far * Math.sin(angle)]);
  }
  const { star, ink } = look.colours;
  if (look.dragging) pen.disk(x, y, 22, { fill: star, alpha: 0.2 });
  for (const { part } of look.flashes) pen.disk(x, y, 10 + 26 * part, { stroke: star, width: 2, alpha: 1 - part });
  pen.line(corners, { fill: star, stroke: ink, width: 1.4, closed: true, alpha: look.faint ? 0.35 : 1 });
}
