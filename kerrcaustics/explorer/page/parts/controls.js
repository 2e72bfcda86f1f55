// Controls of the camera and the star.

const SPIN_END = 4;
const spinAt = (u) => (u >= SPIN_END ? 0.9999 : round(1 - 10 ** -u, 4));
const spinPlace = (a) => -Math.log10(1 - a);
const same = (x) => x;

const SLIDERS = [
  { name: "spin", label: "Spin a", low: 0, high: SPIN_END, step: 0.005, value: spinAt, place: spinPlace, unit: "" },
  {
    name: "radius",
    label: "Radius r (M)",
    low: 0,
    high: 3,
    step: 0.002,
    value: (u) => round(10 ** u, 4),
    place: Math.log10,
    unit: " M",
  },
  { name: "inclination", label: "Inclination (°)", low: 0, high: 180, step: 0.5, value: same, place: same, unit: "°" },
  { name: "theta", label: "Star θ′ (°)", low: 0, high: 180, step: 0.1, value: same, place: same, unit: "°" },
  {
    name: "phi",
    label: "Star φ′ (°)",
    low: 0,
    high: 360,
    step: 0.1,
    value: same,
    place: (phi) => mod(phi, TURN),
    unit: "°",
  },
];

class Slider {
  constructor({ name, label, low, high, step, value, place, unit }, changed) {
    this.name = name;
    this.place = place;
    this.unit = unit;
    this.range = h("input", { type: "range", min: low, max: high, step, "aria-label": label });
    this.number = h("input", { type: "number", step: "any", "aria-label": `${label}, number` });
    const moved = (event, x, want) => {
      if (Number.isFinite(x)) changed({ [name]: x }, want, event.timeStamp);
    };
    this.range.addEventListener("input", (e) => moved(e, value(Number(this.range.value)), "draft"));
    this.range.addEventListener("change", (e) => moved(e, value(Number(this.range.value)), "full"));
    this.number.addEventListener("change", (e) => moved(e, Number(this.number.value), "full"));
    this.element = h("label", { class: "kc-slider" }, h("span", {}, label), this.number, this.range);
  }
  follow(state) {
    const value = state[this.name];
    this.range.value = this.place(value);
    if (document.activeElement !== this.number) this.number.value = Number(value.toPrecision(6));
    this.range.setAttribute("aria-valuetext", `${short(value, 5)}${this.unit}`);
  }
}

class Controls {
  constructor(changed) {
    this.sliders = SLIDERS.map((about) => new Slider(about, changed));
    const choose =
      (name, as = same) =>
      (value) =>
        changed({ [name]: as(value) }, "full");
    const orders = [1, 2, 3, 4].map((k) => [k, `${k}: index ${k > 1 ? `0–${k - 1}` : 0}`]);
    const velocities = ["circular", "fiducial", "static"].map((name) => [name, name]);
    const skies = [
      ["none", "none"],
      ["stars", "star field"],
      ["checkerboard", "checkerboard"],
    ];
    this.choices = {
      velocity: select("Velocity of the camera", velocities, choose("velocity")),
      orders: select("Orders of critical curves", orders, choose("orders", Number)),
      backdrop: select("Sky behind the curves", skies, choose("backdrop")),
    };
    const labels = { velocity: "Velocity", orders: "Orders", backdrop: "Backdrop" };
    const labelled = ([name, node]) => h("label", { class: "kc-choice" }, h("span", {}, labels[name]), node);
    const parts = [...this.sliders.map((slider) => slider.element), ...Object.entries(this.choices).map(labelled)];
    this.element = h("section", { class: "kc-controls", "aria-label": "Camera" }, ...parts);
  }
  follow(state) {
    this.sliders.forEach((slider) => slider.follow(state));
    for (const [name, node] of Object.entries(this.choices)) node.value = String(state[name]);
  }
}
