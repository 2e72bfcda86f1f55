// The page in a browser: one WebSocket, and the state in the address.

const FIRST_WAIT = 500;
const LONGEST_WAIT = 10000;

const START = `kerrcaustics explore --port ${location.port || 8765} --token-file FILE`;
const LASTS = `For an address that stays the same, start it with “${START}”.`;
const ENDED = "No program answers at this address: it has ended, or cannot be reached.";
const OTHER = "The token in this address is not that of the program that runs there";
// By the status of the server's reply, 0 without one: for a program whose address changes, and for one with a port and a
// token of its own.
const CLOSED = {
  0: [`${ENDED} Start it again, and open the address that it prints. ${LASTS}`, `${ENDED} Start it again as before.`],
  403: [`${OTHER}: open the address that it printed. ${LASTS}`, `${OTHER}: start it with the --token-file of before.`],
  503: Array(2).fill("The program already serves as many pages as it can: close one of them."),
};

class Connection {
  constructor() {
    this.token = encodeURIComponent(new URLSearchParams(location.search).get("token") ?? "");
    this.wait = FIRST_WAIT;
    this.listeners = [];
    this.state = stateOf(location.hash);
  }
  listen(heard) {
    this.listeners.push(heard);
  }
  send(text) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }
  remember(state) {
    history.replaceState(null, "", `${location.pathname}${location.search}#${fragmentOf(state)}`);
  }
  link() {
    return location.href;
  }
  open() {
    clearTimeout(this.timer);
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/channel?token=${this.token}`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = FIRST_WAIT;
    };
    socket.onmessage = ({ data }) => this.listeners.forEach((heard) => heard(data));
    socket.onclose = ({ reason }) => this.closed(reason);
    this.socket = socket;
    this.opened = performance.now();
  }
  // A new socket in the place of one that is silent.
  renew() {
    if (performance.now() - this.opened < LONGEST_WAIT) return;
    Object.assign(this.socket, { onmessage: null, onclose: null });
    this.socket.close();
    this.open();
  }
  async closed(reason) {
    this.lose("The connection was lost.");
    this.timer = setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(this.wait * 2, LONGEST_WAIT);
    const lines = CLOSED[await this.status()] ?? CLOSED[0];
    this.lose(reason || lines[this.isLasting ? 1 : 0]);
  }
  lose(line) {
    if (this.socket.readyState !== WebSocket.OPEN) this.explorer.lose(`${line} The page keeps trying.`);
  }
  async status() {
    try {
      return (await fetch(`/channel?token=${this.token}`, { signal: AbortSignal.timeout(LONGEST_WAIT) })).status;
    } catch {
      return 0;
    }
  }
}

const connection = new Connection();
connection.explorer = mount(document.getElementById("explorer"), connection, {
  wholePage: true,
  invites: !location.hash,
});
window.explorer = connection.explorer;
window.addEventListener("hashchange", () => window.explorer.show(stateOf(location.hash)));
window.addEventListener("online", () => connection.open());
connection.open();
