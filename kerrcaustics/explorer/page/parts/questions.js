// Questions to the program: one of each kind is on its way, and the newest waits.

const kindOf = (want) => (["orbit", "shapes", "waves", "backdrop"].includes(want) ? want : "view");
const NONE = { view: null, orbit: null, shapes: null, waves: null, backdrop: null };

class Questions {
  constructor(send, now = () => performance.now()) {
    Object.assign(this, { send, now, number: 0, open: false, heard: 0, progress: {} });
    this.waiting = { ...NONE };
    this.forget();
  }
  // more: what a question has beside its state.
  ask(want, state, since, whole, more = {}) {
    const kind = kindOf(want);
    // Curves that are still to come must not be forgotten for a star that moves.
    const older = this.waiting[kind];
    if (want === "star" && (older?.want === "full" || !whole)) want = older?.want ?? "full";
    this.waiting[kind] = {
      want,
      since: since ?? this.now(),
      asked: older?.asked ?? this.now(),
      state: { ...state },
      more,
    };
    this.next(kind);
  }
  next(kind) {
    if (!this.open || this.sent[kind] || !this.waiting[kind]) return;
    const question = { ...this.waiting[kind], id: ++this.number, sent: this.now() };
    this.sent[kind] = question;
    this.waiting[kind] = null;
    this.send(JSON.stringify({ id: question.id, want: question.want, state: question.state, ...question.more }));
  }
  // The question of an answer; undefined if it was forgotten.
  answered({ kind: what, id, want }) {
    this.heard = this.now();
    // What cannot be read at all is refused without its number.
    if (what === "refusal" && id === null) this.forget();
    const kind = kindOf(want);
    const question = this.sent[kind];
    if (!question || question.id !== id) return undefined;
    this.sent[kind] = null;
    this.progress[kind] = null;
    return question;
  }
  // The program answers questions about a state as those about the one that it put in its place.
  settle(asked, request) {
    const isSame = ({ state }) => cameraOf(state) === cameraOf(asked) && starKey(state) === starKey(asked);
    // The size, the frequency and the backdrop of a question stay those that its answer has.
    const { size: _, frequency: __, backdrop: ___, ...place } = request;
    for (const question of [...Object.values(this.sent), ...Object.values(this.waiting)])
      if (question && isSame(question)) Object.assign(question.state, place);
  }
  works(progress) {
    this.heard = this.now();
    if (progress.want) this.progress[kindOf(progress.want)] = progress;
  }
  begin() {
    this.heard = this.now();
    this.open = true;
    this.forget();
  }
  forget() {
    this.sent = { ...NONE };
    this.progress = {};
  }
  get busy() {
    return !this.open || [...Object.values(this.sent), ...Object.values(this.waiting)].some(Boolean);
  }
  // Whether the newest question of a kind is one of these.
  isAsked(kind, isOne) {
    const newest = this.waiting[kind] ?? this.sent[kind];
    return !!newest && isOne(newest);
  }
  isPending(kind) {
    return !!(this.sent[kind] || this.waiting[kind]);
  }
  // Seconds since the oldest question of a kind that has no answer.
  seconds(kind) {
    const asked = this.sent[kind]?.asked ?? this.waiting[kind]?.asked;
    return asked === undefined ? 0 : (this.now() - asked) / 1000;
  }
  // Milliseconds for which the program owes a word.
  get silence() {
    const sent = Object.values(this.sent).filter(Boolean);
    if (!this.open || !sent.length) return 0;
    return this.now() - Math.max(this.heard, Math.min(...sent.map((question) => question.sent)));
  }
}
