// Two pens: one draws on a canvas, one writes SVG.

class CanvasPen {
  constructor(context, fonts) {
    this.c = context;
    this.fonts = fonts;
  }
  set({ stroke, fill, width = 1, dash = [], alpha = 1 }) {
    const c = this.c;
    c.globalAlpha = alpha;
    c.lineWidth = width;
    c.setLineDash(dash);
    c.lineJoin = "round";
    c.lineCap = "round";
    if (stroke) c.strokeStyle = stroke;
    if (fill) c.fillStyle = fill;
  }
  finish({ stroke, fill }) {
    if (fill) this.c.fill();
    if (stroke) this.c.stroke();
    this.c.globalAlpha = 1;
  }
  line(points, style) {
    this.set(style);
    this.c.beginPath();
    let pen = false;
    for (const p of points) {
      if (!p) {
        pen = false;
        continue;
      }
      if (pen) this.c.lineTo(p[0], p[1]);
      else this.c.moveTo(p[0], p[1]);
      pen = true;
    }
    if (style.closed) this.c.closePath();
    this.finish(style);
  }
  disk(x, y, r, style) {
    this.set(style);
    this.c.beginPath();
    this.c.arc(x, y, r, 0, 2 * Math.PI);
    this.finish(style);
  }
  text(x, y, words, { fill, size = 12, align = "center", weight = 400, halo }) {
    const c = this.c;
    c.font = `${weight} ${size}px ${this.fonts}`;
    c.textAlign = align;
    c.textBaseline = "middle";
    c.globalAlpha = 1;
    if (halo) {
      c.strokeStyle = halo;
      c.lineWidth = 3;
      c.setLineDash([]);
      c.lineJoin = "round";
      c.strokeText(words, x, y);
    }
    c.fillStyle = fill;
    c.fillText(words, x, y);
  }
  picture(image, x, y, w, height, alpha) {
    const c = this.c;
    c.save();
    c.globalAlpha = alpha;
    c.translate(x, y);
    // A picture of negative width is mirrored, and lies on the other side of its place.
    if (w < 0) c.scale(-1, 1);
    c.drawImage(image, 0, 0, Math.abs(w), height);
    c.restore();
  }
  within(x, y, w, height, draw) {
    const c = this.c;
    c.save();
    c.beginPath();
    c.rect(x, y, w, height);
    c.clip();
    draw();
    c.restore();
  }
  group(x, y, draw) {
    const c = this.c;
    c.save();
    c.translate(x, y);
    draw();
    c.restore();
  }
}

class SvgPen {
  constructor(width, height, fonts) {
    this.width = width;
    this.height = height;
    this.fonts = fonts;
    this.parts = [];
    this.clips = 0;
    this.at = [0, 0];
  }
  paint({ stroke, fill, width = 1, dash = [], alpha = 1 }) {
    return `fill="${fill ?? "none"}"${stroke ? ` stroke="${stroke}" stroke-width="${width}" stroke-linejoin="round" stroke-linecap="round"` : ""}${dash.length ? ` stroke-dasharray="${dash}"` : ""}${alpha < 1 ? ` opacity="${alpha}"` : ""}`;
  }
  line(points, style) {
    let path = "",
      pen = false;
    for (const p of points) {
      if (!p) {
        pen = false;
        continue;
      }
      path += `${pen ? "L" : "M"}${p[0].toFixed(2)} ${p[1].toFixed(2)}`;
      pen = true;
    }
    if (path) this.parts.push(`<path d="${path}${style.closed ? "Z" : ""}" ${this.paint(style)}/>`);
  }
  disk(x, y, r, style) {
    this.parts.push(`<circle cx="${x.toFixed(2)}" cy="${y.toFixed(2)}" r="${r.toFixed(2)}" ${this.paint(style)}/>`);
  }
  text(x, y, words, { fill, size = 12, align = "center", weight = 400, halo }) {
    const anchor = { left: "start", center: "middle", right: "end" }[align];
    const safe = String(words).replace(/[&<>]/g, (s) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[s]);
    this.parts.push(
      `<text x="${x.toFixed(1)}" y="${(y + size * 0.35).toFixed(1)}" font-family="${this.fonts.replace(/"/g, "'")}" font-size="${size}" font-weight="${weight}" text-anchor="${anchor}" fill="${fill}"${halo ? ` stroke="${halo}" stroke-width="3" paint-order="stroke"` : ""}>${safe}</text>`,
    );
  }
  picture(image, x, y, w, height, alpha) {
    const canvas = h("canvas");
    canvas.width = image.width;
    canvas.height = image.height;
    canvas.getContext("2d").drawImage(image, 0, 0);
    this.parts.push(
      `<image href="${canvas.toDataURL("image/jpeg", 0.85)}" transform="translate(${x} ${y})${w < 0 ? " scale(-1 1)" : ""}" width="${Math.abs(w)}" height="${height}" opacity="${alpha}" preserveAspectRatio="none"/>`,
    );
  }
  within(x, y, w, height, draw) {
    const name = `c${this.clips++}`;
    this.parts.push(
      `<clipPath id="${name}"><rect x="${x}" y="${y}" width="${w}" height="${height}"/></clipPath><g clip-path="url(#${name})">`,
    );
    draw();
    this.parts.push("</g>");
  }
  group(x, y, draw) {
    this.parts.push(`<g transform="translate(${x} ${y})">`);
    draw();
    this.parts.push("</g>");
  }
  whole(paper) {
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}"><rect width="100%" height="100%" fill="${paper}"/>${this.parts.join("\n")}</svg>\n`;
  }
}
