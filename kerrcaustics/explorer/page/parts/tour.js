// Lessons: stars to look at, each with an idea; one after the other they are the tour.

class Tour {
  constructor(explorer) {
    Object.assign(this, { explorer, lessons: [], step: null });
    this.place = h("span", { class: "kc-step" });
    this.title = h("h2", {});
    [this.idea, this.look, this.count] = ["kc-idea", "kc-look", "kc-count"].map((name) => h("p", { class: name }));
    this.back = button("← Back", "Previous step of the tour", () => this.show(this.step - 1));
    this.next = button("Next →", "Next step of the tour", () => this.show(this.step + 1));
    const close = button("✕", "Close the tour", () => this.close());
    const head = h("header", {}, this.place, this.title, h("div", { class: "kc-tools" }, this.back, this.next, close));
    const parts = [head, this.idea, this.look, this.count];
    this.element = h("section", { class: "kc-lesson", "aria-label": "Tour", tabindex: "-1", hidden: true }, ...parts);
    this.button = button("Tour", "A tour", () => this.toggle(), { hidden: true, "aria-pressed": "false" });
  }
  learn(lessons) {
    this.lessons = lessons;
    this.button.hidden = !lessons.length;
    const label = `A tour of ${lessons.length} steps`;
    Object.assign(this.button, { title: label, ariaLabel: label });
  }
  toggle() {
    if (this.step === null) this.show(0);
    else this.close();
  }
  show(step) {
    const lesson = this.lessons[step];
    if (!lesson) return;
    this.explorer.quiz.close();
    this.explorer.invitation.close();
    this.step = step;
    this.place.textContent = `${step + 1} of ${this.lessons.length}`;
    this.title.textContent = lesson.name;
    const { terms } = this.explorer.page;
    this.idea.replaceChildren(...terms.marked(lesson.idea));
    this.look.replaceChildren(h("b", {}, "Look for: "), ...terms.marked(lesson.look_for));
    this.count.replaceChildren(h("b", {}, "Here: "), lesson.count);
    this.back.disabled = step === 0;
    this.next.disabled = step === this.lessons.length - 1;
    this.mark(true);
    this.explorer.visit(lesson.state, lesson.zoom);
    // Whose key pressed a button that is off now, goes on from the text.
    if (document.activeElement?.disabled) this.element.focus();
  }
  close() {
    this.step = null;
    this.mark(false);
  }
  mark(isOpen) {
    this.element.hidden = !isOpen;
    this.button.setAttribute("aria-pressed", String(isOpen));
  }
}
