// Messages to a worker, or to the page itself where there are no workers: the kernels first, then questions. Of each
// kind the newest is answered; views come first.

function answerMessages(scope) {
  const waiting = new Map(),
    { port1, port2 } = new MessageChannel();
  let answers = null;
  // After a message that has arrived meanwhile.
  const soon = () => port2.postMessage(null);
  port1.onmessage = () => {
    const kind = waiting.has("view") ? "view" : waiting.keys().next().value;
    if (!answers || kind === undefined) return;
    const question = waiting.get(kind);
    waiting.delete(kind);
    scope.postMessage(answers.answer(question));
    if (waiting.size) soon();
  };
  const begin = async ({ kernels, layout, rules }) => {
    try {
      await loadKernels(kernels, layout);
      answers = new Answers(rules);
      scope.postMessage({ kind: "ready" });
      soon();
    } catch (error) {
      scope.postMessage({ kind: "failure", line: `The kernels of this page could not be started: ${error.message}` });
    }
  };
  scope.onmessage = ({ data }) => {
    if (data.kernels) return void begin(data);
    waiting.set(["orbit", "backdrop"].includes(data.want) ? data.want : "view", data);
    soon();
  };
}
