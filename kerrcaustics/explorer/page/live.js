// A channel whose answers are computed in the browser: by workers, or by the page itself where there are none.
// `liveProgram` is their program, a function of their scope.

const EMPTY = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0);
// A function that splats a byte over a vector and counts its bits.
const WITH_SIMD = Uint8Array.of(...EMPTY, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11);
const SLOW = { orbit: "tracks of the images", backdrop: "the sky behind the curves" };
const NOT_STARTED = "The kernels of this page could not be started";
const ONLY_PROGRAM = "This page works without a program: it shows sizes and waves only for the stars of the tour.";

// Browsers and policies may forbid it.
function canCompute() {
  try {
    return !!new WebAssembly.Module(EMPTY);
  } catch {
    return false;
  }
}

async function kernelsOf({ simd, plain }) {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const isNew = typeof DecompressionStream !== "undefined" && WebAssembly.validate(WITH_SIMD);
  if (!isNew && plain) return bytes(plain);
  const unpacked = new Blob([bytes(simd)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(unpacked).arrayBuffer());
}

// A worker, or the page itself where a worker cannot start: send(message), end().
function hostOf(heard) {
  const sent = [];
  let [post, worker, speaks] = [null, null, false];
  const onPage = () => {
    const scope = { postMessage: heard };
    liveProgram(scope);
    post = (message) => scope.onmessage({ data: message });
    sent.forEach(post);
  };
  try {
    worker = new Worker(URL.createObjectURL(new Blob([`(${liveProgram})(self)`], { type: "text/javascript" })));
    worker.onmessage = ({ data }) => (speaks = true) && heard(data);
    worker.onerror = () => speaks || onPage();
    post = (message) => worker.postMessage(message);
  } catch {
    onPage();
  }
  const send = (message) => {
    if (!speaks) sent.push(message);
    post(message);
  };
  return { send, end: () => worker?.terminate() };
}

class LiveChannel {
  // data: kernels, their layout, rules and a greeting; stored(question): the shapes or waves of a lesson, or nothing.
  constructor(data, stored = () => null) {
    Object.assign(this, { data, stored, listeners: [], pending: new Map(), hosts: {} });
    this.began = kernelsOf(data).then((kernels) => ({ kernels, layout: data.layout, rules: data.rules }));
    this.clock = setInterval(() => this.report(), 1000);
    setTimeout(() => this.tell(data.greeting), 0);
  }
  listen(heard) {
    this.listeners.push(heard);
  }
  tell(message) {
    this.listeners.forEach((heard) => heard(message));
  }
  send(text) {
    const question = JSON.parse(text),
      { id, want } = question;
    if (LAYERS[want]) {
      const layer = this.stored(question) ?? { kind: "refusal", line: ONLY_PROGRAM };
      return void setTimeout(() => this.tell({ ...layer, id, want, state: question.state }), 0);
    }
    this.pending.set(id, { id, want, since: performance.now() });
    // Two workers, so that a star can be dragged while the other one works longer.
    (this.hosts[want in SLOW ? "slow" : "quick"] ??= this.host()).send(question);
  }
  host() {
    const host = hostOf((message) => this.hear(message));
    this.began.then(host.send, ({ message }) => this.hear({ kind: "failure", line: `${NOT_STARTED}: ${message}` }));
    return host;
  }
  close() {
    clearInterval(this.clock);
    this.listeners = [];
    Object.values(this.hosts).forEach((host) => host.end());
  }
  hear(message) {
    if (message.kind === "failure") return this.explorer?.lose(message.line);
    if (message.kind === "ready") return;
    this.pending.delete(message.id);
    this.tell(message);
  }
  // The page takes a silence for a loss.
  report() {
    for (const { id, want, since } of this.pending.values())
      this.tell({ kind: "progress", id, want, seconds: (performance.now() - since) / 1000, stage: SLOW[want] ?? "critical curves and images" });
  }
}
