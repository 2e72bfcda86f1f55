// The first visit: the star says that it can be dragged, and the tour is offered.

class Invitation {
  constructor(explorer) {
    this.explorer = explorer;
    this.isOpen = !!explorer.options.invites;
    // Until the star is moved.
    this.isOnStar = this.isOpen;
    const take = button("Take the tour", "Take the tour", () => explorer.tour.show(0), { class: "kc-take" });
    const close = button("✕", "Close the invitation", () => this.close());
    this.words = h("span", {}, "Drag the star over a caustic: a pair of images is born on the critical curve.");
    this.element = h("p", { class: "kc-invitation", hidden: true }, this.words, take, close);
  }
  // Once there are lessons.
  offer(count) {
    this.element.hidden = !this.isOpen || !count;
  }
  dragged() {
    this.isOnStar = false;
  }
  close() {
    this.isOpen = false;
    this.isOnStar = false;
    this.element.hidden = true;
    this.explorer.redraw();
  }
}
