"""The server lets in its own page and nobody else, bounds what comes, and keeps a good page served."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
import websockets
from gonio.errors import GonioError, InputError, MachineError
from gonio.viewer import messages, server, session, stage
from live_server import STAGE, final_frame, get, next_frame, read, running, scene, speak, wait_for
from websockets.sync.client import connect


@pytest.fixture(scope="module")
def one() -> Iterator[server.Server]:
    with running() as started:
        yield started


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


def test_the_policy_names_the_socket_as_far_as_it_can(one: server.Server) -> None:
    for host, source in (("localhost:1", "ws://localhost:1"), ("[::1]:1", "'self'")):  # it knows no IPv6 addresses
        assert f"connect-src blob: data: {source};" in get(one, Host=host)[1]["content-security-policy"]


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=wrong", "/?token=a&token=b", "/?token=%ff"])
def test_without_the_token_there_is_nothing(one: server.Server, path: str) -> None:
    status, _, body = get(one, path)
    assert status == 403 and one.application.access.token not in body


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
    status, _, body = get(one, f"{path}?token={one.application.access.token}")
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


@pytest.mark.slow
def test_a_variant_comes_when_it_is_asked_for(one: server.Server) -> None:
    with running(stage.of_models([go.Conductor(alpha=0.2)])) as other, speak(other) as client:
        client.send(json.dumps({"type": "choice", "id": 3, "material": "m0", "choices": {"ndf": "beckmann"}}))
        answer, _ = read(client.recv(20))
        assert (answer["type"], answer["id"], answer["material"]) == ("variant", 3, "m0")
        assert "ggx" not in answer["variant"]["text"].lower() and "eckmann" in answer["variant"]["text"]
        client.send(json.dumps({"type": "choice", "id": 4, "material": "m0", "choices": {"ndf": "nonsense"}}))
        answer, _ = read(client.recv(20))
        assert answer["type"] == "error" and "nonsense" in answer["what"]


@pytest.mark.slow
def test_every_variant_that_is_asked_for_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    with running(stage.of_models([go.Conductor(alpha=0.2), go.Conductor(alpha=0.4)])) as other, speak(other) as client:
        wanted = [(material, ndf) for material in ("m0", "m1") for ndf in ("beckmann", "ggx")]
        for number, (material, ndf) in enumerate(wanted):
            wish = {"type": "choice", "id": number, "material": material, "choices": {"ndf": ndf}}
            client.send(json.dumps(wish))
        answers = [read(client.recv(20))[0] for _ in wanted]
        assert [(a["type"], a["id"], a["material"]) for a in answers] == [
            ("variant", number, material) for number, (material, _) in enumerate(wanted)
        ]
        monkeypatch.setattr(session, "MAX_WISHES", 0)
        client.send(json.dumps({"type": "choice", "id": 9, "material": "m0", "choices": {}}))
        assert "shaders are pending" in read(client.recv(20))[0]["what"]


def test_a_scene_that_came_while_another_failed_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    with running() as one, speak(one) as client:
        show = session.Reference.show
        begun = threading.Event()

        def fail_late(reference: Any, message: messages.Scene) -> None:
            if message.id == 1:
                begun.set()
                wait_for(lambda: one.application.sessions[0].scene is not message)
                raise InputError("it cannot be shown", "scene")
            show(reference, message)

        monkeypatch.setattr(session.Reference, "show", fail_late)
        client.send(scene(1))
        assert begun.wait(20)  # a second scene that came sooner would take the place of the first
        client.send(scene(2))
        answers = [read(client.recv(20))[0] for _ in range(2)]
        assert [answer["type"] for answer in answers] == ["ready", "error"]
        assert final_frame(client, 2).any()


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
    address = f"ws://127.0.0.1:{one.port}/ws?token={one.application.access.token}"
    with connect(address, origin=f"http://127.0.0.1:{one.port}", compression="deflate") as client:
        assert client.response is not None and "Sec-WebSocket-Extensions" not in client.response.headers


# --------------------------------------------------------------------------- bad messages


BAD = {
    "no JSON": "rubbish",
    "deep": "[" * 60000,
    "long type": json.dumps({"type": "x" * 60000}),
    "long key": json.dumps({"type": "ack", "frame": 1, "x" * 60000: 1}),
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


@pytest.mark.sample(6)
@pytest.mark.parametrize("name", list(BAD))
def test_a_bad_message_gets_one_error_and_the_session_lives(one: server.Server, name: str) -> None:
    with speak(one) as client:
        client.send(BAD[name])
        answers = [read(client.recv(20))[0]]
        if answers[0]["type"] == "ready":
            answers = [read(client.recv(20))[0]]
        assert answers[0]["type"] == "error"
        assert answers[0]["what"] and answers[0]["where"]
        assert len(answers[0]["what"]) <= 250 and len(answers[0]["where"]) <= 250
        assert "Traceback" not in answers[0]["what"] and "site-packages" not in answers[0]["what"]
        client.send(scene(2))
        assert final_frame(client, 2)[9, 16, 3] == 1.0


def test_a_picture_that_is_not_what_was_announced_is_refused() -> None:
    upload = messages.Upload(type="environment", key="a", width=2, height=1)
    with pytest.raises(InputError, match="8 bytes received, 16 were announced"):
        messages.environment(upload, bytes(8))
    with pytest.raises(InputError, match="negative or infinite values"):
        messages.environment(upload, np.full(8, np.inf, "<f2").tobytes())
    with pytest.raises(InputError, match="negative or infinite values"):
        messages.environment(upload, np.full(8, -1.0, "<f2").tobytes())


def test_bytes_that_nothing_announced_are_refused(one: server.Server) -> None:
    with speak(one) as client:
        client.send(b"1234")
        assert "without an announcement" in read(client.recv(20))[0]["what"]


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


@pytest.mark.sample(1)
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


@pytest.mark.slow
def test_a_second_ctrl_c_while_a_kernel_is_compiled_is_no_crash(tmp_path: Path) -> None:
    program = tmp_path / "serve.py"
    program.write_text(
        "import threading, gonio as go\n"
        "from gonio.viewer import page, server, session, stage\n"
        "page._script = page._style = lambda: ''\n"
        "def advance(self):\n"
        "    print('busy')\n"
        "    threading.Event().wait(3)\n"
        "session.Reference.advance = advance\n"
        "server.serve(stage.of_models([go.Lambert()]), browser=False)\n"
        "print('ended')\n"
    )
    command = [sys.executable, "-u", str(program)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as busy:
        assert busy.stdout is not None and busy.stderr is not None
        found = re.fullmatch(r"http://(.*)/\?token=(.*)", busy.stdout.readline().strip())
        assert found
        with connect(f"ws://{found[1]}/ws?token={found[2]}", origin=f"http://{found[1]}", compression=None) as client:
            client.send(scene(1))
            while busy.stdout.readline() != "busy\n":
                pass
            busy.send_signal(signal.SIGINT)
            with pytest.raises(websockets.ConnectionClosed):
                while True:
                    client.recv(10)
            wait_for(lambda: not listens(found[1]))  # now it waits for the thread
            busy.send_signal(signal.SIGINT)
        assert busy.wait(20) == 0
        assert busy.stdout.read() == "ended\n" and busy.stderr.read() == ""


def listens(address: str) -> bool:
    host, _, port = address.rpartition(":")
    with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 5):
        return True
    return False


def test_a_browser_that_holds_up_whoever_opens_it_holds_up_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    opened, closed = threading.Event(), threading.Event()

    def browse(url: str) -> None:
        opened.set()
        closed.wait(60)

    monkeypatch.setattr(server.webbrowser, "open", browse)
    one = server.Server(
        server.Application(STAGE, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, browser=True, quiet=True
    )
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    try:
        assert opened.wait(20)
        one.should_exit = True
        thread.join(20)
        assert not thread.is_alive()
    finally:
        closed.set()


def test_the_token_stands_in_no_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    found = threading.Event()
    texts: list[tuple[str, int]] = []

    def browse(url: str) -> None:
        opened.append(url)
        path = Path(url.removeprefix("file://"))
        texts.append((path.read_text(), path.stat().st_mode & 0o777))
        found.set()

    monkeypatch.setattr(server.webbrowser, "open", browse)
    one = server.Server(
        server.Application(STAGE, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, browser=True, quiet=True
    )
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    assert found.wait(20)
    address = one.url
    one.should_exit = True
    thread.join(20)
    token = one.application.access.token
    assert opened[0].startswith("file://") and token not in opened[0]
    assert f"url={address}" in texts[0][0] and token in texts[0][0]
    assert texts[0][1] == 0o600
    assert not Path(opened[0].removeprefix("file://")).exists()


@pytest.mark.parametrize(("host", "warned"), [("127.1", False), ("localhost", False), ("0", True)])
def test_the_address_is_the_one_that_was_had(
    host: str, warned: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(server.Server, "serve_until_interrupted", lambda self: (print(self.url), self.listener.close()))
    server.serve(STAGE, host=host, browser=False)
    output = capsys.readouterr()
    # what is open to all is reached by the loopback, too
    assert output.out.startswith("http://127.0.0.1:") and "/?token=" in output.out
    assert ("listening on 0.0.0.0" in output.err) == warned


@pytest.mark.parametrize("host", ["", "[::1]", "a b", "http://127.0.0.1"])
def test_what_is_no_address_is_refused(host: str) -> None:
    with pytest.raises(InputError, match="is not an address"):
        server.serve(STAGE, host=host, browser=False)


def test_an_address_that_cannot_be_had_is_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    for host in ("192.0.2.1", f"{'a' * 80}.example", "..", "::1::"):
        with pytest.raises(MachineError, match="cannot listen"):
            server.serve(STAGE, host=host, browser=False)

    def none(*arguments: Any) -> None:
        raise OSError(97, "Address family not supported by protocol")

    monkeypatch.setattr(server.socket, "socket", none)
    with pytest.raises(MachineError, match="not supported"):
        server.serve(STAGE, host="::1", browser=False)


def test_a_taken_port_is_a_clear_error(one: server.Server) -> None:
    with pytest.raises(MachineError, match="cannot listen"):
        server.serve(STAGE, port=one.port, browser=False)
    with pytest.raises(InputError, match="unknown device 'tpu'"):
        server.serve(STAGE, browser=False, device="tpu")
    with pytest.raises(InputError, match="port 99999"):
        server.serve(STAGE, port=99999, browser=False)
    with pytest.raises(GonioError, match="cannot listen"):
        server.serve(STAGE, host="no.such.name.invalid", browser=False)
