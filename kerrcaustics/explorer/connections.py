"""Connections without the token: they last for a while, and new ones take the place of old ones.

Clients with the token speak over a WebSocket, which does not count among them. So the number of other connections, open
or half open, keeps no client out.
"""

import asyncio
from typing import cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

# Seconds for a page with all its files; how many connections at a time.
PATIENCE, MOST_STRANGERS = 20.0, 128


class Stranger(H11Protocol):
    """A connection over HTTP, ended `PATIENCE` seconds after it began, however far its request has come."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:  # type: ignore[override]
        """Let it last for a while, in the place of the oldest one where there are too many."""
        super().connection_made(cast(asyncio.Transport, transport))
        self._began = self.loop.time()
        self._deadline = self.loop.call_later(PATIENCE, self._end)
        strangers = [one for one in self.connections if isinstance(one, Stranger)]
        if len(strangers) > MOST_STRANGERS:
            min(strangers, key=lambda one: one._began)._end()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand it on: a WebSocket is closed at once where its token is not the right one."""
        self._deadline.cancel()
        super().handle_websocket_upgrade(event)

    def _end(self) -> None:
        self._deadline.cancel()
        # It is lost a moment later, and must not be counted till then.
        self.connections.discard(self)
        self.transport.abort()
