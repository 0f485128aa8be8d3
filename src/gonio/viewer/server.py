"""`gonio view`: the server of the page, on this machine's loopback address, with the live reference.

The server has two routes and serves no files: `/` returns the page, and `/ws` is the socket described in
docs/viewer.md. Access is restricted as follows:

- The address contains a random token, without which no request is answered.
- `Host` must be an address or a name of this machine. A name that an attacker maps to this machine (DNS rebinding) is
  refused.
- `Origin` must be this server itself, so that pages from elsewhere can neither read nor control it.
- The page's Content-Security-Policy allows only the page's own script, and connections only to its socket.
- The sizes of requests, messages and uploads and the numbers of connections, sessions and pending frames (one) are
  limited.

A single thread renders, alternating between sessions in short passes, so that a new scene does not wait long for an
older one.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import html
import ipaddress
import json
import re
import signal
import socket
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from ..bridge import engine
from ..errors import GonioError, InputError, MachineError
from . import guards, messages, page
from .guards import AccessControl
from .session import Renderer, Session
from .stage import Stage
from .watch import Watch

LOOPBACK = "127.0.0.1"
MAX_SESSIONS = 8  # each holds a scene and a picture in memory
# Time limit for the acknowledgment of a frame: a page in a hidden tab draws nothing, and may never be shown again. The
# same limit applies to the first request: a page that shows a single term, which the reference does not support,
# requests nothing.
STALL_SECONDS = 600.0
FULL_SECONDS = 1.0  # delay before a new page is refused because all sessions are in use
MAX_WAITING = 200  # largest number of new pages that wait for this delay
PATIENCE_SECONDS = 5.0  # time limit for acknowledging a frame while another page needs the session

HEADERS = {
    "Cache-Control": "no-store",
    "Connection": "close",  # one page is one request; a persistent connection would need a limit
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


class Application:
    """The page and its socket, for one stage.

    what    the stage to show
    access  conditions of access
    device  device of the reference: "cpu", "cuda" or "auto"
    """

    def __init__(self, what: Stage, access: AccessControl, device: str = "cpu"):
        self.access = access
        self.renderer = Renderer(what, device)
        self.sessions: list[Session] = []
        self._waiting = 0
        self.fault: GonioError | None = None  # error in the user's files since the current stage
        self.watch = Watch(what.code, self.renew, self.complain) if what.code else None
        self._data = self._written(what, 0)
        self._html = page.html(self._data, policy=False)
        self.asgi = Starlette(
            routes=[Route("/", self.show), WebSocketRoute("/ws", self.talk)],
            exception_handlers={404: _nothing_here, 405: _nothing_here},
        )

    def _written(self, what: Stage, revision: int) -> page.PageData:
        return page.page_data(what, f"/ws?token={self.access.token}", revision)

    def renew(self, what: Stage) -> None:
        """Show another stage on every page. Raises InputError if one of its materials cannot be written as a shader."""
        data = self._written(what, self.renderer.revision + 1)
        self.renderer.renew(what)
        self._data, self.fault = data, None
        self._tell(messages.stage(data))
        self._html = page.html(data, policy=False)

    def complain(self, fault: GonioError) -> None:
        """Show an error in the user's file on every page, on top of the last valid picture."""
        self.fault = fault
        self._tell(messages.failure(fault, "fault"))

    def _tell(self, message: str) -> None:
        for session in list(self.sessions):
            session.send_from_thread(message)

    async def show(self, request: Request) -> Response:
        """The HTML of the page."""
        refusal = self.access.refusal(request.headers, request.scope["query_string"], needs_origin=False)
        if refusal:
            return PlainTextResponse(f"{refusal}: open the address that gonio view printed\n", 403, HEADERS)
        host = request.headers["host"]
        # Policies do not support IPv6 addresses; 'self' includes the socket there, in browsers with CSP 3.
        socket_address = "'self'" if host.startswith("[") else f"ws://{host}"
        policy = page.content_policy(socket_address) + "; frame-ancestors 'none'"
        return HTMLResponse(self._html, headers={**HEADERS, "Content-Security-Policy": policy})

    async def talk(self, websocket: WebSocket) -> None:
        """Run a session, from its first message to its end."""
        if self.access.refusal(websocket.headers, websocket.scope["query_string"], needs_origin=True):
            await websocket.close(guards.REFUSED)  # before it is accepted: the handshake is answered with 403
            return
        if not self._make_room():
            if self._waiting < MAX_WAITING:  # slows down pages that reconnect repeatedly
                self._waiting += 1
                try:
                    await asyncio.sleep(FULL_SECONDS)
                finally:
                    self._waiting -= 1
            await websocket.accept()
            await websocket.close(guards.FULL, "too many pages are open; close one")
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
        """Whether another session is possible. A session that requests or receives nothing is ended if necessary, the
        oldest first."""
        if len(self.sessions) < MAX_SESSIONS:
            return True
        idle = next((session for session in self.sessions if session.idle_for() > PATIENCE_SECONDS), None)
        if idle is None:
            return False
        self.sessions.remove(idle)
        idle.end(guards.LATE, "made room for another page")
        return True


async def _nothing_here(request: Request, error: Exception) -> Response:
    return PlainTextResponse("nothing here\n", 404, HEADERS)


class Server(uvicorn.Server):
    """uvicorn with the limits of `guards`. Once it is running, it prints its address and opens the browser."""

    def __init__(self, application: Application, host: str, port: int, browser: bool = False, quiet: bool = False):
        self.application, self.browser, self.quiet, self.as_json = application, browser, quiet, False
        self._redirect: Path | None = None
        guarded = type("Guarded", (guards.GuardedHTTP,), {"waiting": {}, "answering": {}})
        self.listener = _listen(host, port)
        config = uvicorn.Config(
            application.asgi,
            http=guarded,
            ws=guards.GuardedSocket,
            ws_max_size=messages.UPLOAD_BYTES,
            ws_per_message_deflate=False,
            ws_ping_interval=20.0,
            ws_ping_timeout=20.0,
            h11_max_incomplete_event_size=16 << 10,
            limit_concurrency=guards.MAX_CONNECTIONS + 64,  # those with a request; more are answered with 503
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
        """The address on which the server listens; a host name is resolved."""
        return str(self.listener.getsockname()[0])

    @property
    def port(self) -> int:
        return int(self.listener.getsockname()[1])

    @property
    def url(self) -> str:
        host = {"0.0.0.0": LOOPBACK, "::": "::1"}.get(self.address, self.address)
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/?token={self.application.access.token}"

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.application.watch:
            self.application.watch.start()
        if not self.quiet:
            print(json.dumps({"url": self.url}) if self.as_json else f"{self.url}\nPress Ctrl-C to stop", flush=True)
        if self.browser:
            # some browsers block the caller until they are closed
            self._redirect = _redirect_file(self.url)
            threading.Thread(target=_open, args=(self._redirect.as_uri(),), daemon=True).start()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        for session in list(self.application.sessions):
            session.end(1001, "the server ends")
        if self._redirect is not None:
            self._redirect.unlink(missing_ok=True)
        await super().shutdown(sockets)

    def serve_until_interrupted(self) -> None:
        """Serve until Ctrl-C or SIGTERM, then close everything and return."""
        try:
            with contextlib.suppress(KeyboardInterrupt):
                self.run(sockets=[self.listener])
        finally:
            self.listener.close()
            # Wait for the thread, because ending it during a kernel causes a crash; a second Ctrl-C must not interrupt
            # the wait.
            with _ignoring_interrupts():
                if self.application.watch:
                    self.application.watch.stop()
                self.application.renderer.stop()


@contextlib.contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Ignore Ctrl-C in the `with` block. Only the main thread receives Ctrl-C."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _listen(host: str, port: int) -> socket.socket:
    """A listening socket. Raises MachineError if the port cannot be opened."""
    if not re.fullmatch(r"[\w.:-]+", host, re.ASCII):  # "" would mean every address
        raise InputError(f"'{host}' is not an address", "--host", "give one of this machine, such as 127.0.0.1 or ::1")
    listener = None
    try:
        listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(guards.MAX_CONNECTIONS)
    except (OSError, UnicodeError) as error:  # UnicodeError: a part of the name is too long
        if listener is not None:
            listener.close()
        in_use = getattr(error, "errno", None) == errno.EADDRINUSE
        hint = "--port 0 chooses a free one" if in_use else "give an address of this machine, and a port that is yours"
        text = getattr(error, "strerror", None) or str(error)
        raise MachineError(f"cannot listen: {text}", f"--host {host} --port {port}", hint) from None
    return listener


def _redirect_file(url: str) -> Path:
    """A file that redirects a browser to the page and can be read only by this user. The token must not appear on a
    command line, which every user of the machine can read."""
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

    host     address to listen on; with an address other than a loopback address, the page is open to the network, and a
             warning is printed
    port     port to listen on; 0 selects any free port
    browser  whether to open the page in a browser
    device   device of the reference: "cpu", "cuda" or "auto"
    as_json  whether to print the address as {"url": ...}
    Raises MachineError if the port is in use or the device is missing, InputError if a model cannot be shown.
    """
    if not 0 <= port < 65536:
        raise InputError(f"port {port}", "--port", "give 0 to 65535")
    engine.variant_for(device)  # raises for a missing GPU now, not when the first page connects
    application = Application(what, AccessControl(host), device)
    server = Server(application, host, port, browser)
    server.as_json = as_json
    if not ipaddress.ip_address(server.address).is_loopback:
        warning = "anyone who knows the address below has access, and the connection is not encrypted"
        print(f"listening on {server.address}: {warning}", file=sys.stderr)
    server.serve_until_interrupted()
