"""The server's page in a real browser: the reference beside the picture, and what a hostile page gets."""

from __future__ import annotations

import base64
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from gonio.viewer import server, stage

import browser

# the raster picture and the reference, as [width, height, base64 of float32 RGBA]
PICTURES = """async () => {
  const text = (picture) => {
    const bytes = new Uint8Array(Float32Array.from(picture.data).buffer);
    let found = "";
    for (let i = 0; i < bytes.length; i += 32768) found += String.fromCharCode(...bytes.subarray(i, i + 32768));
    return [picture.width, picture.height, btoa(found)];
  };
  return [text(await gonio.converge()), text(gonio.app.referencePicture())];
}"""

HOSTILE = """async (address) => {
  const found = {};
  try { found.text = await (await fetch(address)).text(); } catch (error) { found.fetch = String(error); }
  try { found.opaque = await (await fetch(address, { mode: "no-cors" })).text(); } catch (error) { found.opaque = ""; }
  found.socket = await new Promise((resolve) => {
    const socket = new WebSocket(address.replace("http", "ws").replace("/?", "/ws?"));
    socket.onopen = () => resolve("open");
    socket.onerror = () => resolve("refused");
  });
  found.frame = await new Promise((resolve) => {
    const frame = document.createElement("iframe");
    const text = () => String(frame.contentDocument?.body?.innerText);
    frame.onload = () => { try { resolve(text()); } catch { resolve("closed"); } };
    frame.src = address;
    document.body.append(frame);
  });
  return found;
}"""


class Live:
    """A server in a thread, and its page in a tab."""

    def __init__(self, one: server.Server, tab: Any) -> None:
        self.one, self.tab = one, tab
        self.problems: list[str] = []
        tab.on("console", lambda m: self.problems.append(m.text) if m.type == "error" else None)
        tab.on("pageerror", lambda error: self.problems.append(str(error)))

    def wait(self, condition: str, seconds: float = 60.0) -> None:
        """Asked from outside: the page's policy forbids to evaluate text within it."""
        end = time.monotonic() + seconds
        while not self.tab.evaluate(condition):
            assert time.monotonic() < end, f"not within {seconds} s: {condition}; {self.problems}"
            time.sleep(0.02)

    def pictures(self) -> tuple[np.ndarray, np.ndarray]:
        """(raster, reference), (height, width, 4), of one size."""
        found = []
        for width, height, data in self.tab.evaluate(PICTURES):
            found.append(np.frombuffer(base64.b64decode(data), "<f4").reshape(height, width, 4).astype(float))
        test, reference = found
        factor = test.shape[0] // reference.shape[0]
        height, width = reference.shape[:2]
        return test.reshape(height, factor, width, factor, 4).mean((1, 3)), reference


@pytest.fixture(scope="module")
def live() -> Iterator[Live]:
    with browser.chromium() as chromium:
        application = server.Application(stage.homework(), server.AccessControl("127.0.0.1"))
        one = server.Server(application, "127.0.0.1", 0, quiet=True)
        thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
        thread.start()
        while not one.started:
            time.sleep(0.01)
        opened = Live(one, chromium.new_context(viewport={"width": 800, "height": 300}).new_page())
        opened.tab.goto(one.url)
        opened.wait("window.gonio?.frames > 0")
        try:
            yield opened
        finally:
            opened.tab.close()
            one.should_exit = True
            thread.join(20)


@pytest.mark.slow
def test_the_picture_is_the_path_traced_one(live: Live) -> None:
    live.wait("gonio.live.status.samples >= 256")
    raster, reference = live.pictures()
    whole = np.minimum(raster[..., 3], reference[..., 3]) >= 1 - 2**-11
    inside = whole.copy()  # without silhouettes
    for axis in (0, 1):
        for step in (-1, 1):
            inside &= np.roll(whole, step, axis)
    assert inside.sum() > 5000
    test, truth = raster[inside][:, :3], reference[inside][:, :3]
    assert np.mean((test - truth) ** 2 / (truth**2 + 0.01)) < 1e-4
    # the compensated row above is brighter, the more so the rougher
    green = np.where(inside, reference[..., 1], 0.0)
    green = green[:, np.flatnonzero(reference[..., 3].any(0))]  # from the first ball's edge to the last one's
    rows = [[part.sum() for part in np.array_split(half, 5, 1)] for half in np.array_split(green, 2)]
    gain = np.divide(*rows)
    assert np.all(np.diff(gain) > 0) and gain[0] < 1.1 and gain[-1] > 1.5
    assert live.problems == []


@pytest.mark.slow
def test_the_reference_follows_the_sliders(live: Live) -> None:
    live.wait("gonio.live.status.samples > 0")
    before = live.tab.evaluate("gonio.live.status.samples")
    assert before > 0
    for i in range(10):
        live.tab.evaluate("(a) => gonio.setState((s) => { s.slots[1].balls[4].set.alpha = [a, a]; })", 0.05 + 0.02 * i)
        live.tab.wait_for_timeout(60)
    live.wait("gonio.live.status.samples >= 64")
    raster, reference = live.pictures()
    whole = np.minimum(raster[..., 3], reference[..., 3]) >= 1 - 2**-11
    error = np.abs(raster - reference)[..., :3][whole] / (reference[..., :3][whole] + 0.1)
    assert np.median(error) < 0.01  # a reference of the old widths is far off on one ball of ten
    assert np.mean(error > 0.2) < 0.01
    assert live.problems == []


def test_a_page_elsewhere_gets_nothing(live: Live) -> None:
    """The worst case: it knows the address with its token, and asks from another port of this machine."""
    sessions = len(live.one.application.sessions)
    with browser.serving() as address:
        tab = live.tab.context.new_page()
        tab.goto(address)
        found = tab.evaluate(HOSTILE, live.one.url)
        tab.close()
    assert "text" not in found and found["fetch"]
    assert found["opaque"] == ""
    assert found["socket"] == "refused"
    assert "gonio" not in found["frame"].lower() and "roughness" not in found["frame"]
    assert len(live.one.application.sessions) == sessions


def test_the_page_may_not_reach_elsewhere(live: Live) -> None:
    with browser.serving() as address:
        tried = "(a) => fetch(a).then(() => 'reached', () => 'refused')"
        assert live.tab.evaluate(tried, address) == "refused"
    live.problems.clear()  # the browser says so on the console
