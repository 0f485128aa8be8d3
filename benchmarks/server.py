"""The page's server under attack: the frame rate that a legitimate page retains, and the memory of the server.

    python benchmarks/server.py [--minutes 10] [--json]

The server, the legitimate page and the attackers run in three processes. The legitimate page changes a value four times
per second and receives every frame, first alone and then for --minutes while the attackers do this:

    200 connections send nothing, or half a request, and reconnect when they are closed
     50 pages with a valid token connect; those that are accepted show pictures and change them every few seconds
      3 of them receive no frames, 2 send garbage and 2 send scenes as fast as they are read

Limits: the legitimate page retains 80 % of its frame rate without attackers; the server's memory is constant after the
first minute. Exits with 1 if a limit is missed.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import statistics
import struct
import subprocess
import sys
import time
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

import websockets

ALONE, STRETCH = 30.0, 30.0  # seconds
TURNS = 4.0  # changes of the value per second
MOST = (0.8, 1.02)


def serve() -> None:
    """The server's process: print the address, and serve until standard input ends."""
    import threading

    import gonio as go
    from gonio.viewer import server, stage

    application = server.Application(stage.of_models([go.Conductor(alpha=0.3)]), server.AccessControl("127.0.0.1"))
    one = server.Server(application, "127.0.0.1", 0, quiet=True)

    def say() -> None:
        while not one.started:
            time.sleep(0.01)
        print(json.dumps([one.port, application.access.token]), flush=True)
        sys.stdin.read()
        one.should_exit = True

    threading.Thread(target=say, daemon=True).start()
    one.serve_until_interrupted()


class Target:
    """The server as seen by its clients."""

    def __init__(self, port: int, token: str, pid: int = 0) -> None:
        self.port, self.token, self.pid = port, token, pid

    def connect(self) -> Any:
        address = f"ws://127.0.0.1:{self.port}/ws?token={self.token}"
        return websockets.connect(address, origin=f"http://127.0.0.1:{self.port}", compression=None, max_size=None)

    def memory(self) -> int:
        """Resident memory of the server in bytes."""
        return int(Path(f"/proc/{self.pid}/statm").read_text().split()[1]) * 4096


def scene(number: int, alpha: float, spp: int, size: tuple[int, int]) -> str:
    state = {
        "rows": [{"material": "m0", "balls": [{"alpha": alpha}]}],
        "lights": [{"type": "directional", "direction": [0, 0, 1], "irradiance": [1, 1, 1]}],
        "camera": {"target": [0, 0, 0], "distance": 6, "azimuth": 0, "elevation": 0, "fov": 30},
    }
    return json.dumps({"type": "scene", "id": number, "width": size[0], "height": size[1], "state": state, "spp": spp})


def header(message: str | bytes) -> dict[str, Any]:
    """The JSON of a message, without its pixels."""
    if isinstance(message, str):
        return dict(json.loads(message))
    (length,) = struct.unpack_from("<I", message)
    return dict(json.loads(message[4 : 4 + length]))


async def good(target: Target, seconds: float) -> list[float]:
    """Times at which the legitimate page, which keeps changing a value, received its frames."""
    times: list[float] = []
    async with target.connect() as socket:

        async def turn() -> None:
            for number in itertools.count(1):
                await socket.send(scene(number, 0.2 + 0.001 * (number % 500), 16, (160, 90)))
                await asyncio.sleep(1 / TURNS)

        async def take() -> None:
            async for message in socket:
                found = header(message)
                if found.get("type") == "error":
                    raise ValueError(found)
                if "frame" in found:
                    await socket.send(json.dumps({"type": "ack", "frame": found["frame"]}))
                    times.append(time.monotonic())

        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(turn(), take()), seconds)
    return times


async def again(what: Coroutine[Any, Any, None] | Any) -> None:
    """Reconnect whenever the server closes the connection."""
    while True:
        with contextlib.suppress(OSError, websockets.WebSocketException, EOFError):
            await what()
        await asyncio.sleep(0.5)


async def attack(target: Target) -> None:
    async def silent(said: bytes) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
        try:
            writer.write(said)
            await reader.read()
        finally:
            writer.close()

    async def page() -> None:
        async with target.connect() as socket:
            for number in itertools.count(1):
                await socket.send(scene(number, 0.3 + 0.01 * (number % 50), 16, (160, 90)))
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(5.0):
                        while True:
                            found = header(await socket.recv())
                            if "frame" in found:
                                await socket.send(json.dumps({"type": "ack", "frame": found["frame"]}))

    async def deaf() -> None:
        async with target.connect() as socket:
            await socket.send(scene(1, 0.4, 1 << 16, (320, 180)))
            await socket.wait_closed()

    async def rubbish() -> None:
        async with target.connect() as socket:
            while True:
                await socket.send("rubbish")

    async def scenes() -> None:
        async with target.connect() as socket:
            for number in itertools.count(1):
                await socket.send(scene(number, 0.4, 1 << 16, (320, 180)))

    crowd = [(silent, b""), (silent, b"GET / HTTP/1.1\r\nHost: 127")]
    silents = [lambda one=one, said=said: one(said) for one, said in crowd for _ in range(100)]
    pages = [page] * 43 + [deaf] * 3 + [rubbish] * 2 + [scenes] * 2
    await asyncio.gather(*(again(one) for one in [*silents, *pages]))


async def measure(target: Target, minutes: float) -> dict[str, Any]:
    await good(target, 10.0)  # compiles the kernels
    alone = len(await good(target, ALONE)) / ALONE
    memory: list[int] = []

    async def watch() -> None:
        while True:
            memory.append(target.memory())
            await asyncio.sleep(STRETCH)

    watching = asyncio.create_task(watch())
    command = [sys.executable, __file__, "--attack", str(target.port), target.token]
    started = time.monotonic()
    page = asyncio.create_task(good(target, 60 * minutes))
    await asyncio.sleep(1.0)  # now it has a session, like a user who opened the page first
    with subprocess.Popen(command) as others:
        times = await page
        others.kill()
    watching.cancel()
    stretches = [
        sum(a <= t - started < a + STRETCH for t in times) / STRETCH
        for a in (STRETCH * k for k in range(int(60 * minutes / STRETCH)))
    ]
    flat = memory[min(2, len(memory) - 1) :]
    return {
        "frames a second alone": alone,
        "kept, mean": statistics.fmean(stretches) / alone,
        "kept, worst half minute": min(stretches) / alone,
        "memory after a minute (MB)": flat[0] / 1e6,
        "memory at the end (MB)": flat[-1] / 1e6,
        "memory, ratio": flat[-1] / flat[0],
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--attack", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack:
        asyncio.run(attack(Target(int(options.attack[0]), options.attack[1])))
    if options.serve:
        serve()
        return 0
    command = [sys.executable, __file__, "--serve"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            port, token = json.loads(process.stdout.readline())
            found = asyncio.run(measure(Target(port, token, process.pid), options.minutes))
        finally:
            process.kill()
    if options.json:
        print(json.dumps(found))
    else:
        for name, value in found.items():
            print(f"{name:28} {value:10.3f}")
    return int(found["kept, mean"] < MOST[0] or found["memory, ratio"] > MOST[1])


if __name__ == "__main__":
    sys.exit(main())
