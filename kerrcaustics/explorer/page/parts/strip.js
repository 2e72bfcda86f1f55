// Brightness of the images over one orbit.

class Strip {
  frame(w, height) {
    return { x: 44, y: 8, w: w - 54, h: height - 32 };
  }
  key() {
    return "";
  }
  live(pen, w, height, model, look) {
    const f = this.frame(w, height),
      x = f.x + f.w * look.moment;
    if (model.orbit)
      pen.line(
        [
          [x, f.y],
          [x, f.y + f.h],
        ],
        { stroke: look.colours.star, width: 2.5 },
      );
  }
  still(pen, w, height, model, look) {
    const f = this.frame(w, height),
      colours = look.colours,
      { orbit } = model;
    if (!orbit) return;
    const lights = orbit.tracks
      .flatMap((track) => track.light.map((row) => row[1]))
      .filter((m) => m > 0)
      .sort((a, b) => a - b);
    const low = Math.max(-7, Math.floor(Math.log10(lights[Math.floor(0.005 * lights.length)] ?? 0.01))),
      high = Math.min(3, Math.ceil(Math.log10(lights[Math.floor(0.995 * lights.length)] ?? 10)));
    const y = (m) => f.y + (f.h * (high - Math.log10(m))) / Math.max(1, high - low);
    for (let e = low; e <= high; e += Math.ceil((high - low) / 4)) {
      pen.line(
        [
          [f.x, y(10 ** e)],
          [f.x + f.w, y(10 ** e)],
        ],
        { stroke: colours.grid },
      );
      pen.text(f.x - 6, y(10 ** e), e < -2 || e > 3 ? raised(`1e${e}`).slice(2) : String(10 ** e), {
        fill: colours.soft,
        size: 11,
        align: "right",
      });
    }
    for (let i = 0; i <= 4; i++)
      pen.text(f.x + (f.w * i) / 4, f.y + f.h + 13, i === 4 ? "1 orbit" : i ? `${i}/4` : "0", {
        fill: colours.soft,
        size: 11,
        align: i === 4 ? "right" : "center",
      });
    pen.within(f.x, f.y, f.w, f.h, () => {
      for (const event of orbit.events) {
        const x = f.x + f.w * event.part;
        pen.line(
          [
            [x, f.y],
            [x, f.y + f.h],
          ],
          {
            stroke: orderColour(colours, event.order),
            width: 1.4,
            dash: event.kind === "creation" ? [] : [3, 3],
            alpha: 0.8,
          },
        );
      }
      for (const track of orbit.tracks) this.light(pen, track, f, y, colours);
    });
    pen.line(
      [
        [f.x, f.y],
        [f.x + f.w, f.y],
        [f.x + f.w, f.y + f.h],
        [f.x, f.y + f.h],
      ],
      { stroke: colours.edge, closed: true },
    );
  }
  light(pen, track, f, y, colours) {
    const count = track.light.length;
    for (let i = 0; i + 1 < count + (track.closed ? 1 : 0); i++) {
      const [a, m, index] = track.light[i],
        [b, n, other] = track.light[(i + 1) % count];
      if (!(m > 0 && n > 0)) continue;
      const shift = mod(a, 1),
        step = mod(b - a + 0.5, 1) - 0.5;
      for (const turn of [0, -1, 1])
        pen.line(
          [
            [f.x + f.w * (shift + turn), y(m)],
            [f.x + f.w * (shift + turn + step), y(n)],
          ],
          { stroke: indexColour(colours, Math.max(index, other)), width: 1.6 },
        );
    }
  }
}
