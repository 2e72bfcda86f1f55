// Questions to the program: one of each kind is on its way, and the newest waits.

const kindOf = (want) => (want === "orbit" || want === "backdrop" ? want : "view");

class Questions {
  constructor(send) {
    this.send = send;
    this.number = 0;
    this.open = false;
    this.sent = { view: null, orbit: null, backdrop: null };
    this.waiting = { view: null, orbit: null, backdrop: null };
  }
  ask(want, state, since, whole) {
    const kind = kindOf(want);
    // Curves that are still to come must not be forgotten for a star that moves.
    const older = this.waiting[kind];
    if (want === "star" && (older?.want === "full" || !whole)) want = older?.want ?? "full";
    this.waiting[kind] = { want, since: since ?? performance.now(), state: { ...state } };
    this.next(kind);
  }
  next(kind) {
    if (!this.open || this.sent[kind] || !this.waiting[kind]) return;
    const question = { ...this.waiting[kind], id: ++this.number };
    this.sent[kind] = question;
    this.waiting[kind] = null;
    this.send(JSON.stringify({ id: question.id, want: question.want, state: question.state }));
  }
  // The question of an answer.
  answered(answer) {
    const kind = kindOf(answer.want);
    const question = this.sent[kind];
    if (question && answer.id === question.id) this.sent[kind] = null;
    // What cannot be read at all is refused without its number.
    if (answer.kind === "refusal" && answer.id === null) this.forget();
    return question;
  }
  forget() {
    this.sent = { view: null, orbit: null, backdrop: null };
  }
  get busy() {
    return !this.open || [...Object.values(this.sent), ...Object.values(this.waiting)].some(Boolean);
  }
}
