// The badge, the line about work that lasts, and the banner about what went wrong; old things are dim meanwhile.

// Milliseconds between looks at the clock, and those for which work is not worth a line.
const LOOK = 250;
const PATIENCE = 700;

class Status {
  constructor(explorer) {
    this.explorer = explorer;
    this.badge = h("span", { class: "kc-badge", tabindex: "0", "data-term": "certified" });
    this.work = h("p", { class: "kc-work", role: "status", hidden: true });
    this.banner = h("p", { class: "kc-banner", role: "alert", hidden: true });
    Object.assign(this, { complaint: "", lost: "", notice: "", isFound: false, since: performance.now() });
    this.clock = setInterval(() => this.look(), LOOK);
  }
  leave() {
    clearInterval(this.clock);
  }
  get line() {
    return this.lost || this.complaint;
  }
  complain(line) {
    this.complaint = line;
    this.tell();
  }
  lose(line) {
    this.lost = line;
    this.tell();
  }
  find() {
    this.isFound = true;
    this.lose("");
  }
  // What is pending has a clock.
  look() {
    const isSaid = this.explorer.questions.busy || this.lost;
    this.listen();
    if (isSaid || this.lost) this.tell();
  }
  // Whether the program still speaks.
  listen() {
    const { questions, channel } = this.explorer;
    const { silence } = questions;
    const isSilent = silence > SILENCE;
    if (isSilent)
      this.lost = `The program has not answered for ${Math.floor(silence / 1000)} s: it has stopped, or is very busy.`;
    else if (this.silent) this.lost = "";
    this.silent = isSilent;
    if (silence > RENEWAL) channel.renew?.();
  }
  // What is pending, in words; the clock of an orbit has its own.
  tell() {
    const { freshness } = this.explorer;
    this.write(this.banner, this.line);
    this.write(this.work, this.lost ? "" : this.workLine());
    const badge = this.badgeNow(freshness);
    this.write(this.badge, badge.text);
    this.badge.className = `kc-badge ${badge.kind}`;
    this.describe(badge);
    this.dim(freshness);
  }
  badgeNow(freshness) {
    const { questions, counts, certified, dragging } = this.explorer;
    const isIdle = freshness.images === "none" && !questions.isPending("view") && !this.lost;
    if (isIdle) return { text: "", kind: "" };
    return badgeOf(freshness, counts, certified, { lost: this.lost, seconds: questions.seconds("view"), dragging });
  }
  // What is said in words is said of the state that the badge speaks of.
  describe({ text, kind, hasCounts }) {
    const { tables, page, model, state } = this.explorer;
    const words = hasCounts ? this.explorer.words(kind !== "kc-working") : text;
    this.write(tables.live, this.notice || words);
    const star = places([state.theta, state.phi], 4).join(", ");
    page.left.canvas.setAttribute("aria-label", `The camera sky: ${words}`);
    const label = `The celestial sphere: the star at ${star}, and ${model.curves.length} caustics`;
    page.right.canvas.setAttribute("aria-label", label);
  }
  // A line until something else changes.
  notify(line) {
    this.notice = line;
    this.tell();
    this.notice = "";
  }
  workLine() {
    const { questions, playback, options } = this.explorer;
    const waited = performance.now() - this.since;
    this.work.classList.toggle("kc-waits", !this.isFound);
    if (!this.isFound && (options.waitsFor || waited > PATIENCE))
      return waitingLine(options.waitsFor ?? "program", waited / 1000);
    playback.wait(questions.progress.orbit, questions.seconds("orbit"));
    const kind = ["view", "shapes", "waves", "backdrop"].find((one) => questions.seconds(one) * 1000 > PATIENCE);
    return kind ? workLine(questions.progress[kind], questions.seconds(kind)) : "";
  }
  write(element, text) {
    if (element.textContent !== text) element.textContent = text;
    element.hidden = !text;
  }
  dim(freshness) {
    const { page, tables, exports } = this.explorer;
    const old = { curves: freshness.curves === "old", images: freshness.images !== "current" };
    const isOld = (element, is) => element.classList.toggle("kc-old", is);
    isOld(page.left.canvas, old.curves || freshness.images === "old");
    isOld(page.right.canvas, old.curves);
    isOld(tables.images, old.images);
    isOld(tables.caustics, freshness.curves !== "current");
    isOld(tables.code, old.images);
    for (const panel of [page.left, page.right]) panel.coarse.hidden = freshness.curves !== "coarse";
    exports.allow(isWhole(freshness));
  }
}
