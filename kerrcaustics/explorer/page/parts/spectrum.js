// The modulus of a star's waves, by frequency.

class Spectrum {
  frame(w, height) {
    return { x: 44, y: 8, w: w - 54, h: height - 32 };
  }
  key() {
    return "";
  }
  still() {}
  live(pen, w, height, { waves }, { colours }) {
    if (!waves) return;
    const f = this.frame(w, height),
      { spectrum, frequency } = waves;
    const [low, high] = [spectrum[0][0], spectrum.at(-1)[0]];
    const most = 1.05 * Math.max(...spectrum.map(([, modulus]) => modulus));
    const x = (omega) => f.x + (f.w * Math.log(omega / low)) / Math.log(high / low);
    const y = (modulus) => f.y + f.h * (1 - modulus / most);
    const step = [0.2, 0.5, 1, 2, 5, 10, 20, 50].find((size) => most / size < 5) ?? 100;
    const mark = { fill: colours.soft, size: 11 };
    for (let level = 0; level < most; level += step) {
      pen.line([[f.x, y(level)], [f.x + f.w, y(level)]], { stroke: colours.grid });
      pen.text(f.x - 6, y(level), short(level), { ...mark, align: "right" });
    }
    for (const omega of [0.1, 1, 10, 100, 1000])
      if (omega >= low && omega <= high) pen.text(x(omega), f.y + f.h + 13, `ωM = ${omega}`, mark);
    pen.text(f.x + 6, f.y + 10, "|F|", { ...mark, align: "left" });
    pen.within(f.x, f.y, f.w, f.h, () => {
      const side = (sign) => spectrum.map(([omega, modulus, error]) => [x(omega), y(modulus + sign * error)]);
      pen.line([...side(1), ...side(-1).reverse()], { fill: colours.soft, alpha: 0.25, closed: true });
      pen.line(side(0), { stroke: indexColour(colours, 0), width: 1.6 });
      pen.line([[x(frequency), f.y], [x(frequency), f.y + f.h]], { stroke: colours.star, width: 2 });
    });
    pen.line(box(f.x, f.y, f.w, f.h), { stroke: colours.edge, closed: true });
  }
}
