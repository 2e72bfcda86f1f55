"""The page in a browser: its files, and one WebSocket, on which the newest question of each client is answered."""

import asyncio
import ipaddress
import secrets
import socket
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field
from time import monotonic

import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from kerrcaustics.explorer.answers import LONGEST_QUESTION, Question, greeting, question, refusal
from kerrcaustics.explorer.connections import Channel, Requests, Strangers, warns_once
from kerrcaustics.explorer.page_data import QUALITIES
from kerrcaustics.explorer.page_script import script
from kerrcaustics.explorer.state import PAGE
from kerrcaustics.explorer.work import FIRST, PAUSE, Work

_SCRIPT = "/explorer.js"
FILES = {
    "/": ("index.html", "text/html"),
    "/explorer.css": ("explorer.css", "text/css"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
MOST_CLIENTS = 64
# Questions a second of one client in the mean, and how many may come at once.
_RATE, _BURST = 250.0, 500.0
# Computations at a time, of all clients together; the others wait in line, one a client.
_WORKERS = 2
# Reasons to close a socket: broken rules, too many clients.
_POLICY, _LATER = 1008, 1013
_LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")


@dataclass
class _Client:
    """A page: the newest question of each kind that waits, and the number of questions that it may still ask."""

    socket: WebSocket
    waiting: dict[str, Question] = field(default_factory=dict)
    awake: asyncio.Event = field(default_factory=asyncio.Event)
    left: float = _BURST
    since: float = field(default_factory=monotonic)

    def may_ask(self) -> bool:
        """True unless a question comes too soon."""
        now = monotonic()
        self.left = min(_BURST, self.left + (now - self.since) * _RATE) - 1
        self.since = now
        return self.left >= 0

    def asks(self, question: Question) -> None:
        """Put a question in the place of an older one of its kind; views are of one kind."""
        want = question[1]
        self.waiting["view" if want in QUALITIES else want] = question
        self.awake.set()

    async def question(self) -> None:
        """Wait until there is a question."""
        while not self.waiting:
            self.awake.clear()
            await self.awake.wait()

    def newest(self) -> Question:
        """Take the next question from those that wait; views come first."""
        return self.waiting.pop("view" if "view" in self.waiting else next(iter(self.waiting)))


class Explorer:
    """The application: its pages, the rights of clients, and their turns.

    hosts: the names, with the port, under which the page may be requested; token: that its address must hold;
    lasting: True if the address is the same at every start.
    """

    def __init__(self, hosts: frozenset[str], token: str, *, lasting: bool = False) -> None:
        """Prepare the routes; computations begin with the first client."""
        self.hosts, self.token, self.lasting = hosts, token, lasting
        self.clients = 0
        self._pool = ThreadPoolExecutor(_WORKERS, "explorer")
        self._turn = asyncio.Semaphore(_WORKERS)
        files = [Route(path, self._file) for path in (*FILES, _SCRIPT)]
        channel = [WebSocketRoute("/channel", self._channel), Route("/channel", self._standing)]
        lost = {404: self._unknown, 405: self._unknown}
        self.app = Starlette(routes=[*files, *channel], lifespan=self._life, exception_handlers=lost)

    @asynccontextmanager
    async def _life(self, _app: Starlette) -> AsyncIterator[dict[str, Strangers]]:
        asyncio.get_running_loop().set_exception_handler(warns_once())
        yield {"strangers": Strangers()}
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _is_own_host(self, connection: HTTPConnection) -> bool:
        """False for another name of this host, such as a foreign page may use."""
        return connection.headers.get("host", "") in self.hosts

    def _has_token(self, connection: HTTPConnection) -> bool:
        token = connection.query_params.get("token", "").encode()
        return secrets.compare_digest(token, self.token.encode())

    def _may_enter(self, socket: WebSocket) -> bool:
        host = socket.headers.get("host")
        own = socket.headers.get("origin") in (f"http://{host}", f"https://{host}")
        return self._is_own_host(socket) and own and self._has_token(socket)

    async def _file(self, request: Request) -> Response:
        if not self._is_own_host(request):
            return PlainTextResponse("Unknown host.", 421, HEADERS)
        if request.url.path == _SCRIPT:
            return Response(script("socket"), headers=HEADERS, media_type="text/javascript")
        name, kind = FILES[request.url.path]
        return Response((PAGE / name).read_bytes(), headers=HEADERS, media_type=kind)

    async def _standing(self, request: Request) -> Response:
        """Say why the channel is closed to a page, which cannot see that from the channel itself."""
        if not self._is_own_host(request):
            return PlainTextResponse("Unknown host.", 421, HEADERS)
        if not self._has_token(request):
            return PlainTextResponse("Another token.", 403, HEADERS)
        full = self.clients >= MOST_CLIENTS
        return PlainTextResponse("Too many pages." if full else "Open.", 503 if full else 200, HEADERS)

    async def _unknown(self, _request: Request, error: Exception) -> Response:
        status = getattr(error, "status_code", 404)
        return Response((PAGE / "unknown.html").read_bytes(), status, HEADERS, "text/html")

    async def _channel(self, socket: WebSocket) -> None:
        if not self._may_enter(socket):
            await socket.close(_POLICY)
        elif self.clients >= MOST_CLIENTS:
            await socket.close(_LATER)
        else:
            await socket.accept()
            self.clients += 1
            try:
                await self._serve(_Client(socket))
            finally:
                self.clients -= 1

    async def _serve(self, client: _Client) -> None:
        """Read questions while answers are made; those of a page that is gone are dropped."""
        await client.socket.send_bytes(greeting(lasting=self.lasting).encoded())
        answering = asyncio.create_task(self._answers(client))
        try:
            await self._questions(client)
        except WebSocketDisconnect:
            pass
        finally:
            answering.cancel()
            with suppress(asyncio.CancelledError, Exception):
                await answering

    async def _questions(self, client: _Client) -> None:
        while True:
            message = await client.socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if not client.may_ask():
                await client.socket.close(_POLICY, "Too many questions.")
                return
            try:
                client.asks(question(message.get("text") or ""))
            except ValueError as error:
                await client.socket.send_bytes(refusal(error).encoded())

    async def _answers(self, client: _Client) -> None:
        while True:
            await client.question()
            work = Work()
            progress = asyncio.create_task(_reports(client, work))
            try:
                async with self._turn:
                    # Taken when its turn has come: by then a newer one may be in its place.
                    loop = asyncio.get_running_loop()
                    _, data = await loop.run_in_executor(self._pool, work.answered, client.newest())
            finally:
                progress.cancel()
            await client.socket.send_bytes(data)


async def _reports(client: _Client, work: Work) -> None:
    """Tell the page of a computation that lasts."""
    await asyncio.sleep(FIRST)
    while True:
        await client.socket.send_bytes(work.progress().encoded())
        await asyncio.sleep(PAUSE)


class _Server(uvicorn.Server):
    """Leaves Ctrl-C to the command line, which ends at once."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def is_loopback(host: str) -> bool:
    """True for an address that this machine alone can reach."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def listening(host: str, port: int) -> socket.socket:
    """A socket at a port, or at any free one for 0; an OSError where there is none."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    opened = socket.socket(family, socket.SOCK_STREAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        opened.bind((host, port))
        # Connections wait from now on: the address is printed before the server stands.
        opened.listen(MOST_CLIENTS)
    except OSError:
        opened.close()
        raise
    return opened


def own_names(host: str, port: int) -> frozenset[str]:
    """Names of this server in browsers: for a public address, that and the machine's name."""
    names = {*_LOCAL_NAMES, host}
    if not is_loopback(host):
        names |= {socket.gethostname(), socket.getfqdn(), *_addresses()}
    return frozenset(f"[{name}]:{port}" if ":" in name else f"{name}:{port}" for name in names)


def _addresses() -> set[str]:
    with suppress(OSError):
        return {str(entry[4][0]) for entry in socket.getaddrinfo(socket.gethostname(), None)}
    return set()


def serve(opened: socket.socket, host: str, token: str, *, lasting: bool = False) -> None:
    """Serve the explorer on a socket until the process ends; lasting: at the same address at every start."""
    server(host, opened.getsockname()[1], token, lasting=lasting).run(sockets=[opened])


def server(host: str, port: int, token: str, *, lasting: bool = False) -> uvicorn.Server:
    """The server of an address, which runs on a socket of its own; lasting: the same address at every start."""
    config = uvicorn.Config(
        Explorer(own_names(host, port), token, lasting=lasting).app,
        log_level="critical",
        access_log=False,
        backlog=MOST_CLIENTS,
        http=Requests,
        ws=Channel,
        ws_max_size=2 * LONGEST_QUESTION,
        ws_max_queue=16,
        ws_per_message_deflate=False,
        server_header=False,
        proxy_headers=False,
    )
    return _Server(config)
