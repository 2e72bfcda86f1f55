// The quiz: a star and the caustics, without the images. It asks for their number where the count is certified alone.

const MOST_TRIES = 12;
// Caustics of slower holes are points, and every star has one image of each index; the spin that is taken then.
const LEAST_SPIN = 0.1,
  USUAL_SPIN = 0.5;

class Quiz {
  constructor(explorer, random = Math.random) {
    Object.assign(this, { explorer, random, open: false, hidden: null, asks: false, tries: 0, right: 0, asked: 0 });
    this.question = h("label", { class: "kc-question", for: "kc-guess" });
    this.guess = h("input", { type: "text", maxlength: 3, id: "kc-guess", inputmode: "numeric", autocomplete: "off" });
    this.answer = h("button", { type: "submit" }, "Answer");
    this.another = button("Another star", "Another star", () => this.choose());
    this.score = h("span", { class: "kc-score" });
    this.verdict = h("p", { class: "kc-verdict", role: "status" });
    const close = button("✕", "Close the quiz", () => this.close());
    const tools = h("div", { class: "kc-tools" }, this.another, close);
    const line = [this.question, this.guess, this.answer, this.score, tools];
    const form = h("form", { onsubmit: (event) => this.judge(event) }, ...line);
    this.element = h("section", { class: "kc-quiz", "aria-label": "Quiz", hidden: true }, form, this.verdict);
    this.button = button("Quiz", "A quiz: how many images?", () => this.toggle(), { "aria-pressed": "false" });
  }
  toggle() {
    if (this.open) this.close();
    else this.begin();
  }
  begin() {
    this.explorer.tour.close();
    this.explorer.invitation.close();
    Object.assign(this, { open: true, right: 0, asked: 0, tries: 0 });
    this.score.textContent = "";
    this.mark();
    this.choose();
  }
  close() {
    if (!this.open) return;
    this.open = false;
    this.mark();
    this.reveal();
  }
  mark() {
    this.element.hidden = !this.open;
    this.button.setAttribute("aria-pressed", String(this.open));
  }
  // Images are hidden from now until an answer, or until somebody moves star or camera.
  choose() {
    const { explorer } = this;
    explorer.playback.stop();
    this.wait("Looking for a star …");
    explorer.shown.hideImages();
    const star = quizStar(explorer.model.curves, this.random),
      isSlow = explorer.state.spin < LEAST_SPIN;
    this.chooses = true;
    explorer.change(isSlow ? { ...star, spin: USUAL_SPIN } : star, isSlow ? "full" : "star");
    this.chooses = false;
  }
  wait(words) {
    Object.assign(this, { asks: false, hidden: null, hides: true });
    this.question.textContent = words;
    this.verdict.textContent = "";
    this.guess.value = "";
    this.allow(false);
  }
  allow(asks) {
    this.guess.disabled = this.answer.disabled = !asks;
  }
  // Whether it keeps an answer to itself, and asks for the number of its images.
  keeps(answer, request) {
    if (!this.hides || !answer.images) return false;
    if (starKey(request) !== starKey(this.explorer.state)) return true;
    if (!answer.images.certified && ++this.tries < MOST_TRIES) {
      this.choose();
      return true;
    }
    if (!answer.images.certified) {
      this.reveal();
      this.verdict.textContent = "No star with a certified count was found here: change the camera, and try again.";
      return false;
    }
    this.ask(answer);
    return true;
  }
  ask(answer) {
    if (this.asks) return;
    Object.assign(this, { hidden: answer, asks: true, tries: 0 });
    const { orders } = answer.state;
    const indices = orders > 1 ? `index 0 to ${orders - 1}` : "index 0";
    this.question.replaceChildren("How many images of ", term("Morse index", indices), " does this star have?");
    this.allow(true);
    // A keyboard on the screen would hide the star.
    if (matchMedia("(pointer: fine)").matches) this.guess.focus({ preventScroll: true });
  }
  judge(event) {
    event.preventDefault();
    const guess = numberOf(this.guess.value);
    if (!this.asks) return;
    if (!Number.isInteger(guess)) return void (this.verdict.textContent = "Enter a whole number.");
    const counts = this.hidden.images.per_index;
    const number = counts.reduce((a, b) => a + b, 0);
    const isRight = guess === number;
    this.asked += 1;
    this.right += isRight;
    this.reveal();
    const verdict = isRight ? "Right." : `Not ${guess}.`;
    const words = `${verdict} ${sentenceOf(counts, true)} ${reasonOf(counts)}`;
    this.verdict.replaceChildren(...this.explorer.page.terms.marked(words));
    this.score.textContent = `${this.right} of ${this.asked} right`;
    this.another.focus({ preventScroll: true });
  }
  reveal() {
    const { hidden } = this;
    Object.assign(this, { hidden: null, asks: false, hides: false });
    this.allow(false);
    if (hidden) this.explorer.shown.showImages(hidden, this.explorer.request());
    this.explorer.write();
    this.explorer.status.tell();
    this.explorer.redraw();
  }
  // A camera or a star that somebody else has changed.
  leaveTo() {
    if (!this.open || !this.hides || this.chooses) return;
    this.hidden = null;
    this.reveal();
    this.question.textContent = "The star or the camera was moved.";
  }
}
