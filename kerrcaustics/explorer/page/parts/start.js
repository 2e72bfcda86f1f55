// The way in, for the page in a browser, the page without a program and notebooks.

// What programs and tests may ask of the page.
function mount(element, channel, options) {
  const explorer = new Explorer(element, channel, options);
  const { source, state } = explorer;
  const { right } = explorer.page;
  const onPage = ([x, y]) => {
    const { left, top } = right.canvas.getBoundingClientRect();
    return [x + left, y + top];
  };
  const frame = () => source.frame(...Object.values(sizeOf(right.canvas)));
  return {
    state: () => ({ ...state }),
    counts: () => explorer.counts,
    images: () => explorer.model.images,
    certified: () => explorer.certified,
    freshness: () => explorer.freshness,
    quality: () => explorer.shown.view?.answer.quality ?? null,
    busy: () => !!explorer.remembering || explorer.questions.busy,
    playing: () => !!explorer.playback.running,
    light: () => {
      explorer.layers.drop();
      const { shapes } = explorer.model;
      return shapes && { total: shapes.total, certified: shapes.certified, limbs: shapes.limbs.length };
    },
    waves: () => {
      explorer.layers.drop();
      const { waves } = explorer.model;
      return waves && { modulus: waves.modulus, error: waves.error, points: waves.spectrum.length };
    },
    orbit: () => {
      const { orbit } = explorer.model;
      return orbit && { events: orbit.events, frames: orbit.frames.length };
    },
    latencies: () => explorer.screen.latencies,
    frames: () => explorer.screen.drawn,
    flashed: () => explorer.screen.flashes.length,
    kept: () => explorer.quiz.hidden?.images.per_index ?? null,
    line: () => explorer.status.line,
    invites: () => explorer.invitation.isOnStar,
    curves: () => explorer.model.curves.map(({ celestial }) => celestial),
    windows: () => ({ source: source.chart.window ?? null, picture: explorer.model.window }),
    starSpots: () => source.starSpots(state, frame()).map(({ at }) => onPage(at)),
    spot: (theta, phi) => onPage(source.spot([theta, phi], frame())),
    show: (wanted) => explorer.show(wanted),
    lose: (line) => explorer.lose(line),
    leave: () => explorer.page.leave(),
  };
}
