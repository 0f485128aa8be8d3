"""A server in a thread, and a page's side of its socket."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.viewer import page, server, stage
from websockets.sync.client import ClientConnection, connect

STAGE = stage.of_models([go.Lambert(albedo=0.5)])


@contextlib.contextmanager
def running(what: stage.Stage = STAGE) -> Iterator[server.Server]:
    """A server in a thread of its own, and a page without its script."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "_script", lambda: "console.log(1)")
        patch.setattr(page, "_style", lambda: "body { margin: 0 }")
        application = server.Application(what, server.AccessControl("127.0.0.1"))
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


def get(one: server.Server, path: str | None = None, **headers: str) -> tuple[int, dict[str, str], str]:
    """Status, headers (lower case) and body; `path` goes out as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", one.port, timeout=10)
    connection.putrequest("GET", f"/?token={one.application.access.token}" if path is None else path, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{one.port}", **headers}.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, {k.lower(): v for k, v in answer.getheaders()}, body


def speak(one: server.Server, token: str | None = None, origin: str | None = "", **more: Any) -> ClientConnection:
    """A connected page; `origin` "" is the right one."""
    given = one.application.access.token if token is None else token
    right = f"http://127.0.0.1:{one.port}"
    address = f"ws://127.0.0.1:{one.port}/ws?token={given}"
    return connect(address, origin=right if origin == "" else origin, max_size=None, compression=None, **more)


def upgraded(one: server.Server, more: str = "", token: str | None = None, buffer: int = 1 << 16) -> socket.socket:
    """A raw connection that has asked for the socket; `more` are header lines, `buffer` what it takes unread."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
    client.settimeout(10)
    client.connect(("127.0.0.1", one.port))
    host, given = f"127.0.0.1:{one.port}", one.application.access.token if token is None else token
    head = f"GET /ws?token={given} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n{more}"
    key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
    client.sendall(f"{head}Connection: Upgrade\r\nUpgrade: websocket\r\n{key}\r\n".encode())
    return client


def rest(client: socket.socket) -> bytes:
    """What comes until the other side ends the connection."""
    found = b""
    with contextlib.suppress(ConnectionResetError):
        while part := client.recv(1 << 16):
            found += part
    return found


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
