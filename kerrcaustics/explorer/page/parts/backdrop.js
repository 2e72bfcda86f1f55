// The picture behind the curves, for the part of the camera sky that is shown.

class Backdrop {
  constructor(explorer) {
    this.explorer = explorer;
  }
  ask() {
    const { state, page, sky, questions, model } = this.explorer;
    if (state.backdrop === "none") return;
    const { w, height } = sizeOf(page.left.canvas);
    const window = windowOf(sky.window(w, height));
    const key = backdropKey(this.explorer.request());
    const isIt = ({ state, more }) => backdropKey(state) === key && covers(more.window, window);
    if (questions.isAsked("backdrop", isIt)) return;
    if (model.behind !== key || !covers(model.window, window)) this.explorer.ask("backdrop", undefined, { window });
  }
  take(answer, { state }) {
    const { explorer } = this;
    if (backdropKey(state) === backdropKey(explorer.request())) explorer.shown.showBackdrop(answer, state);
  }
}
