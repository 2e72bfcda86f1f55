// Numbers and words: tables, commands, and what a pointer reads.

const IMAGE_TITLES = () => [
  term("Morse index", "index"),
  term("parity"),
  term("magnification"),
  term("redshift", "ν/ν₀"),
  term("error", "error (°)"),
];
const CAUSTIC_TITLES = () => [
  term("order"),
  term("circuits"),
  ...["θ′ extent (°)", "φ′ extent (°)"],
  term("cusp", "cusps"),
  term("error", "error (°)"),
  "",
];

const parityOf = (index) => (index % 2 ? "−" : "+");

// With two digits where a power of ten takes their room.
const extent = (x, digits) => short(x, x < 1e-3 ? 3 : digits);

// certified: null where nothing is said of it.
function sentenceOf(counts, certified) {
  const parts = counts.map((n, k) => `${n} of index ${k}`).join(", ");
  const all = counts.reduce((a, b) => a + b, 0);
  const certificate = certified === null ? "" : certified ? "; certified" : "; not certified";
  return `${all} images: ${parts}${certificate}.`;
}

class Tables {
  constructor(look) {
    this.look = look;
    this.images = h("table", { class: "kc-images" });
    this.caustics = h("table", { class: "kc-caustics" });
    this.code = h("pre", { class: "kc-code", tabindex: "0" });
    this.live = h("p", { class: "kc-said", role: "status", "aria-live": "polite" });
    const section = (title, table) => h("section", {}, h("h2", {}, ...title), h("div", { class: "kc-scroll" }, table));
    this.element = h(
      "div",
      { class: "kc-tables" },
      section([term("image", "Images"), " of the star"], this.images),
      section([term("caustic", "Caustics")], this.caustics),
    );
    const summary = h("summary", {}, "The same on the command line and in Python");
    this.details = h("details", {}, summary, this.code);
  }
  mark(colour) {
    const mark = h("span", { class: "kc-mark" }, "●");
    mark.style.color = colour;
    return mark;
  }
  writeImages(images) {
    const line = ({ index, magnification, redshift, error }) => [
      [this.mark(indexColour(this.look(), index)), ` ${index}`],
      ...[parityOf(index), short(magnification), short(redshift), short(error, 2)],
    ];
    this.images.replaceChildren(...tableOf(IMAGE_TITLES(), images.map(line)));
  }
  writeCaustics(curves, zoom) {
    const line = (curve) => [
      [this.mark(orderColour(this.look(), curve.order)), ` ${curve.order}`],
      ...[extent(curve.circuits, 4), extent(curve.theta_extent, 5), extent(curve.phi_extent, 6)],
      ...[String(curve.cusps.length), short(curve.error, 2)],
      button("show", `Zoom to the ${NAMES[curve.order]} caustic`, () => zoom(curve)),
    ];
    this.caustics.replaceChildren(...tableOf(CAUSTIC_TITLES(), curves.map(line)));
  }
  // The numbers that are shown; those of images once the star stands still.
  follow(explorer) {
    const { shown, model, dragging } = explorer;
    const { view, images } = shown;
    if (!dragging && images) this.writeImages(model.images);
    if (view?.answer.quality === "full" && explorer.writtenView !== view) {
      explorer.writtenView = view;
      this.writeCaustics(model.curves, (curve) => explorer.zoomTo(curve));
    }
    const answer = images?.answer ?? view?.answer;
    if (answer) this.writeCode(answer);
  }
  // What tells of images, for the quiz.
  forget() {
    this.images.replaceChildren();
    this.live.textContent = "";
  }
  writeCode({ commands, python }) {
    this.code.textContent = `${commands.join("\n")}\n\n${python}`;
  }
}

// Lines about a thing under the pointer.
function about({ image, event, cusp, curve, point, star }) {
  if (image) return aboutImage(image);
  if (event) return aboutEvent(event);
  if (cusp)
    return [`Cusp, ${NAMES[curve.order]} caustic`, ...places(cusp.celestial, 9), `error ${short(cusp.error, 2)}°`];
  if (star) return ["The star", places([star.theta, star.phi], 7).join(", "), "drag it"];
  const coarse = curve.circuits === undefined;
  const title = `${NAMES[curve.order]} critical curve and caustic`;
  return [title, `here ${places(point, 7).join(", ")}`, ...(coarse ? ["coarse"] : aboutCurve(curve))];
}

const places = ([theta, phi], digits) => [`θ′ = ${short(theta, digits)}°`, `φ′ = ${short(phi, digits)}°`];

function aboutImage({ index, magnification, redshift, azimuth, sky, error }) {
  const ray = redshift === undefined ? [] : [`ν/ν₀ ${short(redshift, 6)}`, `φ′ of the ray ${short(azimuth, 7)}°`];
  const title = `Image of index ${index}, parity ${parityOf(index)}`;
  const direction = `N = (${sky.map((x) => x.toFixed(6)).join(", ")})`;
  return [title, `magnification ${short(magnification)}`, ...ray, direction, `error ${short(error, 2)}°`];
}

function aboutEvent({ kind, order, part, phi, error, at_cusp }) {
  const moment = `at ${(100 * part).toFixed(3)} % of the orbit`;
  const lines = [`Pair ${kind}, order ${order}`, moment, `star at φ′ = ${short(phi, 8)}°`, `error ${short(error, 2)}°`];
  return [...lines, ...(at_cusp ? ["at a cusp"] : [])];
}

function aboutCurve({ kind, circuits, theta_extent, phi_extent, error }) {
  const extents = `extents ${short(theta_extent, 5)}° × ${short(phi_extent, 6)}°`;
  return [`${kind}, ${short(circuits)} circuits`, extents, `error ${short(error, 2)}°`];
}
