// What is shown: each part with the request that it answers.

const NO_PICTURE = { lensed: null, celestial: null, window: null, behind: null };

class Shown {
  constructor(explorer) {
    Object.assign(this, { explorer, view: null, images: null, version: 0 });
    const { state } = explorer;
    this.model = { state, curves: [], images: [], edge: [], axes: null, ...NO_PICTURE, orbit: null, shapes: null, waves: null };
  }
  showView(answer, request) {
    if (answer.quality !== "star") this.showCurves(answer, request);
    if (!this.explorer.playback.running) this.showImages(answer, request);
  }
  showCurves(answer, request) {
    const [edge, curves] = [rows(answer.arrays.edge), curvesOf(answer)];
    Object.assign(this.model, { edge, curves, axes: answer.axes, motion: answer.motion });
    this.view = { answer, request };
    this.version += 1;
    this.explorer.fit();
  }
  // Coarse curves have no images.
  showImages(answer, request) {
    if (this.explorer.quiz.keeps(answer, request)) return;
    const images = answer.images ? imagesOf(answer) : [];
    const news = sameCamera(this.images, request) ? this.flash(images, answer.state.orders) : "";
    this.model.images = images;
    this.images = answer.images ? { answer, request, ...answer.images } : null;
    if (answer.images) this.explorer.say(news);
  }
  hideImages() {
    Object.assign(this.model, { shapes: null, waves: null });
    this.model.images = [];
    this.images = null;
    this.explorer.tables.forget();
    this.explorer.page.left.canvas.setAttribute("aria-label", "The camera sky, without the images");
  }
  // A moment of the orbit that is played.
  showMoment(part) {
    const { frames, state, events } = this.model.orbit;
    const frame = frames[Math.min(frames.length - 1, Math.floor(part * frames.length))];
    const news = sameCamera(this.images, state) ? this.flash(frame.images, state.orders, events) : "";
    this.explorer.state.phi = frame.phi;
    this.model.images = frame.images;
    const request = this.explorer.request();
    this.explorer.layers.drop();
    this.images = { answer: null, request, certified: frame.certified, remarks: [] };
    return news;
  }
  showOrbit(answer) {
    this.model.orbit = orbitOf(answer);
    this.version += 1;
  }
  dropOrbit() {
    this.model.orbit = null;
    this.version += 1;
  }
  async showBackdrop(answer, request) {
    // A JPEG file, or pixels.
    const picture = ({ data, shape: [rows, columns] }) =>
      createImageBitmap(columns ? new ImageData(data, columns, rows) : new Blob([data], { type: "image/jpeg" }));
    const { lensed, celestial } = answer.arrays;
    const pictures = lensed ? await Promise.all([picture(lensed), picture(celestial)]) : [null, null];
    // Another may be wanted by now.
    const behind = backdropKey(request);
    if (behind !== backdropKey(this.explorer.request())) return;
    const [first, second] = pictures;
    Object.assign(this.model, { lensed: first, celestial: second, window: answer.window, behind });
    this.version += 1;
    this.explorer.redraw();
  }
  dropBackdrop() {
    Object.assign(this.model, NO_PICTURE);
    this.version += 1;
  }
  // The state was put right by an answer: what it shows belongs to the state as it is now.
  settle(request) {
    for (const part of [this.view, this.images]) if (part) part.request = request;
  }
  get counts() {
    return countsOf(this.model.images, this.explorer.state.orders);
  }
  // Lets pairs that came or went flash, and says so.
  flash(after, orders, events = []) {
    const before = this.model.images;
    const changes = [
      ["created", before, after],
      ["annihilated", after, before],
    ];
    const line = (word, pair) => {
      this.explorer.screen.flash(pair, this.placeOf(pair, events));
      return `A pair of index ${pair.order - 1} and ${pair.order} was ${word}. `;
    };
    const pairs = (old, now) => pairsBorn(old, now, orders, this.model.curves);
    return changes.flatMap(([word, old, now]) => pairs(old, now).map((pair) => line(word, pair))).join("");
  }
  // While an orbit is played the place itself is known.
  placeOf({ order, sky }, events) {
    const gap = (event) => Math.abs(mod(event.part - this.explorer.playback.moment + 0.5, 1) - 0.5);
    const [event] = events.filter((one) => one.order === order).sort((a, b) => gap(a) - gap(b));
    return event?.sky ?? sky;
  }
}
