"""The server lets in its own page and nobody else, bounds what comes, and keeps a good page served."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
import websockets
from gonio.errors import GonioError, InputError, MachineError
from gonio.viewer import messages, page, server, session, stage
from websockets.sync.client import ClientConnection, connect

STAGE = stage.of_models([go.Lambert(albedo=0.5)])


@contextlib.contextmanager
def running(what: stage.Stage = STAGE) -> Iterator[server.Server]:
    """A server in a thread of its own."""
    application = server.Application(what, server.Door("127.0.0.1"))
    one = server.Server(application, "127.0.0.1", 0, quiet=True)
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    wait_for(lambda: one.started)
    try:
        yield one
    finally:
        one.should_exit = True
        thread.join(20)
        assert not thread.is_alive()


def wait_for(condition: Callable[[], Any], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come to pass"
        time.sleep(0.01)


@pytest.fixture(scope="module", autouse=True)
def small_page() -> Iterator[None]:
    """The server is tested without the page's script."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "_script", lambda: "console.log(1)")
        patch.setattr(page, "_style", lambda: "body { margin: 0 }")
        yield


@pytest.fixture(scope="module")
def one(small_page: None) -> Iterator[server.Server]:
    with running() as started:
        yield started


def get(one: server.Server, path: str | None = None, **headers: str) -> tuple[int, dict[str, str], str]:
    """Status, headers (lower case) and body; `path` goes out as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", one.port, timeout=10)
    connection.putrequest("GET", f"/?token={one.application.door.token}" if path is None else path, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{one.port}", **headers}.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def speak(one: server.Server, token: str | None = None, origin: str | None = "", **more: Any) -> ClientConnection:
    """A connected page; `origin` "" is the right one."""
    given = one.application.door.token if token is None else token
    right = f"http://127.0.0.1:{one.port}"
    address = f"ws://127.0.0.1:{one.port}/ws?token={given}"
    return connect(address, origin=right if origin == "" else origin, max_size=None, compression=None, **more)


def scene(number: int, albedo: float = 0.5, spp: int = 4, size: tuple[int, int] = (32, 18)) -> str:
    state = {
        "rows": [{"material": "m0", "balls": [{"albedo": [albedo] * 3}]}],
        "lights": [{"type": "directional", "direction": [0, 0, 1], "irradiance": [1, 1, 1]}],
        "camera": {"target": [0, 0, 0], "distance": 6, "azimuth": 0, "elevation": 0, "fov": 30},
    }
    return json.dumps({"type": "scene", "id": number, "width": size[0], "height": size[1], "state": state, "spp": spp})


def read(message: str | bytes) -> tuple[dict[str, Any], np.ndarray | None]:
    """A message from the server: JSON, and the pixels of a frame."""
    if isinstance(message, str):
        return json.loads(message), None
    (length,) = struct.unpack_from("<I", message)
    header = json.loads(message[4 : 4 + length])
    assert length % 4 == 0
    pixels = np.frombuffer(message, "<f2", offset=4 + length)
    return header, pixels.reshape(header["height"], header["width"], 4)


def next_frame(client: ClientConnection, timeout: float = 20.0) -> tuple[dict[str, Any], np.ndarray]:
    while True:
        header, pixels = read(client.recv(timeout))
        if pixels is not None:
            return header, pixels
        assert header["type"] != "error", header


def final_frame(client: ClientConnection, number: int) -> np.ndarray:
    """The finished picture of a scene, frames before it acknowledged."""
    while True:
        header, pixels = next_frame(client)
        client.send(json.dumps({"type": "ack", "frame": header["frame"]}))
        if header["id"] == number and header["done"]:
            return pixels


# --------------------------------------------------------------------------- who may come in


def test_the_page_comes_with_a_strict_policy(one: server.Server) -> None:
    status, headers, body = get(one)
    assert status == 200 and "gonio-data" in body
    policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'" and policy["frame-ancestors"] == "'none'"
    assert policy["script-src"].startswith("'sha256-") and "unsafe" not in headers["content-security-policy"]
    assert policy["connect-src"] == f"blob: data: ws://127.0.0.1:{one.port}"
    assert headers["cache-control"] == "no-store" and headers["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in headers and "server" not in headers


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=wrong", "/?token=a&token=b", "/?token=%ff"])
def test_without_the_token_there_is_nothing(one: server.Server, path: str) -> None:
    status, _, body = get(one, path)
    assert status == 403 and one.application.door.token not in body


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "", "a b", "127.0.0.1:1; x", "[::1"])
def test_a_name_that_points_here_is_refused(one: server.Server, host: str) -> None:
    assert get(one, Host=host)[0] in (400, 403)


@pytest.mark.parametrize("host", ["localhost:{}", "127.0.0.1:9999", "[::1]:{}", "LOCALHOST"])
def test_this_machines_names_are_let_in(one: server.Server, host: str) -> None:
    assert get(one, Host=host.format(one.port))[0] == 200  # another port: a tunnel


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1:{}", "http://127.0.0.1:1"])
def test_a_page_elsewhere_is_refused(one: server.Server, origin: str) -> None:
    assert get(one, Origin=origin.format(one.port))[0] == 403
    with pytest.raises(websockets.InvalidStatus, match="403"):
        speak(one, origin=origin.format(one.port))


def test_a_socket_needs_token_and_origin(one: server.Server) -> None:
    for wrong in ({"token": "wrong"}, {"origin": None}, {"additional_headers": {"Host": "evil.example"}}):
        with pytest.raises((websockets.InvalidStatus, websockets.InvalidMessage)):
            speak(one, **wrong)
    assert not one.application.sessions


@pytest.mark.parametrize(
    "path",
    ["/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/static/app.js", "/ws", "/index.html", "/%00"],
)
def test_no_file_is_ever_served(one: server.Server, path: str) -> None:
    status, _, body = get(one, f"{path}?token={one.application.door.token}")
    assert status in (400, 403, 404) and len(body) < 100


# --------------------------------------------------------------------------- frames


def test_a_frame_is_the_picture_of_the_scene(one: server.Server) -> None:
    with speak(one) as client:
        client.send(scene(7, albedo=0.8, spp=64))
        assert read(client.recv(20))[0].keys() == {"type", "device", "version", "limits"}
        pixels = final_frame(client, 7)
    assert pixels.shape == (18, 32, 4)
    assert pixels[9, 16] == pytest.approx([0.8 / np.pi] * 3 + [1.0], rel=0.02)  # where the ball faces light and eye
    assert not pixels[0].any()


def test_one_frame_is_in_flight_until_it_is_acknowledged(one: server.Server) -> None:
    with speak(one) as client:
        client.send(scene(1, spp=4096))
        first, _ = next_frame(client)
        with pytest.raises(TimeoutError):
            next_frame(client, timeout=0.5)
        client.send(json.dumps({"type": "ack", "frame": first["frame"] + 5}))  # of a frame that was not sent
        with pytest.raises(TimeoutError):
            next_frame(client, timeout=0.2)
        client.send(json.dumps({"type": "ack", "frame": first["frame"]}))
        second, _ = next_frame(client)
        assert second["frame"] == first["frame"] + 1 and second["spp"] > first["spp"]


def test_the_newest_scene_wins(one: server.Server) -> None:
    with speak(one) as client:
        for number in range(50):
            client.send(scene(number, albedo=0.02 * number, spp=1 << 16))
        client.send(scene(50, albedo=1.0, spp=16))
        pixels = final_frame(client, 50)
        assert pixels[9, 16, 0] == pytest.approx(1.0 / np.pi, rel=0.02)
        with pytest.raises(TimeoutError):
            next_frame(client, timeout=0.3)  # nothing of the older ones follows


def test_a_variant_comes_when_it_is_asked_for(one: server.Server) -> None:
    with running(stage.of_models([go.Conductor(alpha=0.2)])) as other, speak(other) as client:
        client.send(json.dumps({"type": "choice", "id": 3, "material": "m0", "choices": {"ndf": "beckmann"}}))
        answer, _ = read(client.recv(20))
        assert (answer["type"], answer["id"], answer["material"]) == ("variant", 3, "m0")
        assert "ggx" not in answer["variant"]["text"].lower() and "eckmann" in answer["variant"]["text"]
        client.send(json.dumps({"type": "choice", "id": 4, "material": "m0", "choices": {"ndf": "nonsense"}}))
        answer, _ = read(client.recv(20))
        assert answer["type"] == "error" and "nonsense" in answer["what"]


def test_an_uploaded_environment_lights_the_balls(one: server.Server) -> None:
    pixels = np.full((4, 8, 4), 2.0, "<f2")
    with speak(one) as client:
        client.send(json.dumps({"type": "environment", "key": "sky", "width": 8, "height": 4}))
        client.send(pixels.tobytes())
        message = json.loads(scene(1, albedo=1.0, spp=256))
        message["state"]["lights"] = [{"type": "environment", "image": {"key": "sky"}}]
        client.send(json.dumps(message))
        found = final_frame(client, 1)
    assert found[9, 16, :3] == pytest.approx([2.0] * 3, rel=0.05)  # a white furnace of radiance 2


def test_the_socket_is_not_compressed(one: server.Server) -> None:
    address = f"ws://127.0.0.1:{one.port}/ws?token={one.application.door.token}"
    with connect(address, origin=f"http://127.0.0.1:{one.port}", compression="deflate") as client:
        assert client.response is not None and "Sec-WebSocket-Extensions" not in client.response.headers


# --------------------------------------------------------------------------- bad messages


BAD = {
    "no JSON": "rubbish",
    "deep": "[" * 60000,
    "unknown type": json.dumps({"type": "shutdown"}),
    "unknown key": json.dumps({"type": "ack", "frame": 1, "path": "/etc/passwd"}),
    "NaN": scene(1).replace("[0, 0, 1]", "[NaN, 0, 1]"),
    "huge": scene(1).replace('"width": 32', '"width": 100000'),
    "too many pixels": scene(1, size=(4096, 4096)),
    "no balls": scene(1).replace('[{"albedo": [0.5, 0.5, 0.5]}]', "[]"),
    "no direction": scene(1).replace("[0, 0, 1]", "[0, 0, 0]"),
    "unknown material": scene(1).replace('"m0"', '"../m0"'),
    "not there": scene(1).replace('"m0"', '"m9"'),
    "out of range": scene(1, albedo=-1.0),
    "no picture": scene(1).replace('"directional", "direction": [0, 0, 1], "irradiance": [1, 1, 1]',
                                   '"environment", "image": {"key": "none"}'),
    "long": json.dumps({"type": "ack", "frame": 1}) + " " * messages.TEXT_BYTES,
    "large upload": json.dumps({"type": "environment", "key": "a", "width": 8192, "height": 8192}),
}  # fmt: skip


@pytest.mark.parametrize("name", list(BAD))
def test_a_bad_message_gets_one_error_and_the_session_lives(one: server.Server, name: str) -> None:
    with speak(one) as client:
        client.send(BAD[name])
        answers = [read(client.recv(20))[0]]
        if answers[0]["type"] == "ready":
            answers = [read(client.recv(20))[0]]
        assert answers[0]["type"] == "error"
        assert answers[0]["what"] and answers[0]["where"]
        assert "Traceback" not in answers[0]["what"] and "site-packages" not in answers[0]["what"]
        client.send(scene(2))
        assert final_frame(client, 2)[9, 16, 3] == 1.0


def test_a_picture_that_is_not_what_was_announced_is_refused() -> None:
    upload = messages.Upload(type="environment", key="a", width=2, height=1)
    with pytest.raises(InputError, match="8 bytes came, 16 were announced"):
        messages.environment(upload, bytes(8))
    with pytest.raises(InputError, match="no radiance"):
        messages.environment(upload, np.full(8, np.inf, "<f2").tobytes())
    with pytest.raises(InputError, match="no radiance"):
        messages.environment(upload, np.full(8, -1.0, "<f2").tobytes())


def test_bytes_that_nothing_announced_are_refused(one: server.Server) -> None:
    with speak(one) as client:
        client.send(b"1234")
        assert "nothing announced" in read(client.recv(20))[0]["what"]


def test_a_message_of_100_mb_is_cut_off_and_others_go_on(one: server.Server) -> None:
    with speak(one) as good, speak(one) as bad:
        with contextlib.suppress(websockets.ConnectionClosed):
            bad.send(bytes(100 << 20))
            bad.recv(20)
        wait_for(lambda: bad.close_code is not None)
        assert bad.close_code in (1009, 1006)
        good.send(scene(1))
        assert final_frame(good, 1).any()


@pytest.mark.parametrize("path", ["/", "/nothing", "/?token=wrong"])
def test_a_connection_ends_with_its_answer(one: server.Server, path: str) -> None:
    with socket.create_connection(("127.0.0.1", one.port), 10) as client:
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\nGET / HT".encode())
        answer = b""
        with contextlib.suppress(ConnectionResetError):
            while part := client.recv(4096):  # b"" is the end
                answer += part
        assert answer.startswith(b"HTTP/1.1 40")


def test_a_long_request_is_cut_off(one: server.Server) -> None:
    with socket.create_connection(("127.0.0.1", one.port), 10) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        with contextlib.suppress(OSError):
            for _ in range(200):
                client.sendall(b"X-Long: " + b"x" * 1000 + b"\r\n")
        with contextlib.suppress(ConnectionResetError):
            assert b"400" in client.recv(1000)[:20]


# --------------------------------------------------------------------------- many clients


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
    monkeypatch.setattr(server, "REQUEST_SECONDS", 0.2)
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 20)
    with running() as one:
        idle = [socket.create_connection(("127.0.0.1", one.port), 10) for _ in range(40)]
        for connection in idle:
            connection.settimeout(10)
            with contextlib.suppress(ConnectionResetError):
                assert connection.recv(1) == b""
            connection.close()
        assert get(one)[0] == 200


def test_200_sessions_that_never_read_leave_a_good_page_served(one: server.Server) -> None:
    async def flood() -> int:
        """How many of 200 sessions with the right token are open at the end."""
        right = {"origin": f"http://127.0.0.1:{one.port}", "compression": None}
        address = f"ws://127.0.0.1:{one.port}/ws?token={one.application.door.token}"
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
        assert left <= server.MOST_SESSIONS
        good.send(scene(2))  # it was there before and is there still
        assert final_frame(good, 2).any()
        with speak(one) as later:
            later.send(scene(3))
            assert final_frame(later, 3).any()


def test_a_page_that_takes_no_frames_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "STALL_SECONDS", 0.2)
    monkeypatch.setattr(server, "REQUEST_SECONDS", 0.2)
    with running() as one:
        with speak(one) as silent, pytest.raises(websockets.ConnectionClosed, match="1008"):
            silent.recv(10)
        with speak(one) as stalled, pytest.raises(websockets.ConnectionClosed, match="1008"):
            stalled.send(scene(1))
            while True:
                stalled.recv(10)
        assert get(one)[0] == 200


def test_a_page_that_sends_and_never_reads_is_let_go(one: server.Server) -> None:
    key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
    host = f"127.0.0.1:{one.port}"
    rubbish = b"\x81\x81\x00\x00\x00\x00x" * 4096  # masked text frames of one letter
    with socket.create_connection(("127.0.0.1", one.port), 10) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        head = f"GET /ws?token={one.application.door.token} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n"
        client.sendall(f"{head}Connection: Upgrade\r\nUpgrade: websocket\r\n{key}\r\n".encode())
        with pytest.raises(OSError, match=r"reset|[Bb]roken pipe"):
            for _ in range(2000):
                client.sendall(rubbish)
    wait_for(lambda: not one.application.sessions)
    assert get(one)[0] == 200


def test_when_all_places_are_taken_a_newcomer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST_SESSIONS", 1)
    with running() as one, speak(one) as first:
        first.send(scene(1))
        next_frame(first)
        with speak(one) as second, pytest.raises(websockets.ConnectionClosed, match="too many pages"):
            second.recv(10)


def test_a_page_that_takes_nothing_gives_its_place_to_a_newcomer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST_SESSIONS", 1)
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


# --------------------------------------------------------------------------- beginning and end


def test_a_failing_reference_is_told_and_the_thread_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: Any) -> None:
        raise RuntimeError("a fault within")

    with running() as one, speak(one) as client:
        with monkeypatch.context() as broken:
            broken.setattr(session.Reference, "advance", fail)
            client.send(scene(1))
            assert read(client.recv(20))[0]["type"] == "ready"
            assert "a fault within" in read(client.recv(20))[0]["what"]
        client.send(scene(2))
        assert final_frame(client, 2).any()


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_on_ctrl_c_with_a_page_connected(sign: signal.Signals, tmp_path: Path) -> None:
    program = tmp_path / "serve.py"
    program.write_text(
        "import gonio as go\n"
        "from gonio.viewer import page, server, stage\n"
        "page._script = page._style = lambda: ''\n"
        "server.serve(stage.of_models([go.Lambert()]), browser=False)\n"
        "print('ended')\n"
    )
    with subprocess.Popen(
        [sys.executable, "-u", str(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONWARNINGS": "error::RuntimeWarning"},
    ) as running_server:  # fmt: skip
        assert running_server.stdout is not None and running_server.stderr is not None
        address = running_server.stdout.readline().strip()
        found = re.fullmatch(r"http://(127\.0\.0\.1:\d+)/\?token=([\w-]{32})", address)
        assert found, address
        with connect(f"ws://{found[1]}/ws?token={found[2]}", origin=f"http://{found[1]}", compression=None) as client:
            client.send(scene(1, spp=1 << 16))
            next_frame(client)
            running_server.send_signal(sign)
            with pytest.raises(websockets.ConnectionClosed, match=r"1001|1012"):
                while True:
                    client.recv(10)
        assert running_server.wait(20) == (0 if sign == signal.SIGINT else -signal.SIGTERM)
        assert running_server.stderr.read() == ""


def test_a_taken_port_is_a_clear_error(one: server.Server) -> None:
    with pytest.raises(MachineError, match="cannot listen"):
        server.serve(STAGE, port=one.port, browser=False)
    with pytest.raises(InputError, match="unknown device 'tpu'"):
        server.serve(STAGE, browser=False, device="tpu")
    with pytest.raises(InputError, match="port 99999"):
        server.serve(STAGE, port=99999, browser=False)
    with pytest.raises(GonioError, match="cannot listen"):
        server.serve(STAGE, host="no.such.name.invalid", browser=False)
