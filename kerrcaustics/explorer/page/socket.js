// The page in a browser: one WebSocket, and the state in the address.

const token = new URLSearchParams(location.search).get("token") ?? "";
const listeners = [];
let socket = null;
let explorer = null;

const channel = {
  state: stateOf(location.hash),
  listen: (heard) => listeners.push(heard),
  send: (text) => socket?.readyState === WebSocket.OPEN && socket.send(text),
  remember: (state) => history.replaceState(null, "", `${location.pathname}${location.search}#${fragmentOf(state)}`),
  link: () => location.href,
};

function connect(wait) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/channel?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  let opened = false;
  socket.onopen = () => {
    opened = true;
    wait = 500;
  };
  socket.onmessage = (event) => listeners.forEach((heard) => heard(event.data));
  socket.onclose = (event) => {
    explorer.lost(
      opened
        ? event.reason || "The program has ended, or cannot be reached."
        : "No connection: the program has ended, or the token in the address is not its own.",
    );
    setTimeout(connect, wait, Math.min(wait * 2, 10000));
  };
}

explorer = mount(document.getElementById("explorer"), channel, { wholePage: true });
window.explorer = explorer;
window.addEventListener("hashchange", () => explorer.show(stateOf(location.hash)));
connect(500);
