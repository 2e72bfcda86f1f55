// The page in a notebook: anywidget calls this. Where no kernel answers, as in an exported notebook, the page computes its
// answers itself, until one does. LIVE: the data for that, or null.

// Milliseconds.
const KERNEL_PATIENCE = 6000;

export default {
  render({ model, el }) {
    const listeners = [];
    let live = null;
    const tell = (answer) => listeners.forEach((listener) => listener(answer));
    const channel = {
      state: model.get("state"),
      listen: (heard) => listeners.push(heard),
      send: (text) => (live ? live.send(text) : model.send({ kind: "question", text })),
    };
    const leaveAlone = () => {
      clearTimeout(alone);
      live?.close();
      live = null;
    };
    const heard = (message, buffers) => {
      if (message?.kind !== "message") return;
      leaveAlone();
      buffers.forEach(tell);
    };
    model.on("msg:custom", heard);
    const explorer = mount(el, channel, { waitsFor: "kernel", invites: true });
    const alone = setTimeout(() => {
      if (!LIVE || !canCompute()) return;
      live = new LiveChannel(LIVE);
      live.explorer = explorer;
      live.listen(tell);
    }, KERNEL_PATIENCE);
    const followed = () => {
      const wanted = model.get("state");
      if (JSON.stringify(wanted) !== JSON.stringify(explorer.state()) && !explorer.busy()) explorer.show(wanted);
    };
    model.on("change:state", followed);
    model.send({ kind: "hello" });
    return () => {
      leaveAlone();
      model.off("msg:custom", heard);
      model.off("change:state", followed);
      explorer.leave();
    };
  },
};
