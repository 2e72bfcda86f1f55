// The explorer: draws what an answer says of a state, and asks when the state changes. Loads nothing.
//
// mount(element, channel, options) shows it. A channel has
//   send(text)      asks a question {"id", "want", "state"};
//   listen(heard)   heard(bytes) is called with each answer (see Message.encoded in page_data.py);
//   state           values to begin with; remember(state), link(): optional.

class Explorer {
  constructor(element, channel, options = {}) {
    Object.assign(this, { channel, options, dragging: false, line: "" });
    this.state = { ...DEFAULTS, ...channel.state };
    this.wantedVelocity = this.state.velocity;
    this.model = { state: this.state, curves: [], images: [], edge: [], axes: null, ...NO_PICTURE, orbit: null };
    this.shown = { view: null, images: null, certified: null, version: 0 };
    this.questions = new Questions((text) => channel.send(text));
    this.makeParts();
    element.replaceChildren(this.page.root);
    this.page.connect();
    this.follow();
    channel.listen((bytes) => this.hear(bytes));
  }
  makeParts() {
    [this.sky, this.source, this.screen] = [new SkyPanel(), new SourcePanel(), new Screen(this)];
    this.controls = new Controls((...change) => this.control(...change));
    this.tables = new Tables(() => this.screen.colours);
    this.playback = new Playback(this);
    this.exports = new Exports(this);
    this.page = new Page(this);
  }

  // -- questions and answers
  ask(want, since) {
    this.questions.ask(want, this.state, since, this.isWhole);
  }
  get isWhole() {
    const { view } = this.shown;
    return view?.quality === "full" && cameraOf(view.state) === cameraOf(this.state);
  }
  hear(bytes) {
    const answer = bytes instanceof ArrayBuffer || ArrayBuffer.isView(bytes) ? decoded(bytes) : bytes;
    if (answer.kind === "greeting") return this.greet(answer);
    const question = this.questions.answered(answer);
    const kind = kindOf(answer.want);
    if (answer.kind === "refusal") this.refuse(answer.line, kind);
    else if (kind === "view") this.view(answer, question);
    else if (kind === "orbit") this.orbit(answer);
    else this.backdrop(answer);
    this.questions.next(kind);
    this.redraw(question);
  }
  greet({ presets }) {
    this.page.offer(presets);
    this.questions.forget();
    this.questions.open = true;
    this.complain("");
    this.change({}, "full");
  }
  lose(line) {
    this.questions.open = false;
    this.complain(line);
  }
  refuse(line, kind) {
    this.complain(line);
    if (kind !== "view") return this.playback.stop();
    if (this.shown.view || this.onceRefused) return;
    // What an address asks for may not exist; the usual state does.
    this.onceRefused = true;
    Object.assign(this.state, DEFAULTS);
    this.wantedVelocity = this.state.velocity;
    this.follow();
    this.ask("full");
  }
  complain(line) {
    this.line = line;
    this.page.complain(line);
  }
  view(answer, question) {
    if (this.shown.view || !this.onceRefused) this.complain("");
    // A page of few states shows the nearest one.
    if (answer.nearest) {
      Object.assign(this.state, answer.state);
      this.follow();
    }
    if (answer.quality !== "star") this.showCurves(answer);
    if (!this.playback.running) this.showImages(answer);
    if (answer.quality === "full" && question?.want !== "draft") this.askBackdrop();
    this.dropOldOrbit();
    this.playback.allow(answer.has_orbit);
    this.write();
  }
  showCurves(answer) {
    const [edge, curves] = [rows(answer.arrays.edge), curvesOf(answer)];
    Object.assign(this.model, { edge, curves, axes: answer.axes });
    this.shown.view = answer;
    this.shown.version += 1;
    this.fit();
  }
  showImages(answer) {
    if (!answer.images) {
      this.model.images = [];
      this.shown.images = null;
      return;
    }
    const images = imagesOf(answer);
    const before = this.shown.images;
    const isSame = before && cameraOf(before.state) === cameraOf(answer.state);
    const news = isSame ? this.flash(this.model.images, images, answer.state.orders) : "";
    this.model.images = images;
    this.shown.images = answer;
    this.say(news);
  }
  orbit(answer) {
    if (orbitKey(answer.state) !== orbitKey(this.state)) {
      if (this.playback.running) this.ask("orbit");
      return;
    }
    this.model.orbit = orbitOf(answer);
    this.shown.version += 1;
    this.playback.show(this.model.orbit);
  }
  dropOldOrbit() {
    const { orbit } = this.model;
    if (!orbit || orbitKey(orbit.state) === orbitKey(this.state)) return;
    this.model.orbit = null;
    this.playback.drop();
  }
  askBackdrop() {
    const key = backdropKey(this.state);
    if (this.state.backdrop !== "none" && this.model.behind !== key) this.ask("backdrop");
  }
  async backdrop(answer) {
    const key = backdropKey(answer.state);
    if (key !== backdropKey(this.state)) return;
    const picture = ({ data }) => createImageBitmap(new Blob([data], { type: "image/jpeg" }));
    const { lensed, celestial } = answer.arrays;
    const pictures = lensed ? await Promise.all([picture(lensed), picture(celestial)]) : [null, null];
    Object.assign(this.model, {
      lensed: pictures[0],
      celestial: pictures[1],
      backdropField: answer.field,
      behind: key,
    });
    this.shown.version += 1;
    this.redraw();
  }

  // -- changes
  control(changes, want, since) {
    if (changes.velocity) this.wantedVelocity = changes.velocity;
    this.change(changes, want, since);
  }
  change(changes, want, since) {
    Object.assign(this.state, changes);
    settle(this.state, this.wantedVelocity);
    this.dropOldOrbit();
    if (want !== "star" && this.model.behind && this.model.behind !== backdropKey(this.state))
      Object.assign(this.model, NO_PICTURE);
    this.follow();
    if (want !== "draft") this.remember();
    this.ask(want, since);
    this.redraw();
  }
  follow() {
    this.controls.follow(this.state);
    this.page.charts.value = this.state.chart;
  }
  show(wanted) {
    this.playback.stop();
    this.wantedVelocity = wanted.velocity ?? this.wantedVelocity;
    this.sky.reset();
    this.source.reset();
    this.change({ ...DEFAULTS, ...wanted }, "full");
  }
  chooseChart(chart) {
    this.state.chart = chart;
    this.fit();
    this.remember();
    this.redraw();
  }
  zoomTo(curve) {
    if (this.state.chart === "globe") this.state.chart = "map";
    this.fit();
    this.follow();
    this.source.chart.look(curve);
    this.redraw();
  }
  fit() {
    this.sky.fit(this.model);
    this.source.fit(this.model);
  }
  // Browsers bear few changes of the address a second.
  remember() {
    this.remembering ??= setTimeout(() => {
      this.remembering = null;
      this.channel.remember?.({ ...this.state });
    }, 150);
  }
  drags(isStar) {
    this.dragging = isStar;
    this.redraw();
  }
  moveStar(theta, phi, since) {
    this.playback.stop();
    this.change({ theta, phi }, "star", since);
  }
  settleStar() {
    this.remember();
    this.ask("star");
  }
  showMoment(part) {
    const { frames, period, state, events } = this.model.orbit;
    const frame = frames[Math.min(frames.length - 1, Math.floor(part * frames.length))];
    const before = this.model.images;
    const news = before.length ? this.flash(before, frame.images, state.orders, events) : "";
    this.state.phi = frame.phi;
    this.model.images = frame.images;
    Object.assign(this.shown, { images: null, certified: frame.certified });
    this.controls.follow(this.state);
    this.playback.tell(part, period);
    this.say(news);
    if (performance.now() - (this.written ?? 0) < 200) return;
    this.written = performance.now();
    this.write();
  }
  // Lets pairs that came or went flash, and says so.
  flash(before, after, orders, events = []) {
    const changes = [
      ["created", before, after],
      ["annihilated", after, before],
    ];
    const gap = (event) => Math.abs(mod(event.part - this.playback.moment + 0.5, 1) - 0.5);
    const line = (word, pair) => {
      // While an orbit is played the place itself is known.
      const [event] = events.filter((e) => e.order === pair.order).sort((a, b) => gap(a) - gap(b));
      this.screen.flash(pair, event?.sky ?? pair.sky);
      return `A pair of index ${pair.order - 1} and ${pair.order} was ${word}. `;
    };
    const pairs = (old, now) => pairsBorn(old, now, orders, this.model.curves);
    return changes.flatMap(([word, old, now]) => pairs(old, now).map((pair) => line(word, pair))).join("");
  }

  redraw(question) {
    this.screen.redraw(question);
  }
  recolour() {
    this.writtenView = null;
    this.write();
    this.redraw();
  }

  // -- words
  get counts() {
    return countsOf(this.model.images, this.state.orders);
  }
  get certified() {
    const { images, certified } = this.shown;
    return images ? images.images.certified : certified;
  }
  say(news = "") {
    const words = news + sentenceOf(this.counts, this.certified);
    this.tables.writeBadge(this.counts, this.certified);
    const remarks = this.shown.images?.images.remarks ?? [];
    if (!this.playback.running || news) this.tables.live.textContent = [words, ...remarks].join(" ");
    const star = places([this.state.theta, this.state.phi], 4).join(", ");
    this.page.left.canvas.setAttribute("aria-label", `The camera sky: ${words}`);
    const label = `The celestial sphere: the star at ${star}, and ${this.model.curves.length} caustics`;
    this.page.right.canvas.setAttribute("aria-label", label);
  }
  write() {
    const { view, images } = this.shown;
    if (!this.dragging && this.model.images.length) this.tables.writeImages(this.model.images);
    if (view?.quality === "full" && this.writtenView !== view) {
      this.writtenView = view;
      this.tables.writeCaustics(this.model.curves, (curve) => this.zoomTo(curve));
    }
    if (images ?? view) this.tables.writeCode(images ?? view);
  }
}

const NO_PICTURE = { lensed: null, celestial: null, backdropField: 200, behind: null };
