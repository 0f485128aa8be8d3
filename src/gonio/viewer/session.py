"""The session of a connected page, and the thread that renders for all pages."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import os
import threading
import time
from pathlib import Path

from starlette.websockets import WebSocket, WebSocketDisconnect

from .._version import __version__
from ..bridge import engine
from ..errors import GonioError, InputError
from ..owner import COMPUTING, settle
from . import messages, page
from .reference import Pixels, Reference
from .stage import Stage

PICTURES = 2  # environments stored per session: the current one and the next one
HIDDEN_SECONDS = 1.0  # time without an acknowledged frame after which a page counts as hidden, and rendering pauses
MAX_SPARE = 4  # references stored for later pages
MAX_WISHES = 16  # pending shaders per session
RATE = 250.0  # messages per second read from a page, which sends one per drawn picture and one per received frame
SHARE = 0.1  # fraction of the server thread's time for reading one page's messages
NONSENSE_SECONDS = 0.005  # time of the server's thread charged for an invalid message, which pages never send
BURST_SECONDS = 0.5  # credit of a page that has sent no messages: 125 messages at once
GIVE_WAY_SECONDS = 5e-4  # pause after each pass, so that other threads can acquire the lock, which is not fair
MAX_WAITING = 64  # messages queued for a page that does not read them: answers to its messages, and one frame


class Session:
    """The session of a connected page: its latest request, and the frame in transit."""

    def __init__(self, websocket: WebSocket, renderer: Renderer):
        self.websocket, self.renderer = websocket, renderer
        self.loop = asyncio.get_running_loop()
        self.asked = False  # whether the page has sent a valid request
        self.sent = self.acknowledged = 0  # numbers of frames
        self.stalled_since: float | None = None
        self._outbox: asyncio.Queue[str | bytes] = asyncio.Queue()
        self._ended = asyncio.Event()
        self._upload: messages.Upload | None = None
        self._reason = (1000, "")
        self._due = 0.0  # when the next message may be read
        # owned by the renderer, under its lock
        self.scene: messages.Scene | None = None
        self.pictures: dict[str, Pixels] = {}
        self.reference: Reference | None = None
        self.shown_samples = 0
        self.spent = 0.0  # seconds of the renderer's thread
        self.started = 0.0  # time at which this picture was started

    # ------------------------------------------------------------------ in the server's thread

    async def run(self, stall_seconds: float) -> None:
        """Exchange messages until one side ends the session.

        stall_seconds  time limit for the first request, and for the acknowledgment of a frame
        """
        work = (self._read(), self._write(), self._watch(stall_seconds), self._ended.wait())
        tasks = [asyncio.create_task(coroutine) for coroutine in work]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect, asyncio.TimeoutError):
                await asyncio.wait_for(self.websocket.close(*self._reason), 1.0)

    def end(self, code: int, reason: str) -> None:
        """Close the connection from the server's side, with a WebSocket close code and its reason."""
        self._reason = (code, reason)
        self._ended.set()

    def idle_for(self) -> float:
        """Seconds for which a frame has been unacknowledged; infinite if the page has requested nothing."""
        since = self.stalled_since
        return math.inf if not self.asked else 0.0 if since is None else time.monotonic() - since

    async def _read(self) -> None:
        while True:
            received = await self.websocket.receive()
            if received["type"] == "websocket.disconnect":
                return
            began, more = time.thread_time(), 0.0
            wish = None
            try:
                if received.get("text") is not None:
                    message = messages.parse(received["text"])
                    wish = message.id if isinstance(message, messages.Wish) else None
                    self._take(message)
                elif received.get("bytes") is not None:
                    await self._take_upload(received["bytes"])
            except GonioError as error:
                self.send(messages.failure(error, wish=wish))
                more = NONSENSE_SECONDS
            await self._pace(time.thread_time() - began + more)

    async def _pace(self, took: float) -> None:
        """Delay messages that arrive faster than RATE or use more than the fraction SHARE of this thread's time.

        took  CPU seconds of the last message
        """
        now = self.loop.time()
        self._due = max(self._due, now - BURST_SECONDS) + max(1 / RATE, took / SHARE)
        await asyncio.sleep(max(self._due - now, 0.0))

    def _take(self, message: messages.Message) -> None:
        self.asked = self.asked or not isinstance(message, messages.Ack)
        match message:
            case messages.Scene():
                self.renderer.show(self, message)
            case messages.Ack():
                if self.acknowledged < message.frame <= self.sent:
                    self.acknowledged = message.frame
                    self.stalled_since = None
                    self.renderer.wake()
            case messages.Upload():
                self._upload = message
            case messages.Wish():
                self.renderer.request_variant(self, message)

    async def _take_upload(self, content: bytes) -> None:
        upload, self._upload = self._upload, None
        if upload is None:
            raise InputError(f"{len(content)} bytes without an announcement", "message", "send an upload message first")
        pixels = await asyncio.to_thread(messages.environment, upload, content)
        self.renderer.keep_picture(self, upload.key, pixels)

    def send(self, message: str | bytes) -> None:
        """Queue a message. If too many messages are queued, end the session, because the page does not read them."""
        if self._outbox.qsize() >= MAX_WAITING:
            self.end(1008, "answers are not taken")
        else:
            self._outbox.put_nowait(message)

    async def _write(self) -> None:
        while True:
            message = await self._outbox.get()
            if isinstance(message, bytes):
                await self.websocket.send_bytes(message)
            else:
                await self.websocket.send_text(message)

    async def _watch(self, stall_seconds: float) -> None:
        began = time.monotonic()
        while True:
            await asyncio.sleep(min(1.0, stall_seconds))
            since = self.stalled_since if self.asked else began
            if since is not None and time.monotonic() - since > stall_seconds:
                self._reason = (1008, "frames are not taken" if self.asked else "nothing was requested")
                return

    # ------------------------------------------------------------------ from the renderer's thread

    def send_from_thread(self, message: str | bytes) -> None:
        """As `send`, from another thread. The event loop may have ended."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(self.send, message)


class Renderer:
    """The rendering thread, which renders short passes and writes shaders, with equal time for all sessions.

    what    stage with the materials
    device  "cpu", "cuda" or "auto"
    """

    def __init__(self, what: Stage, device: str = "cpu"):
        self.stage, self.device = what, device
        self.revision = 0  # revision of the stage
        self._sessions: list[Session] = []
        self._jobs: list[_Variant] = []
        self._spare: list[Reference] = []  # of ended sessions, for reuse by new pages
        self._lock = threading.Condition()
        self._running = False
        self._clock = 0.0  # shortest time spent on a session with pending work
        self._thread: threading.Thread | None = None

    def renew(self, what: Stage) -> None:
        """Render another stage from now on. Pending requests for the old stage are dropped."""
        with self._lock:
            self.stage = what
            self.revision += 1
            self._jobs.clear()
            for session in self._sessions:
                session.scene = None

    # ------------------------------------------------------------------ requests of sessions

    def show(self, session: Session, scene: messages.Scene) -> None:
        """Render a scene for a session, in place of its previous scene. A scene of an older stage is ignored."""
        with self._lock:
            if scene.revision != self.revision:
                return
            session.scene = scene
            if session not in self._sessions:
                self._sessions.append(session)
            self._start()
            self._lock.notify()

    def keep_picture(self, session: Session, key: str, pixels: Pixels) -> None:
        with self._lock:
            session.pictures.pop(key, None)
            session.pictures[key] = pixels
            while len(session.pictures) > PICTURES:
                session.pictures.pop(next(iter(session.pictures)))

    def request_variant(self, session: Session, wish: messages.Wish) -> None:
        """Write a shader with other choices, and send it to the page."""
        if wish.revision != self.revision:
            return  # the page will request it again
        if wish.material not in self.stage.materials:
            known = ", ".join(self.stage.materials)
            raise InputError(f"unknown material '{wish.material}'", "material", f"known: {known}")
        with self._lock:
            if sum(job.session is session for job in self._jobs) >= MAX_WISHES:
                raise InputError(f"more than {MAX_WISHES} shaders are pending", "choice", "wait for some")
            self._jobs.append(_Variant(self.stage, session, wish))
            self._start()
            self._lock.notify()

    def wake(self) -> None:
        """Wake the thread, because a frame was acknowledged and the next one may be rendered."""
        with self._lock:
            self._lock.notify()

    def forget(self, session: Session) -> None:
        """Stop working for a session that has ended."""
        with self._lock:
            if session in self._sessions:
                self._sessions.remove(session)
            self._jobs = [job for job in self._jobs if job.session is not session]
            if session.reference is not None and len(self._spare) < MAX_SPARE:
                self._spare.append(session.reference)
            session.scene = session.reference = None

    def stop(self) -> None:
        """End the thread after its current pass."""
        with self._lock:
            self._running = False
            self._lock.notify()
        if self._thread is not None:
            self._thread.join()

    def _start(self) -> None:
        if self._thread is None:
            self._running = True
            self._thread = threading.Thread(target=self._work, name="gonio reference", daemon=True)
            self._thread.start()

    # ------------------------------------------------------------------ the thread

    def _work(self) -> None:
        while True:
            with self._lock:
                while self._running and not self._jobs and not any(map(_has_work, self._sessions)):
                    self._lock.wait()
                if not self._running:
                    return
                session = self._next([*filter(_has_work, self._sessions), *(job.session for job in self._jobs)])
                job = next((job for job in self._jobs if job.session is session), None)
                if job is not None:
                    self._jobs.remove(job)
                scene = session.scene
            began = time.perf_counter()
            try:
                with COMPUTING:
                    if job is not None:
                        job()
                    elif scene is not None:
                        self._turn(session, scene)
                    settle()
            except GonioError as error:
                self._give_up(session, scene, error)
            except Exception as error:
                first = str(error).strip().partition("\n")[0]
                what = f"the reference failed: {type(error).__name__}: {first}"
                self._give_up(session, scene, GonioError(what, "reference", "report this; the page itself continues"))
            session.spent += time.perf_counter() - began
            time.sleep(GIVE_WAY_SECONDS)

    def _next(self, ready: list[Session]) -> Session:
        """The session that has used the least of the thread's time, so that large pictures do not delay small ones.

        Idle time gives no credit: a session that becomes active again starts at the level of the others (start-time
        fair queueing).
        """
        chosen = min(ready, key=lambda session: max(session.spent, self._clock))
        self._clock = chosen.spent = max(chosen.spent, self._clock)
        return chosen

    def _give_up(self, session: Session, scene: messages.Scene | None, error: GonioError) -> None:
        """Drop a scene that cannot be rendered, unless it has already been replaced."""
        with self._lock:
            if session.scene is scene:
                session.scene = None
        session.send_from_thread(messages.failure(error))

    def _turn(self, session: Session, scene: messages.Scene) -> None:
        """Render one pass of a scene for a session, and send a frame if the page is ready for one."""
        with self._lock:
            reference = session.reference
            pictures = dict(session.pictures)
            stage = self.stage
            spare = self._spare.pop() if reference is None and self._spare else None
        if reference is None:
            reference = spare or Reference(stage, self.device)
            session.reference = reference
            limits = {"upload": messages.UPLOAD_BYTES, "pixels": messages.MAX_PIXELS}
            ready = {"type": "ready", "device": reference.device, "version": __version__, "limits": limits}
            session.send_from_thread(json.dumps(ready))
            _give_way()
        with engine.using(reference.variant):  # the program that serves the page may have set another variant
            if reference.scene is not scene:
                reference.stage, reference.pictures = stage, pictures
                reference.show(scene)
                session.shown_samples = 0
                session.started = time.perf_counter()
            reference.advance()
            if session.sent == session.acknowledged and _worth_showing(reference, session.shown_samples):
                self._send_frame(session, reference)

    def _send_frame(self, session: Session, reference: Reference) -> None:
        assert reference.scene is not None
        session.shown_samples = reference.samples
        session.sent += 1
        session.stalled_since = time.monotonic()
        header = {
            "id": reference.scene.id,
            "frame": session.sent,
            "spp": reference.samples,
            "seconds": round(time.perf_counter() - session.started, 4),
            "done": reference.done,
        }
        session.send_from_thread(messages.frame(header, reference.image()))


def _give_way() -> None:
    """Lower the priority of this thread and Dr.Jit's workers in favor of the browser (Linux only)."""
    with contextlib.suppress(OSError):
        lower = os.getpriority(os.PRIO_PROCESS, os.getpid()) + 10  # lower than the main thread's; 19 is the limit
        for task in Path("/proc/self/task").iterdir():
            if (task / "comm").read_text().startswith("nt [") or int(task.name) == threading.get_native_id():
                os.setpriority(os.PRIO_PROCESS, int(task.name), lower)


def _worth_showing(reference: Reference, shown: int) -> bool:
    """Whether to send a picture: the first one immediately, further ones after 25 % more samples, and the final one."""
    samples = reference.samples
    return samples > shown and (reference.done or samples >= 1.25 * shown)


def _has_work(session: Session) -> bool:
    """Whether a page that acknowledges frames needs more samples, or has not received the final picture."""
    reference = session.reference
    if session.scene is None or session.idle_for() > HIDDEN_SECONDS:
        return False
    if reference is None or reference.scene is not session.scene or not reference.done:
        return True
    return session.sent == session.acknowledged and session.shown_samples < reference.samples


class _Variant:
    """The task of writing one shader."""

    def __init__(self, what: Stage, session: Session, wish: messages.Wish):
        self.stage, self.session, self.wish = what, session, wish

    def __call__(self) -> None:
        wish = self.wish
        try:
            bsdf = self.stage.materials[wish.material].bsdf
            variant = page.variant_data(bsdf, dict(wish.choices), wish.on, dict(wish.fixed))
            dfg = page.split_sum_data(*variant["facets"]) if variant["facets"] else None
            answer = {"type": "variant", "id": wish.id, "material": wish.material, "variant": variant, "dfg": dfg}
            answer["revision"] = wish.revision
            self.session.send_from_thread(json.dumps(answer, allow_nan=False))
        except GonioError as error:
            self.session.send_from_thread(messages.failure(error, wish=wish.id))
        except Exception as error:
            what = f"the shader cannot be written: {type(error).__name__}: {error}"
            self.session.send_from_thread(messages.failure(GonioError(what, wish.material), wish=wish.id))
