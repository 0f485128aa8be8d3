"""`gonio view`: the page on this machine's loopback, and the live reference behind it.

Two routes and no files: `/` gives the page, `/ws` is the socket of docs/viewer.md. Who may speak to it:

- The address holds a random token; without it nothing is answered.
- `Host` must be an address or a name of this machine: a name that an attacker points here (DNS rebinding) is refused.
- `Origin` must be this server itself, so a page elsewhere can neither read nor drive it.
- The page's Content-Security-Policy lets it run its own script only, and reach nothing but its socket.
- Sizes are bounded: requests, messages, uploads, connections, sessions, and what waits to be sent (one frame).

One thread renders. Sessions take turns of one short pass, so that a newer scene never waits long for an older one.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import html
import ipaddress
import json
import re
import secrets
import signal
import socket
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import parse_qs

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from ..bridge import engine
from ..errors import GonioError, InputError, MachineError
from . import messages, page
from .session import Renderer, Session
from .stage import Stage
from .watch import Watch

LOOPBACK = "127.0.0.1"
MOST_SESSIONS = 8  # each holds a scene and a picture in memory
MOST_CONNECTIONS = 200  # that have not asked for anything yet
REQUEST_SECONDS = 10.0  # for a request's headers to arrive
MOST_ANSWERS, ANSWER_SECONDS = 32, 120.0  # pages that are on their way at once, and how long: 9 kB/s
# For a frame to be taken: a page in a hidden tab draws nothing, and need not come back for it. And for a first wish: a
# page that shows what the reference cannot, one term alone, wants nothing of it.
STALL_SECONDS = 600.0
FULL_SECONDS = 1.0  # after which a newcomer is told that all places are taken
MOST_WAITING = 200  # newcomers that wait so long
PATIENCE_SECONDS = 5.0  # the same where another page wants the place
CLOSE_SECONDS = 2.0  # for the last words to go out
READ_BYTES = 16 << 10  # of a socket at once
MOST_FRAGMENTS = 1 << 14  # of one message: 4 KiB each in the largest upload; browsers send far longer ones
MOST_CONTROLS = 10_000  # pings and pongs of a connection: one in 20 s for two days
FULL, TOO_LARGE, REFUSED, LATE = 1013, 1009, 1008, 1008  # WebSocket close codes

HEADERS = {
    "Cache-Control": "no-store",
    "Connection": "close",  # one page is one request; a connection that lingered would have to be watched
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


class Door:
    """Who may come in: the token, and the names under which this server is spoken to."""

    def __init__(self, host: str, token: str | None = None):
        self.token = token or secrets.token_urlsafe(24)
        self.names = {"localhost", host.lower()}
        if host in ("0.0.0.0", "::"):  # open to the network by the user's own wish: its name counts too
            self.names |= {socket.gethostname().lower(), socket.getfqdn().lower()}

    def refusal(self, headers: Headers, query: bytes, needs_origin: bool) -> str:
        """Why a request is refused; "" where it is not."""
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return "wrong Host"
        origins = headers.getlist("origin")
        # The port may differ from ours (a tunnel), but the browser must have spoken to the page under the same name.
        if origins != [f"http://{hosts[0]}"] and (needs_origin or origins):
            return "wrong Origin"
        given = parse_qs(query.decode("latin-1")).get("token", [""])
        if len(given) != 1 or not secrets.compare_digest(given[0].encode(), self.token.encode()):
            return "wrong token"
        return ""

    def _is_ours(self, host: str) -> bool:
        """Whether a Host header names this machine. An address is never the work of a rebound name."""
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


class Application:
    """The page and its socket, for one stage.

    what    what is shown
    door    who may come in
    device  of the reference: "cpu", "cuda" or "auto"
    """

    def __init__(self, what: Stage, door: Door, device: str = "cpu"):
        self.door = door
        self.renderer = Renderer(what, device)
        self.sessions: list[Session] = []
        self._waiting = 0
        self.fault: GonioError | None = None  # of the user's files, since the stage that is shown
        self.watch = Watch(what.code, self.renew, self.complain) if what.code else None
        self._data = self._written(what, 0)
        self._html = page.html(self._data, policy=False)
        self.asgi = Starlette(
            routes=[Route("/", self.show), WebSocketRoute("/ws", self.talk)],
            exception_handlers={404: _nothing_here, 405: _nothing_here},
        )

    def _written(self, what: Stage, revision: int) -> page.PageData:
        return page.page_data(what, f"/ws?token={self.door.token}", revision)

    def renew(self, what: Stage) -> None:
        """Show another stage on every page; raises what its materials raise while they are written as shaders."""
        data = self._written(what, self.renderer.revision + 1)
        self.renderer.renew(what)
        self._data, self.fault = data, None
        self._tell(messages.stage(data))
        self._html = page.html(data, policy=False)

    def complain(self, fault: GonioError) -> None:
        """Say on every page, over the last good picture, what is wrong with the user's file."""
        self.fault = fault
        self._tell(messages.failure(fault, "fault"))

    def _tell(self, message: str) -> None:
        for session in list(self.sessions):
            session.send_from_thread(message)

    async def show(self, request: Request) -> Response:
        """The page."""
        refusal = self.door.refusal(request.headers, request.scope["query_string"], needs_origin=False)
        if refusal:
            return PlainTextResponse(f"{refusal}: open the address that gonio view printed\n", 403, HEADERS)
        host = request.headers["host"]
        # A policy knows no IPv6 addresses; 'self' is the socket there, for browsers of CSP 3.
        socket_address = "'self'" if host.startswith("[") else f"ws://{host}"
        policy = page.content_policy(socket_address) + "; frame-ancestors 'none'"
        return HTMLResponse(self._html, headers={**HEADERS, "Content-Security-Policy": policy})

    async def talk(self, websocket: WebSocket) -> None:
        """A session: from its first message to its end."""
        if self.door.refusal(websocket.headers, websocket.scope["query_string"], needs_origin=True):
            await websocket.close(REFUSED)  # before it is accepted: the handshake is answered with 403
            return
        if not self._make_room():
            if self._waiting < MOST_WAITING:  # who comes again and again comes seldom
                self._waiting += 1
                try:
                    await asyncio.sleep(FULL_SECONDS)
                finally:
                    self._waiting -= 1
            await websocket.accept()
            await websocket.close(FULL, "too many pages are open; close one")
            return
        await websocket.accept()
        session = Session(websocket, self.renderer)
        self.sessions.append(session)
        if websocket.query_params.get("revision", "0") != str(self.renderer.revision):
            session.send(messages.stage(self._data))
        if self.fault:
            session.send(messages.failure(self.fault, "fault"))
        try:
            await session.run(STALL_SECONDS)
        finally:
            if session in self.sessions:
                self.sessions.remove(session)
            self.renderer.forget(session)

    def _make_room(self) -> bool:
        """Whether one more session fits; those that asked for nothing or take nothing give way, the oldest first."""
        if len(self.sessions) < MOST_SESSIONS:
            return True
        idle = next((session for session in self.sessions if session.idle_for() > PATIENCE_SECONDS), None)
        if idle is None:
            return False
        self.sessions.remove(idle)
        idle.end(LATE, "made room for another page")
        return True


async def _nothing_here(request: Request, error: Exception) -> Response:
    return PlainTextResponse("nothing here\n", 404, HEADERS)


class _Guarded(H11Protocol):
    """HTTP that ends a connection whose request does not come, or whose answer is not taken.

    Where there are too many of one kind, the oldest of it is ended.
    """

    waiting: dict[_Guarded, asyncio.TimerHandle]  # for requests; these two are set by `Server`, one pair a server
    answering: dict[_Guarded, asyncio.TimerHandle]

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._watch(self.waiting, MOST_CONNECTIONS, REQUEST_SECONDS)

    def handle_events(self) -> None:
        super().handle_events()
        if self.transport.get_protocol() is not self:  # a WebSocket now
            self._rest()
        elif self.cycle is not None and self not in self.answering:
            self._rest()
            self._watch(self.answering, MOST_ANSWERS, ANSWER_SECONDS)

    def connection_lost(self, exc: Exception | None) -> None:
        self._rest()
        super().connection_lost(exc)

    def _watch(self, kind: dict[_Guarded, asyncio.TimerHandle], most: int, seconds: float) -> None:
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


class _Socket(WebSocketsSansIOProtocol):
    """A WebSocket that bounds what uvicorn does not.

    Its connection ends with its session, though the other side takes nothing any more, and with a handshake that
    makes no sense. Frames that are no message cost time and memory too: empty fragments, pings, pongs.
    """

    controls = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        # asyncio's own is 256 KiB: a third of a second of empty frames
        transport.max_size = READ_BYTES  # type: ignore[attr-defined]

    def connection_lost(self, exc: Exception | None) -> None:
        while not self.queue.empty():  # what a page had asked for that is gone
            self.queue.get_nowait()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if not self.handshake_initiated:  # uvicorn hands the whole request over: nothing more would come of it
            self.transport.abort()

    def handle_cont(self, event: Frame) -> None:
        if len(self.frames) < MOST_FRAGMENTS:
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
        """A script on a page can send no pings; a program that watches its connection sends one in some seconds."""
        self.controls += 1
        if self.controls > MOST_CONTROLS:
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


class Server(uvicorn.Server):
    """uvicorn with the guards above, which says where it is reached and opens the browser once it is."""

    def __init__(self, application: Application, host: str, port: int, browser: bool = False, quiet: bool = False):
        self.application, self.browser, self.quiet, self.as_json = application, browser, quiet, False
        self._redirect: Path | None = None
        guarded = type("Guarded", (_Guarded,), {"waiting": {}, "answering": {}})
        self.listener = _listen(host, port)
        config = uvicorn.Config(
            application.asgi,
            http=guarded,
            ws=_Socket,
            ws_max_size=messages.UPLOAD_BYTES,
            ws_per_message_deflate=False,
            ws_ping_interval=20.0,
            ws_ping_timeout=20.0,
            h11_max_incomplete_event_size=16 << 10,
            limit_concurrency=MOST_CONNECTIONS + 64,  # what has asked for something; refused with 503 beyond
            timeout_keep_alive=5,
            timeout_graceful_shutdown=1,
            lifespan="off",
            log_level="critical",
            access_log=False,
            server_header=False,
            proxy_headers=False,
        )
        super().__init__(config)

    @property
    def address(self) -> str:
        """Where it listens: what the host, which may be a name, came to."""
        return str(self.listener.getsockname()[0])

    @property
    def port(self) -> int:
        return int(self.listener.getsockname()[1])

    @property
    def url(self) -> str:
        host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(self.address, self.address)
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/?token={self.application.door.token}"

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.application.watch:
            self.application.watch.start()
        if not self.quiet:
            print(json.dumps({"url": self.url}) if self.as_json else f"{self.url}\nCtrl-C ends it", flush=True)
        if self.browser:
            # some browsers hold up whoever opens them until they are closed
            self._redirect = _redirect_file(self.url)
            threading.Thread(target=_open, args=(self._redirect.as_uri(),), daemon=True).start()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        for session in list(self.application.sessions):
            session.end(1001, "the server ends")
        if self._redirect is not None:
            self._redirect.unlink(missing_ok=True)
        await super().shutdown(sockets)

    def serve_until_interrupted(self) -> None:
        """Serve until Ctrl-C or SIGTERM; returns then, with everything closed."""
        try:
            with contextlib.suppress(KeyboardInterrupt):
                self.run(sockets=[self.listener])
        finally:
            self.listener.close()
            # The thread is waited for: to end amid a kernel is a crash. A second Ctrl-C makes that no faster.
            with _deaf():
                if self.application.watch:
                    self.application.watch.stop()
                self.application.renderer.stop()


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """No Ctrl-C meanwhile; only the main thread hears one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _listen(host: str, port: int) -> socket.socket:
    """A socket that listens; MachineError where it cannot."""
    if not re.fullmatch(r"[\w.:-]+", host, re.ASCII):  # "" would be every address
        raise InputError(f"'{host}' is no address", "--host", "give one of this machine, such as 127.0.0.1 or ::1")
    listener = None
    try:
        listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(MOST_CONNECTIONS)
    except (OSError, UnicodeError) as error:  # UnicodeError: a part of the name is too long
        if listener is not None:
            listener.close()
        taken = getattr(error, "errno", None) == errno.EADDRINUSE
        hint = "--port 0 finds a free one" if taken else "give an address of this machine, and a port that is yours"
        text = getattr(error, "strerror", None) or str(error)
        raise MachineError(f"cannot listen: {text}", f"--host {host} --port {port}", hint) from None
    return listener


def _redirect_file(url: str) -> Path:
    """A file that only this user may read, and that sends a browser on to the page: every user of a machine may read
    what stands in a command line, and the token would."""
    handle, name = tempfile.mkstemp(prefix="gonio-", suffix=".html")  # with mode 0600
    with open(handle, "w", encoding="utf-8") as file:
        way = f'<meta http-equiv="refresh" content="0; url={html.escape(url)}">'
        file.write(f"<!doctype html>{way}<title>Gonio</title>")
    return Path(name)


def _open(url: str) -> None:
    with contextlib.suppress(webbrowser.Error):
        webbrowser.open(url)


def serve(
    what: Stage,
    host: str = LOOPBACK,
    port: int = 0,
    browser: bool = True,
    device: str = "cpu",
    as_json: bool = False,
) -> None:
    """Show a stage until Ctrl-C.

    host     where to listen; anything but a loopback address opens it to the network, and a line says so
    port     0 takes any that is free
    browser  open the page there
    as_json  print the address as {"url": ...}
    Raises MachineError where the port is taken or the device missing, InputError where a model cannot be shown.
    """
    if not 0 <= port < 65536:
        raise InputError(f"port {port}", "--port", "give 0 to 65535")
    engine.variant_for(device)  # complains about a missing GPU now, not when the first page asks
    application = Application(what, Door(host), device)
    server = Server(application, host, port, browser)
    server.as_json = as_json
    if not ipaddress.ip_address(server.address).is_loopback:
        warning = "whoever knows the address below can use it, and it is not encrypted"
        print(f"listening on {server.address}: {warning}", file=sys.stderr)
    server.serve_until_interrupted()
