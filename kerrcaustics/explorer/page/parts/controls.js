// Controls of the camera and the star.

// Pixels of the page's width up to which its controls are folded; explorer.css has the same number.
const NARROW = 700;

const SPIN_END = 4;
const spinAt = (u) => (u >= SPIN_END ? 0.9999 : round(1 - 10 ** -u, 4));
const spinPlace = (a) => -Math.log10(1 - a);
const radiusAt = (u) => round(10 ** u, 5);
const same = (x) => x;
// A point at the left end.
const SIZE_START = -3;
const sizeAt = (u) => (u <= SIZE_START ? 0 : round(10 ** u, 3));
const placeOfSize = (size) => (size > 0 ? Math.max(SIZE_START, Math.log10(size)) : SIZE_START);
// Rays alone at the left end.
const WAVES_START = -1.32;
const frequencyAt = (u) => (u <= WAVES_START ? 0 : round(10 ** u, 3));
const placeOfFrequency = (omega) => (omega > 0 ? Math.log10(omega) : WAVES_START);

const SPIN = { label: "Spin a", low: 0, high: SPIN_END, step: 0.005, value: spinAt, place: spinPlace, unit: "" };
const RADIUS = { label: "Radius r (M)", low: 0, high: 3, step: 0.002, value: radiusAt, place: Math.log10, unit: " M" };
const SIZE = { low: SIZE_START, high: Math.log10(20), step: 0.01, value: sizeAt, place: placeOfSize, unit: "°" };
const WAVES = { low: WAVES_START, high: 3, step: 0.01, value: frequencyAt, place: placeOfFrequency, unit: "" };
const ANGLE = { low: 0, high: 180, step: 0.1, value: same, place: same, unit: "°" };
const SLIDERS = {
  spin: SPIN,
  radius: RADIUS,
  inclination: { ...ANGLE, label: "Inclination (°)", step: 0.5 },
  theta: { ...ANGLE, label: "Star θ′ (°)" },
  phi: { ...ANGLE, label: "Star φ′ (°)", high: 360, place: (phi) => mod(phi, TURN) },
  size: { ...SIZE, label: "Star radius (°)" },
  frequency: { ...WAVES, label: "Frequency ωM" },
};

// The words of a label; the first of those that need it says what it means.
function labelOf(name, label) {
  const meaning = { spin: "spin", radius: "radius", inclination: "inclination", velocity: "velocity", orders: "order" };
  const [word, ...rest] = label.split(" ");
  return meaning[name] ? [term(meaning[name], word), ` ${rest.join(" ")}`] : [label];
}

// A slider that stops at a few values.
function stopping(slider, stops) {
  const gap = (x) => (i) => Math.abs(stops[i] - x);
  const place = (x) => stops.reduce((best, _, i) => (gap(x)(i) < gap(x)(best) ? i : best), 0);
  return { ...slider, low: 0, high: stops.length - 1, step: 1, value: (i) => stops[i], place, stops };
}

const noteOf = () => h("small", { class: "kc-note", role: "alert", hidden: true });

function note(element, text) {
  element.textContent = text;
  element.hidden = !text;
}

class Slider {
  constructor(name, { label, low, high, step, value, place, unit, stops }, changed, edited) {
    Object.assign(this, { name, place, unit, changed, allowed: null });
    this.range = h("input", { type: "range", min: low, max: high, step, "aria-label": label });
    const more = stops ? { readonly: true, title: `Available: ${stops.join(", ")}${unit}` } : {};
    // A field for numbers would drop a decimal comma without a word.
    const kind = { type: "text", inputmode: "decimal", autocomplete: "off", class: "kc-number" };
    this.number = h("input", { ...kind, "aria-label": `${label}, number`, ...more });
    this.note = noteOf();
    const move = (want) => (e) => this.move(value(Number(this.range.value)), want, e);
    this.range.addEventListener("input", move("draft"));
    this.range.addEventListener("change", move("full"));
    this.number.addEventListener("input", edited);
    this.number.addEventListener("change", (e) => this.type(e));
    this.number.addEventListener("blur", () => this.follow(this.state));
    const words = h("span", {}, ...labelOf(name, label));
    this.element = h("label", { class: "kc-slider" }, words, this.number, this.range, this.note);
  }
  allow(limits) {
    this.allowed = limits;
  }
  move(value, want, event) {
    const [low, high] = this.allowed ?? [value, value];
    this.changed({ [this.name]: clamp(value, low, high) }, want, event.timeStamp);
  }
  // What is not allowed is said, and the last good value stays.
  type(event) {
    const value = numberOf(this.number.value);
    const complaint = complaintAbout(value, this.allowed ?? [-Infinity, Infinity], this.unit);
    this.say(complaint);
    if (complaint) this.write();
    else this.changed({ [this.name]: value }, "full", event.timeStamp);
  }
  say(text) {
    note(this.note, text);
    this.number.setAttribute("aria-invalid", String(!!text));
  }
  write() {
    this.number.value = Number(this.state[this.name].toPrecision(6));
  }
  follow(state) {
    this.state = state;
    const value = state[this.name];
    this.range.value = this.place(value);
    if (document.activeElement !== this.number) this.write();
    this.range.setAttribute("aria-valuetext", `${short(value, 5)}${this.unit}`);
  }
}

const CHOICES = {
  velocity: ["Velocity", "Velocity of the camera", ["circular", "fiducial", "static"].map((name) => [name, name])],
  orders: [
    "Orders",
    "Orders of critical curves",
    [1, 2, 3, 4].map((k) => [k, `${k}: index ${k > 1 ? `0–${k - 1}` : 0}`]),
  ],
  backdrop: [
    "Backdrop",
    "Sky behind the curves",
    [
      ["none", "none"],
      ["stars", "star field"],
      ["checkerboard", "checkerboard"],
    ],
  ],
};

class Choice {
  constructor(name, [label, about, values], changed) {
    const as = name === "orders" ? Number : same;
    this.name = name;
    this.select = select(about, values, (value) => changed({ [name]: as(value) }, "full"));
    this.note = noteOf();
    this.element = h("label", { class: "kc-choice" }, h("span", {}, ...labelOf(name, label)), this.select, this.note);
  }
  say(text) {
    note(this.note, text);
  }
  follow(state) {
    this.select.value = String(state[this.name]);
  }
}

class Controls {
  constructor(changed, offered) {
    this.offered = offered;
    this.sliders = {};
    this.choices = {};
    const slider = (name, about = SLIDERS[name]) => (this.sliders[name] = new Slider(name, about, changed, () => this.quiet())).element;
    const choice = (name) => (this.choices[name] = new Choice(name, CHOICES[name], changed)).element;
    const parts = offered
      ? [this.cameras(changed), slider("theta", stopping(SLIDERS.theta, offered.thetas)), slider("phi")]
      : [...Object.keys(SLIDERS).map((name) => slider(name)), ...Object.keys(CHOICES).map(choice)];
    this.summary = h("span", {});
    const fields = h("div", { class: "kc-fields" }, ...parts);
    this.fold = h("details", { open: true }, h("summary", {}, "Camera and star ", this.summary), fields);
    this.element = h("section", { class: "kc-controls", "aria-label": "Camera and star" }, this.fold);
  }
  // Folded when the page becomes narrow, so that the panels are in sight; open, without a summary, where it is wide.
  fit(width) {
    const isNarrow = width <= NARROW;
    if (isNarrow !== this.isNarrow) this.fold.open = !isNarrow;
    this.isNarrow = isNarrow;
  }
  // The cameras of a page without a program.
  cameras(changed) {
    const { cameras, thetas } = this.offered;
    const values = cameras.map(({ spin, radius }, i) => [i, `a = ${spin}, r = ${radius} M`]);
    this.camera = select("Camera", values, (i) => {
      const { spin, radius, inclination, velocity, orders } = cameras[i];
      changed({ spin, radius, inclination, velocity, orders }, "full");
    });
    const line = `${this.offered.why}: the page has ${cameras.length} cameras on circular orbits, and stars `;
    const more = `at ${thetas.length} colatitudes θ′. The command “kerrcaustics explore” shows all others.`;
    return h(
      "div",
      { class: "kc-offered" },
      h("label", { class: "kc-choice" }, h("span", {}, "Camera"), this.camera),
      h("small", {}, line + more),
    );
  }
  allow(allowed) {
    for (const [name, slider] of Object.entries(this.sliders)) slider.allow(allowed[name]);
    this.obstacles = allowed.velocity;
    for (const option of this.choices.velocity?.select.options ?? []) {
      option.title = this.obstacles[option.value] && `The velocity ${this.obstacles[option.value]}`;
      option.disabled = !!option.title;
    }
  }
  // Takes back what was said of a choice before.
  quiet() {
    for (const part of [...Object.values(this.sliders), ...Object.values(this.choices)]) part.say("");
  }
  // Says what an answer changed of a request.
  settle(asked, state) {
    if (this.offered) return;
    const isMoved = asked.radius !== state.radius;
    if (isMoved)
      this.sliders.radius.say(
        `${asked.radius} M is too close to the hole: for this spin the radius must be at least ${state.radius} M.`,
      );
    const isOther = asked.velocity !== state.velocity;
    this.choices.velocity.say(isOther ? `The velocity ${this.obstacles[asked.velocity]}` : "");
  }
  follow(state) {
    for (const part of [...Object.values(this.sliders), ...Object.values(this.choices)]) part.follow(state);
    this.summary.textContent = `a = ${short(state.spin, 6)}, r = ${short(state.radius, 6)} M`;
    if (!this.offered) return;
    const isOne = (camera) => camera.spin === state.spin && camera.radius === state.radius;
    this.camera.value = String(this.offered.cameras.findIndex(isOne));
  }
}
