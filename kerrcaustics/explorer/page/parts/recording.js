// One orbit as a GIF, made by the page itself: each frame is the picture that is exported.

const [FEWEST_FRAMES, MOST_FRAMES, FRAMES_A_SECOND] = [48, 200, 12];

class Recording {
  constructor(explorer) {
    Object.assign(this, { explorer, running: false, wanted: false });
    this.words = "● Record GIF";
    this.button = button(this.words, "Record one orbit as a GIF", () => this.toggle(), { class: "kc-record" });
  }
  toggle() {
    if (this.running || this.wanted) return this.stop();
    this.explorer.playback.stop();
    this.wanted = true;
    if (this.explorer.model.orbit) return this.start();
    this.button.textContent = "■ Stop";
    this.explorer.ask("orbit");
  }
  stop() {
    Object.assign(this, { running: false, wanted: false });
    this.button.textContent = this.words;
  }
  // Once there are tracks.
  start() {
    if (!this.wanted || this.running) return;
    Object.assign(this, { wanted: false, running: true });
    this.record().finally(() => this.stop());
  }
  async record() {
    const { playback, state, model } = this.explorer;
    const [seconds, before, { phi }] = [playback.seconds, playback.nearestMoment(model.orbit), state];
    const count = clamp(Math.round(FRAMES_A_SECOND * seconds), FEWEST_FRAMES, MOST_FRAMES);
    const paper = this.explorer.exports.paper(1);
    const picture = (part) => {
      playback.seek(part);
      return paper.pixels();
    };
    const palette = new Palette([0, 0.25, 0.5, 0.75].map(picture));
    const gif = new Gif(paper.w, paper.height, palette, Math.round((100 * seconds) / count));
    for (let i = 0; i < count && this.running; i++) {
      gif.add(picture(i / count));
      this.button.textContent = `■ Stop (${Math.round((100 * (i + 1)) / count)} %)`;
      // The page lives on between frames.
      await new Promise((resume) => setTimeout(resume, 0));
    }
    const isWhole = this.running;
    if (model.orbit) {
      playback.seek(before);
      this.explorer.change({ phi }, "star");
    }
    if (isWhole) this.explorer.exports.deliver(new Blob([gif.whole()], { type: "image/gif" }), "gif");
  }
}
