"""Clients that flood, stall and never read: each is bounded, and a good page keeps being served."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import threading
import time
import types
from collections.abc import Iterator
from typing import Any

import pytest
import websockets
from gonio.viewer import guards, server, session
from live_server import STAGE, final_frame, get, next_frame, rest, running, scene, speak, upgraded, wait_for


@pytest.fixture(scope="module")
def one() -> Iterator[server.Server]:
    with running() as started:
        yield started


def test_a_message_of_100_mb_is_cut_off_and_others_go_on(one: server.Server) -> None:
    with speak(one) as good, speak(one) as bad:
        with contextlib.suppress(websockets.ConnectionClosed):
            bad.send(bytes(100 << 20))
            bad.recv(20)
        wait_for(lambda: bad.close_code is not None)
        assert bad.close_code in (1009, 1006)
        good.send(scene(1))
        assert final_frame(good, 1).any()


def test_200_connections_that_say_nothing_leave_a_good_page_served(one: server.Server) -> None:
    stalled = [socket.create_connection(("127.0.0.1", one.port), 10) for _ in range(100)]
    half = [socket.create_connection(("127.0.0.1", one.port), 10) for _ in range(100)]
    for connection in half:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: 127")
    try:
        assert get(one)[0] == 200
        with speak(one) as client:
            client.send(scene(1))
            assert final_frame(client, 1).any()
    finally:
        for connection in [*stalled, *half]:
            connection.close()


def test_connections_that_say_nothing_are_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guards, "REQUEST_SECONDS", 0.2)
    monkeypatch.setattr(guards, "MAX_CONNECTIONS", 20)
    with running() as one:
        idle = [socket.create_connection(("127.0.0.1", one.port), 10) for _ in range(40)]
        for connection in idle:
            connection.settimeout(10)
            with contextlib.suppress(ConnectionResetError):
                assert connection.recv(1) == b""
            connection.close()
        assert get(one)[0] == 200


@pytest.mark.slow
def test_200_sessions_that_never_read_leave_a_good_page_served(one: server.Server) -> None:
    async def flood() -> int:
        """How many of 200 sessions with the right token are open at the end."""
        right = {"origin": f"http://127.0.0.1:{one.port}", "compression": None}
        address = f"ws://127.0.0.1:{one.port}/ws?token={one.application.access.token}"
        opened: list[Any] = []

        async def client() -> None:
            with contextlib.suppress(OSError, websockets.WebSocketException):
                opened.append(await websockets.connect(address, **right))

        await asyncio.gather(*(client() for _ in range(200)))
        await asyncio.sleep(0.3)
        count = sum(c.state == websockets.State.OPEN for c in opened)
        for c in opened:
            c.transport.abort()
        return count

    with speak(one) as good:
        good.send(scene(1))
        final_frame(good, 1)
        left = asyncio.run(flood())
        assert left <= server.MAX_SESSIONS
        good.send(scene(2))  # it was there before and is there still
        assert final_frame(good, 2).any()
        with speak(one) as later:
            later.send(scene(3))
            assert final_frame(later, 3).any()


def test_a_page_that_takes_no_frames_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "STALL_SECONDS", 0.2)
    with running() as one:
        with speak(one) as silent, pytest.raises(websockets.ConnectionClosed, match="1008"):
            silent.recv(10)
        with speak(one) as idle, pytest.raises(websockets.ConnectionClosed, match="nothing was requested"):
            idle.send(json.dumps({"type": "ack", "frame": 1}))  # of a frame that was not sent
            idle.recv(10)
        with speak(one) as stalled, pytest.raises(websockets.ConnectionClosed, match="frames are not taken"):
            stalled.send(scene(1))
            while True:
                stalled.recv(10)
        assert get(one)[0] == 200


@pytest.mark.slow
def test_a_page_that_sends_and_never_reads_is_let_go(one: server.Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "RATE", 1e9)  # else it takes the while until so many answers wait
    monkeypatch.setattr(session, "SHARE", 1e9)
    rubbish = b"\x81\x81\x00\x00\x00\x00x" * 4096  # masked text frames of one letter
    with upgraded(one, buffer=4096) as client:
        assert client.recv(12) == b"HTTP/1.1 101"
        with pytest.raises(OSError, match=r"reset|[Bb]roken pipe"):
            for _ in range(2000):
                client.sendall(rubbish)
    wait_for(lambda: not one.application.sessions)
    assert get(one)[0] == 200


@pytest.mark.slow
def test_a_flood_of_messages_leaves_a_good_page_served(one: server.Server) -> None:
    def flood(client: socket.socket, frames: bytes) -> None:
        with contextlib.suppress(OSError):  # until it is closed
            while True:
                client.sendall(frames)

    scenes = b"".join(masked(scene(number, spp=1 << 16)) for number in range(100))
    with speak(one) as good, contextlib.ExitStack() as clients:
        for frames in (scenes, masked("rubbish") * 1000):
            client = clients.enter_context(upgraded(one))
            assert client.recv(12) == b"HTTP/1.1 101"
            client.sendall(frames)
            threading.Thread(target=flood, args=(client, frames), daemon=True).start()
        for number in range(10):
            good.send(scene(number))
            assert final_frame(good, number).any()
    wait_for(lambda: not one.application.sessions, 60)


def masked(text: str) -> bytes:
    """A text frame as a browser sends it, its mask zero."""
    return b"\x81\xfe" + struct.pack(">HI", len(text), 0) + text.encode()


def test_messages_are_read_at_a_bounded_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    def waits(took: float, count: int) -> list[float]:
        """Seconds that follow each of `count` messages of `took` CPU seconds that come without a pause."""
        found: list[float] = []

        async def sleep(seconds: float) -> None:
            found.append(seconds)

        async def read_all() -> None:
            paced = session.Session(None, None)  # type: ignore[arg-type]
            paced.loop = types.SimpleNamespace(time=lambda: 1000.0 + sum(found))  # type: ignore[assignment]
            with monkeypatch.context() as fake:
                fake.setattr(session.asyncio, "sleep", sleep)
                for _ in range(count):
                    await paced._pace(took)

        asyncio.run(read_all())
        return found

    light = waits(1e-5, 200)
    assert sum(light[:120]) == pytest.approx(0) and light[-1] == pytest.approx(1 / session.RATE)
    heavy = waits(0.01, 10)  # 100 a second would take all of the thread
    assert sum(heavy[:4]) == pytest.approx(0) and heavy[-1] == pytest.approx(0.01 / session.SHARE)


def test_each_session_has_as_much_of_the_renderers_time_as_any_other() -> None:
    renderer = session.Renderer(STAGE)
    small, *large = [types.SimpleNamespace(cost=cost, spent=0.0, turns=0) for cost in (0.01, 0.3, 0.3, 0.3)]

    def take_turns(ready: list[Any], count: int) -> None:
        for _ in range(count):
            chosen = renderer._next(ready)
            chosen.turns += 1
            chosen.spent += chosen.cost

    take_turns(large, 30)
    take_turns([small, *large], 330)  # who comes later has no more than the others from then on
    assert small.turns == pytest.approx(300, abs=40)
    assert [one.turns for one in large] == pytest.approx([20] * 3, abs=2)


def test_nothing_is_rendered_for_a_page_that_takes_no_frames(
    one: server.Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "HIDDEN_SECONDS", 0.0)
    with speak(one) as client:
        client.send(scene(1, spp=1 << 16))
        header, _ = next_frame(client)
        reference = one.application.sessions[0].reference
        with speak(one) as other:  # two pictures of it, so that the thread has had the time for the first's next pass
            other.send(scene(1, spp=1))
            final_frame(other, 1)
            other.send(scene(2, spp=1))
            final_frame(other, 2)
        assert reference.samples == header["spp"]
        client.send(json.dumps({"type": "ack", "frame": header["frame"]}))
        assert next_frame(client)[0]["spp"] > header["spp"]


def test_a_message_of_endless_fragments_is_cut_off(one: server.Server) -> None:
    with upgraded(one) as client:
        assert client.recv(12) == b"HTTP/1.1 101"
        client.sendall(b"\x02\x80\x00\x00\x00\x00")
        with contextlib.suppress(OSError):  # more than one may be on its way when it ends
            client.sendall(b"\x00\x80\x00\x00\x00\x00" * (guards.MAX_FRAGMENTS + 10))
        assert b"too many fragments" in rest(client)
    wait_for(lambda: not one.application.sessions)


@pytest.mark.slow
def test_a_flood_of_pings_is_cut_off(one: server.Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guards, "MAX_CONTROLS", 20)
    with speak(one) as client:
        for _ in range(10):
            assert client.ping().wait(10)
        with pytest.raises(websockets.ConnectionClosed, match="too many pings"):
            while True:
                client.ping().wait(10)


@pytest.mark.parametrize("more", ["Content-Length: 5\r\n", f"X-Long: {'x' * 9000}\r\n", "X-Many: 1\r\n" * 300])
def test_a_handshake_that_makes_no_sense_holds_no_connection(one: server.Server, more: str) -> None:
    with upgraded(one, more, token="wrong") as client:
        assert b"101" not in rest(client)
    wait_for(lambda: not one.server_state.connections)


def test_pages_that_are_asked_for_and_not_taken_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guards, "MAX_ANSWERS", 3)
    monkeypatch.setattr(guards, "ANSWER_SECONDS", 1.0)
    with running() as one, contextlib.ExitStack() as clients:
        one.application._html = "x" * (16 << 20)  # more than the system's buffers hold
        request = f"GET /?token={one.application.access.token} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
        for _ in range(10):
            client = clients.enter_context(socket.create_connection(("127.0.0.1", one.port), 10))
            client.sendall(request)
            assert client.recv(15) == b"HTTP/1.1 200 OK"
            assert len(one.server_state.connections) <= 4  # one more until the loop has ended the oldest
        assert get(one)[0] == 200
        wait_for(lambda: not one.server_state.connections)


def test_when_all_places_are_taken_a_newcomer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MAX_SESSIONS", 1)
    with running() as one, speak(one) as first:
        first.send(scene(1))
        next_frame(first)
        with speak(one) as second, pytest.raises(websockets.ConnectionClosed, match="too many pages"):
            second.recv(10)


def test_a_page_that_takes_nothing_gives_its_place_to_a_newcomer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MAX_SESSIONS", 1)
    monkeypatch.setattr(server, "PATIENCE_SECONDS", 0.05)
    with running() as one, speak(one) as stalled:
        stalled.send(scene(1, spp=1))
        next_frame(stalled)  # and no answer
        time.sleep(0.1)
        with speak(one) as newcomer:
            newcomer.send(scene(2))
            assert final_frame(newcomer, 2).any()
        with pytest.raises(websockets.ConnectionClosed, match="made room"):
            stalled.recv(10)
