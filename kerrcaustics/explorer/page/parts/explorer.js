// The explorer: draws what an answer says of a state, and asks when the state changes. Loads nothing.
//
// mount(element, channel, options) shows it. A channel has
//   send(text)      asks a question {"id", "want", "state"};
//   listen(heard)   heard(bytes) is called with each answer (see Message.encoded in page_data.py);
//   state           values to begin with;
//   offered         optional: the only cameras, and heights of stars, that can be asked for;
//   remember(state), link(), renew(): optional.

class Explorer {
  constructor(element, channel, options = {}) {
    Object.assign(this, { channel, options, dragging: false, news: "" });
    this.state = { ...DEFAULTS, ...channel.state };
    this.wantedVelocity = this.state.velocity;
    this.questions = new Questions((text) => channel.send(text));
    this.makeParts();
    element.replaceChildren(this.page.root);
    this.page.connect();
    this.follow();
    this.source.fit(this.model);
    this.status.tell();
    channel.listen((bytes) => this.hear(bytes));
  }
  makeParts() {
    [this.sky, this.source, this.screen] = [new SkyPanel(), new SourcePanel(), new Screen(this)];
    this.shown = new Shown(this);
    this.model.heights = this.channel.offered?.thetas ?? [];
    this.controls = new Controls((...change) => this.control(...change), this.channel.offered);
    this.tables = new Tables(() => this.screen.colours);
    this.playback = new Playback(this);
    [this.layers, this.backdrop] = [new Layers(this), new Backdrop(this)];
    this.exports = new Exports(this);
    this.invitation = new Invitation(this);
    [this.tour, this.quiz, this.recording] = [new Tour(this), new Quiz(this), new Recording(this)];
    this.status = new Status(this);
    this.page = new Page(this);
  }
  get model() {
    return this.shown.model;
  }

  // -- questions and answers
  // The state as it is asked for: with the velocity that was chosen, also where the camera cannot have it now.
  request() {
    return { ...this.state, velocity: this.wantedVelocity };
  }
  get freshness() {
    return freshnessOf(this.request(), this.shown);
  }
  get isWhole() {
    return this.freshness.curves === "current";
  }
  ask(want, since, more) {
    this.questions.ask(want, this.request(), since, this.isWhole, more);
    this.status.tell();
  }
  hear(bytes) {
    const answer = bytes instanceof ArrayBuffer || ArrayBuffer.isView(bytes) ? decoded(bytes) : bytes;
    if (answer.kind === "greeting") return this.greet(answer);
    if (answer.kind === "progress") this.questions.works(answer);
    else this.take(answer);
    this.status.listen();
    this.status.tell();
  }
  take(answer) {
    const question = this.questions.answered(answer);
    const kind = kindOf(answer.want);
    if (answer.kind === "refusal") this.refuse(answer, kind, question);
    else if (question && LAYERS[kind]) this.layers.take(kind, answer, question);
    else if (question && kind === "backdrop") this.backdrop.take(answer, question);
    else if (question) this[{ view: "takeView", orbit: "takeOrbit" }[kind]](answer, question);
    this.questions.next(kind);
    this.redraw(question);
  }
  greet({ presets, allowed, lessons = [], terms = {}, lasting = false }) {
    this.page.offer(presets, lessons);
    this.tour.learn(lessons);
    this.invitation.offer(lessons.length);
    this.channel.isLasting = lasting;
    this.page.explain(terms);
    this.controls.allow(allowed);
    this.questions.begin();
    this.status.find();
    this.status.complain("");
    this.change({}, "full");
  }
  lose(line) {
    this.questions.open = false;
    this.playback.stop();
    this.status.lose(line);
  }
  refuse({ line }, kind, question) {
    this.status.complain(line);
    if (kind === "orbit") this.recording.stop();
    if (kind === "orbit") return this.playback.stop();
    if (kind === "backdrop" || LAYERS[kind] || this.shown.view || this.onceRefused) return;
    // What an address asks for may not exist; the usual state does.
    this.onceRefused = true;
    Object.assign(this.state, DEFAULTS);
    this.wantedVelocity = this.state.velocity;
    this.follow();
    this.ask("full", question?.since);
  }
  takeView(answer, question) {
    if (this.shown.view || !this.onceRefused) this.status.complaint = "";
    const isNew = sameCamera({ request: question.state }, this.request());
    this.shown.showView(answer, question.state);
    if (isNew) this.controls.allow(answer.allowed);
    if (isNew && starKey(question.state) === starKey(this.state)) this.settle(answer.state, question.state);
    if (answer.quality === "full" && question.want !== "draft") this.backdrop.ask();
    this.layers.ask();
    this.dropOldOrbit();
    this.playback.allow(answer.has_orbit);
    this.write();
  }
  // The state that the answer is for: cameras that cannot be are moved, and the page without a program has few.
  settle({ chart: _, sphere: __, backdrop: ___, size: ____, frequency: _____, ...settled }, asked) {
    Object.assign(this.state, settled);
    if (this.channel.offered) this.wantedVelocity = this.state.velocity;
    this.shown.settle(this.request());
    this.questions.settle(asked, this.request());
    this.controls.settle(asked, this.state);
    this.follow();
  }
  takeOrbit(answer, question) {
    if (orbitKey(question.state) === orbitKey(this.request())) {
      this.shown.showOrbit({ ...answer, state: question.state });
      this.playback.show(this.model.orbit);
      this.recording.start();
    } else if (this.playback.isWaiting) this.ask("orbit");
  }
  dropOldOrbit() {
    const { orbit } = this.model;
    if (!orbit || orbitKey(orbit.state) === orbitKey(this.request())) return;
    this.shown.dropOrbit();
    this.playback.drop();
  }

  // -- changes
  control(changes, want, since) {
    if (changes.velocity) this.wantedVelocity = changes.velocity;
    this.change(changes, want, since);
  }
  change(changes, want, since) {
    Object.assign(this.state, changes);
    this.controls.quiet();
    this.quiz.leaveTo();
    this.dropOldOrbit();
    this.layers.drop();
    if (this.model.behind && this.model.behind !== backdropKey(this.request())) this.shown.dropBackdrop();
    this.follow();
    if (want !== "draft") this.remember();
    this.ask(want, since);
    this.redraw();
  }
  follow() {
    this.controls.follow(this.state);
    this.page.charts.value = this.state.chart;
    this.page.tellSide(this.state);
  }
  // A lesson or a preset: the sphere stays as the user has turned it.
  visit(wanted, zoom) {
    this.show({ ...wanted, sphere: this.state.sphere }, zoom);
  }
  // zoom: the order of the caustic that the sphere shows alone.
  show(wanted, zoom) {
    this.playback.stop();
    this.recording.stop();
    this.wantedVelocity = wanted.velocity ?? this.wantedVelocity;
    this.sky.reset();
    this.source.reset();
    this.change({ ...DEFAULTS, ...wanted }, "full");
    this.source.fit(this.model);
    this.source.order = zoom || null;
  }
  // The chart of the celestial sphere, or the side from which it is seen.
  lookAt(changes) {
    Object.assign(this.state, changes);
    this.follow();
    this.fit();
    this.remember();
    this.redraw();
  }
  zoomTo(curve) {
    if (this.state.chart === "globe") this.state.chart = "map";
    this.fit();
    this.follow();
    this.source.look(curve);
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
    this.status.tell();
    this.redraw();
  }
  moveStar(theta, phi, since) {
    this.playback.stop();
    this.invitation.dragged();
    this.change(starAt(theta, phi), "star", since);
  }
  settleStar() {
    this.remember();
    this.ask("star");
  }
  showMoment(part) {
    this.quiz.leaveTo();
    const news = this.shown.showMoment(part);
    this.controls.follow(this.state);
    this.playback.tell(part, this.model.orbit.period);
    this.say(news);
    this.status.tell();
    if (performance.now() - (this.written ?? 0) < 200) return;
    this.written = performance.now();
    this.write();
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
    return this.shown.counts;
  }
  get certified() {
    return this.shown.images?.certified ?? null;
  }
  // News of pairs stands until there is other news, or the star stands still.
  say(news) {
    if (!this.playback.running || news) this.news = news;
  }
  words(withCertificate) {
    if (withCertificate) return this.news + this.lines.join(" ");
    return this.news + sentenceOf(this.counts, null);
  }
  // The count with its certificate and remarks, the light of a disc, the waves.
  get lines() {
    const counted = [sentenceOf(this.counts, this.certified), ...(this.shown.images?.remarks ?? [])].join(" ");
    return [counted, ...lightOf(this.model.shapes), ...wavesWords(this.model.waves)];
  }
  write() {
    this.tables.follow(this);
  }
}
