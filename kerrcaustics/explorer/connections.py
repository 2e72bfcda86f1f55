"""Connections of the explorer's server, with and without the token."""

import asyncio
import os
import warnings
from collections.abc import Callable
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

# Seconds for a page with all its files.
PATIENCE = 20.0
# Connections at a time.
MOST_STRANGERS = 128


class Strangers:
    """Connections without the token, each ended `PATIENCE` seconds after it began, however far its request is.

    New ones take the place of old ones. Clients with the token speak over a WebSocket, which does not count among them
    once it is accepted. So the number of other connections, open or half open, keeps no client out.
    """

    def __init__(self) -> None:
        """Begin with none."""
        # The oldest one first.
        self._deadlines: dict[asyncio.Transport, asyncio.TimerHandle] = {}

    def add(self, transport: asyncio.Transport) -> None:
        """Let a connection last for a while, in the place of the oldest one where there are too many."""
        if transport not in self._deadlines:
            loop = asyncio.get_running_loop()
            self._deadlines[transport] = loop.call_later(PATIENCE, self._end, transport)
        if len(self._deadlines) > MOST_STRANGERS:
            self._end(next(iter(self._deadlines)))

    def discard(self, transport: asyncio.Transport) -> None:
        """Forget a connection that has ended, or has shown the token."""
        if transport in self._deadlines:
            self._deadlines.pop(transport).cancel()

    def _end(self, transport: asyncio.Transport) -> None:
        self.discard(transport)
        transport.abort()


class Requests(H11Protocol):
    """A connection over HTTP: a stranger for as long as it lasts."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:  # type: ignore[override]
        """Count it, and set its deadline."""
        super().connection_made(cast(asyncio.Transport, transport))
        self.app_state["strangers"].add(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self.app_state["strangers"].discard(self.transport)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand it on; a request that the other protocol does not take, such as one with a body, is answered here."""
        super().handle_websocket_upgrade(event)
        if not cast(Channel, self.transport.get_protocol()).handshake_initiated:
            self.send_400_response("Invalid WebSocket request.")


class Channel(WebSocketsSansIOProtocol):
    """A connection that asks for a WebSocket: a stranger until it is accepted."""

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self.app_state["strangers"].discard(self.transport)
        super().connection_lost(exc)

    async def send(self, message: Any) -> None:
        """Send a message of the application; once it accepts, the connection may last."""
        await super().send(message)
        if message["type"] == "websocket.accept":
            self.app_state["strangers"].discard(self.transport)


def warns_once() -> Callable[[asyncio.AbstractEventLoop | None, dict[str, Any]], None]:
    """A handler of the loop's failures that warns once of each kind: strangers can cause any number of them.

    More would fill a standard error that nobody reads, and the program would wait there.
    """
    known: set[str] = set()

    def warn(_loop: asyncio.AbstractEventLoop | None, context: dict[str, Any]) -> None:
        kind = _kind(context.get("exception"))
        if kind not in known:
            known.add(kind)
            warnings.warn(f"A connection of the explorer failed: {kind}.", stacklevel=1)

    return warn


def _kind(error: BaseException | None) -> str:
    if isinstance(error, OSError) and error.errno:
        return os.strerror(error.errno)
    return "unknown" if error is None else type(error).__name__
