// The page in a notebook: anywidget calls this.

export default {
  render({ model, el }) {
    const listeners = [];
    const channel = {
      state: model.get("state"),
      listen: (heard) => listeners.push(heard),
      send: (text) => model.send({ kind: "question", text }),
    };
    const heard = (message, buffers) => {
      if (message?.kind === "message") buffers.forEach((bytes) => listeners.forEach((listener) => listener(bytes)));
    };
    model.on("msg:custom", heard);
    const explorer = mount(el, channel, { waitsFor: "kernel", invites: true });
    const followed = () => {
      const wanted = model.get("state");
      if (JSON.stringify(wanted) !== JSON.stringify(explorer.state()) && !explorer.busy()) explorer.show(wanted);
    };
    model.on("change:state", followed);
    model.send({ kind: "hello" });
    return () => {
      model.off("msg:custom", heard);
      model.off("change:state", followed);
      explorer.leave();
    };
  },
};
