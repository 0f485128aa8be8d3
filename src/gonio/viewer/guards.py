"""Access control and limits of the server: the token, the names of the server, and bounds on connections."""

from __future__ import annotations

import asyncio
import ipaddress
import re
import secrets
import socket
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

MAX_CONNECTIONS = 200  # connections that have not sent a request yet
REQUEST_SECONDS = 10.0  # limit for the headers of a request to arrive
MAX_ANSWERS, ANSWER_SECONDS = 32, 120.0  # pages being sent at once, and the limit for each: 9 kB/s
CLOSE_SECONDS = 2.0  # for the last messages to be sent
READ_BYTES = 16 << 10  # bytes per read of a socket
MAX_FRAGMENTS = 1 << 14  # per message: 4 KiB each in the largest upload; browsers send far longer ones
MAX_CONTROLS = 10_000  # pings and pongs per connection: one per 20 s for two days
FULL, TOO_LARGE, REFUSED, LATE = 1013, 1009, 1008, 1008  # WebSocket close codes


class AccessControl:
    """The conditions of access: the token, and the names of this server."""

    def __init__(self, host: str, token: str | None = None):
        self.token = token or secrets.token_urlsafe(24)
        self.names = {"localhost", host.lower()}
        if host in ("0.0.0.0", "::"):  # the server is open to the network, so the machine's name is valid, too
            self.names |= {socket.gethostname().lower(), socket.getfqdn().lower()}

    def refusal(self, headers: Headers, query: bytes, needs_origin: bool) -> str:
        """The reason for refusing a request; "" if the request is accepted."""
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return "wrong Host"
        origins = headers.getlist("origin")
        # The port may differ (in a tunnel), but the browser must have addressed the page by the same host name.
        if origins != [f"http://{hosts[0]}"] and (needs_origin or origins):
            return "wrong Origin"
        given = parse_qs(query.decode("latin-1")).get("token", [""])
        if len(given) != 1 or not secrets.compare_digest(given[0].encode(), self.token.encode()):
            return "wrong token"
        return ""

    def _is_ours(self, host: str) -> bool:
        """Whether a Host header names this machine. An address cannot be the result of DNS rebinding."""
        parts = re.fullmatch(r"(\[[0-9a-f:.]+\]|[\w.-]+)(?::\d{1,5})?", host.lower(), re.ASCII)
        if parts is None:
            return False
        name = parts[1].strip("[]")
        if name in self.names:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True


class GuardedHTTP(H11Protocol):
    """HTTP that ends connections whose request does not arrive, or whose response is not received, in time.

    If there are too many connections of either kind, the oldest is ended.
    """

    waiting: dict[GuardedHTTP, asyncio.TimerHandle]  # for requests; `Server` sets both dictionaries for each server
    answering: dict[GuardedHTTP, asyncio.TimerHandle]

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._watch(self.waiting, MAX_CONNECTIONS, REQUEST_SECONDS)

    def handle_events(self) -> None:
        super().handle_events()
        if self.transport.get_protocol() is not self:  # it is now a WebSocket
            self._rest()
        elif self.cycle is not None and self not in self.answering:
            self._rest()
            self._watch(self.answering, MAX_ANSWERS, ANSWER_SECONDS)

    def connection_lost(self, exc: Exception | None) -> None:
        self._rest()
        super().connection_lost(exc)

    def _watch(self, kind: dict[GuardedHTTP, asyncio.TimerHandle], most: int, seconds: float) -> None:
        kind[self] = self.loop.call_later(seconds, self._give_up)
        if len(kind) > most:
            next(iter(kind))._give_up()

    def _rest(self) -> None:
        for kind in (self.waiting, self.answering):
            timer = kind.pop(self, None)
            if timer is not None:
                timer.cancel()

    def _give_up(self) -> None:
        self._rest()
        self.transport.abort()


class GuardedSocket(WebSocketsSansIOProtocol):
    """A WebSocket with limits that uvicorn lacks.

    The connection ends with its session, even if the peer no longer reads, and after an invalid handshake. Frames that
    are not messages (empty fragments, pings, pongs) are limited, too, because they cost time and memory.
    """

    controls = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        # asyncio's default is 256 KiB, enough for empty frames that take a third of a second to process
        transport.max_size = READ_BYTES  # type: ignore[attr-defined]

    def connection_lost(self, exc: Exception | None) -> None:
        while not self.queue.empty():  # drop requests of a page that has disconnected
            self.queue.get_nowait()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if not self.handshake_initiated:  # uvicorn passes complete requests, so no later data can complete this one
            self.transport.abort()

    def handle_cont(self, event: Frame) -> None:
        if len(self.frames) < MAX_FRAGMENTS:
            super().handle_cont(event)
        else:
            self._refuse(TOO_LARGE, "too many fragments")

    def handle_ping(self) -> None:
        super().handle_ping()
        self._count_control()

    def handle_pong(self, event: Frame) -> None:
        super().handle_pong(event)
        self._count_control()

    def _count_control(self) -> None:
        """Count a ping or pong. Scripts on a page cannot send these; programs that monitor a connection send few."""
        self.controls += 1
        if self.controls > MAX_CONTROLS:
            self._refuse(REFUSED, "too many pings")

    def _refuse(self, code: int, reason: str) -> None:
        if self.close_sent or self.transport.is_closing():
            return
        self.frames = []
        self.conn.fail(code, reason)
        self.handle_parser_exception()

    async def run_asgi(self) -> None:
        try:
            await super().run_asgi()
        finally:
            self.loop.call_later(CLOSE_SECONDS, self.transport.abort)
