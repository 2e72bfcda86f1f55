"""Connections to the explorer without its token: each is answered or ended, and none keeps the owner out."""

import errno
import http.client
import resource
import signal
import socket as sockets
import threading
import time
from urllib.parse import urlsplit

import pytest
from exploring import needs_server, opened, read, served
from marks import few


@pytest.fixture(scope="module")
def address():
    needs_server()
    with served() as (address, _):
        yield urlsplit(address)


@pytest.mark.parametrize(
    "wrong",
    [
        {"token": "guess"},
        {"token": ""},
        {"origin": "http://elsewhere"},
        {"origin": None},
        {"origin": "http://[::1"},
        {"origin": "null"},
    ],
)
def test_strangers_are_not_let_in(address, wrong):
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus, match="403"):
        opened(address, **wrong)


def is_ended(socket):
    """Whether the other side ends a connection within half a minute."""
    socket.settimeout(30)
    try:
        while socket.recv(4096):
            pass
    except ConnectionResetError:
        pass
    except TimeoutError:
        return False
    return True


UPGRADE = b"GET /channel HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
KEY = b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
# Requests for a WebSocket that are none, or come without the token.
NO_UPGRADES = {
    "no key": UPGRADE,
    "body": UPGRADE + KEY + b"Content-Length: 5\r\n",
    "chunked": UPGRADE + KEY + b"Transfer-Encoding: chunked\r\n",
    "post": UPGRADE.replace(b"GET", b"POST") + KEY,
    "long line": UPGRADE + KEY + b"X-Long: " + b"x" * 9000 + b"\r\n",
    "many headers": UPGRADE + KEY + b"X-Many: x\r\n" * 200,
    "no token": UPGRADE + KEY,
}
HEADS = {
    "nothing": b"",
    "half a head": b"GET / HTTP/1.1\r\nHost: x\r\n",
    "no body": b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\n",
    **{f"upgrade, {name}": head + b"\r\n" for name, head in NO_UPGRADES.items()},
}


@pytest.mark.parametrize("head", NO_UPGRADES.values(), ids=NO_UPGRADES)
def test_upgrades_that_are_none_are_answered(address, head):
    with sockets.create_connection((address.hostname, address.port), timeout=10) as one:
        one.sendall(head.replace(b" x", b" " + address.netloc.encode()) + b"\r\n")
        assert 400 <= int(one.recv(4096).split()[1]) < 500
        assert is_ended(one)


@pytest.mark.parametrize("head", few(HEADS.values(), ("upgrade, body",), HEADS))
def test_connections_without_the_token_keep_nobody_out(address, head):
    """Heads and bodies that do not end, upgrades that are none: the owner gets page and channel, and old ones end."""
    strangers = []
    try:
        for _ in range(300):
            strangers.append(sockets.create_connection((address.hostname, address.port)))
            strangers[-1].sendall(head.replace(b" x", b" " + address.netloc.encode()))
        connection = http.client.HTTPConnection(address.hostname, address.port, timeout=30)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        with opened(address) as socket:
            assert read(socket.recv(timeout=30))[0]["kind"] == "greeting"
        assert is_ended(strangers[0])
    finally:
        for one in strangers:
            one.close()


def test_connections_without_the_token_last_for_a_while(monkeypatch):
    needs_server()
    from kerrcaustics.explorer.server import listening, server

    monkeypatch.setattr("kerrcaustics.explorer.connections.PATIENCE", 0.3)
    opened_at = listening("127.0.0.1", 0)
    port = opened_at.getsockname()[1]
    running = server("127.0.0.1", port, "token")
    thread = threading.Thread(target=lambda: running.run(sockets=[opened_at]), daemon=True)
    thread.start()
    try:
        one = sockets.create_connection(("127.0.0.1", port), timeout=30)
        one.sendall(b"GET / HTTP/1.1\r\n")
        assert is_ended(one)
        # Whoever has shown it stays.
        with opened(urlsplit(f"http://127.0.0.1:{port}/?token=token")) as socket:
            socket.recv(timeout=30)
            time.sleep(0.6)
            socket.send("garbage")
            assert read(socket.recv(timeout=30))[0]["kind"] == "refusal"
    finally:
        running.should_exit = True
        thread.join(30)


def test_failures_of_one_kind_are_one_warning():
    needs_server()
    from kerrcaustics.explorer.connections import warns_once

    handler = warns_once()
    with pytest.warns(UserWarning) as caught:
        for number in range(30):
            handler(None, {"message": "out of resource", "exception": OSError(errno.EMFILE, f"number {number}")})
            handler(None, {"message": f"callback {number}", "exception": KeyError(number)})
            handler(None, {"message": "no exception"})
    assert [str(one.message).split(": ")[1] for one in caught] == ["Too many open files.", "KeyError.", "unknown."]


@pytest.mark.slow
def test_a_flood_of_connections_writes_little_and_ctrl_c_ends_the_program():
    """All descriptors are taken and nobody reads standard error; afterwards the page is there."""
    needs_server()
    few = (64, resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    with served(before=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, few)) as (address, process):
        place = urlsplit(address)
        strangers = [sockets.create_connection((place.hostname, place.port)) for _ in range(90)]
        time.sleep(0.5)
        for one in strangers:
            one.close()
        connection = http.client.HTTPConnection(place.hostname, place.port, timeout=30)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=5) == 0
        words = process.stderr.read().splitlines()
    assert words == [
        "kerrcaustics: Warning: A connection of the explorer failed: Too many open files.",
        "kerrcaustics: Interrupted: the explorer has ended.",
    ]
