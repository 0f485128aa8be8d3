"""The cost of `gonio view`: the size of the page, its first picture, the live reference, the difference between the two
pictures, and the delay until a saved file is visible.

    python benchmarks/view.py [--json]

Needs a Chromium (see tests/browser.py). It draws in software (SwiftShader), so that results of two machines differ only
by their processors. Prints each value next to its limit, and exits with 1 if a limit is exceeded.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import itertools
import json
import platform
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from gonio.viewer import messages, page, server, stage
from gonio.viewer.reference import Reference

import browser

SIZE = (640, 360)


@dataclass
class Figure:
    """A measured value and its upper limit; None if it has no limit."""

    what: str
    value: float
    unit: str
    bar: float | None = None

    @property
    def passed(self) -> bool:
        return self.bar is None or self.value <= self.bar


def scene(what: stage.Stage, number: int, spp: int, shift: float = 0.0, size: tuple[int, int] = SIZE) -> messages.Scene:
    """The stage as requested by the page, with its alphas changed by `shift`."""
    rows = [
        {
            "material": row.material,
            "balls": [
                {path: [v + shift for v in values] for path, values in ball.values.items()} for ball in row.balls
            ],
        }
        for row in what.rows
    ]
    state = {"rows": rows, "lights": list(what.lights), "camera": what.framed()}
    text = {"type": "scene", "id": number, "width": size[0], "height": size[1], "state": state, "spp": spp}
    found = messages.parse(json.dumps(text))
    assert isinstance(found, messages.Scene)
    return found


def reference_figures(what: stage.Stage) -> Iterator[Figure]:
    """Values of the reference by itself, without server and page."""
    reference = Reference(what)

    def first(number: int) -> float:
        started = time.perf_counter()
        reference.show(scene(what, number, 1, shift=0.001 * number))
        reference.advance()
        messages.frame({}, reference.image())
        return time.perf_counter() - started

    first(0)
    yield Figure(
        "reference, first frame after a slider moved, 640 x 360", statistics.median(map(first, range(1, 9))), "s", 1.0
    )
    started = time.perf_counter()
    reference.show(scene(what, 99, 256))
    while not reference.done:
        reference.advance()
    yield Figure("reference, 256 samples a pixel", time.perf_counter() - started, "s")


@contextlib.contextmanager
def serving(what: stage.Stage) -> Iterator[str]:
    """Run a server in a thread; yields its address."""
    one = server.Server(server.Application(what, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, quiet=True)
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    while not one.started:
        time.sleep(0.01)
    try:
        yield one.url
    finally:
        one.should_exit = True
        thread.join()


# The time of the first frame by the page's own clock, which starts at navigation.
FIRST_PICTURE = """
const look = () => window.gonio?.frames > 0 ? (window.firstPicture = performance.now()) : requestAnimationFrame(look);
requestAnimationFrame(look);
"""

# From the change of a value until the drawn pixels can be read back, so that pending GPU work is included.
SLIDER = """async (alpha) => {
  const started = performance.now();
  const frames = gonio.frames;
  gonio.setState((state) => { state.slots[0].balls[2].set["base.alpha"] = [alpha, alpha]; });
  while (gonio.frames === frames) await new Promise(requestAnimationFrame);
  gonio.readPixels();
  return performance.now() - started;
}"""

_TEXT = """
  const text = (picture) => {
    const bytes = new Uint8Array(Float32Array.from(picture.data).buffer);
    let found = "";
    for (let i = 0; i < bytes.length; i += 32768) found += String.fromCharCode(...bytes.subarray(i, i + 32768));
    return [picture.width, picture.height, btoa(found)];
  };"""
PICTURE = f"async () => {{ {_TEXT} return text(await gonio.converge()); }}"
PICTURES = f"async () => {{ {_TEXT} return [text(await gonio.converge()), text(gonio.app.referencePicture())]; }}"


# Milliseconds to draw only one row, in many samples, alternating between rows; the readback waits for the GPU.
COST = """async () => {
  const least = [Infinity, Infinity];
  for (let round = 0; round < 20; round++) for (const solo of [0, 1]) {
    gonio.setState((state) => { state.solo = solo; });
    await gonio.converge(1);
    const scene = gonio.app.scene();
    const started = performance.now();
    for (let i = 0; i < 20; i++) gonio.app.renderer.step(scene, false);
    gonio.readPixels();
    least[solo] = Math.min(least[solo], performance.now() - started);
  }
  return least;
}"""

# A white furnace around surfaces of reflectance 1.
FURNACE = """() => gonio.setState((state) => {
  state.furnace = true;
  state.slots.forEach((slot, i) => Object.assign(slot.values, i === 0
    ? { "base.eta": [0, 0, 0], "base.k": [1, 1, 1] } : { eta: [0, 0, 0], k: [1, 1, 1] }));
})"""


def wait(tab: Any, condition: str, seconds: float = 300.0) -> None:
    """Wait until a condition holds, polling from outside, since the page's policy forbids evaluating text inside it."""
    end = time.monotonic() + seconds
    while not tab.evaluate(condition):
        if time.monotonic() > end:
            sys.exit(f"{condition} did not come to pass in {seconds:g} s")
        time.sleep(0.05)


def pixels(picture: list[Any]) -> np.ndarray:
    """The pixels of a picture from the page, (height, width, 4)."""
    width, height, data = picture
    return np.frombuffer(base64.b64decode(data), "<f4").reshape(height, width, 4)


def relmse(test: np.ndarray, reference: np.ndarray) -> tuple[float, int]:
    """relMSE over pixels that are fully covered by balls, as are their neighbors; and the number of these pixels."""
    factor = test.shape[0] // reference.shape[0]
    height, width = reference.shape[:2]
    test = test.reshape(height, factor, width, factor, 4).mean((1, 3))
    whole = np.minimum(test[..., 3], reference[..., 3]) >= 1 - 2**-11
    inside = whole.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inside &= np.roll(whole, step, axis)
    x, r = test[inside][:, :3].astype(float), reference[inside][:, :3].astype(float)
    return float(np.mean((x - r) ** 2 / (r**2 + 0.01))), int(inside.sum())


def fit(tab: Any) -> dict[str, int]:
    """Resize the window, initially 1280 x 720, so that the picture has SIZE; returns the size of the window."""
    wanted = {"width": 1280 - tab.evaluate("gonio.app.canvas.clientWidth") + SIZE[0],
              "height": 720 - tab.evaluate("gonio.app.canvas.clientHeight") + SIZE[1]}  # fmt: skip
    tab.set_viewport_size(wanted)
    wait(tab, f"gonio.app.canvas.width === {SIZE[0]} && gonio.app.canvas.height === {SIZE[1]}")
    return wanted


def page_figures(what: stage.Stage) -> Iterator[Figure]:
    """Values of the exported file and of the live page."""
    with tempfile.TemporaryDirectory() as folder, browser.chromium() as chromium:
        path = page.export(what, Path(folder) / "page.html")
        yield Figure("page, exported", path.stat().st_size / 1e6, "MB", 1.5)
        firsts = []
        for _ in range(3):
            tab = chromium.new_page(viewport={"width": 1280, "height": 720})
            tab.add_init_script(FIRST_PICTURE)
            tab.goto(path.as_uri())
            wait(tab, "window.firstPicture > 0")
            firsts.append(tab.evaluate("window.firstPicture") / 1000)
            tab.close()
        yield Figure("exported page, first picture", statistics.median(firsts), "s", 1.5)

        tab = chromium.new_page(viewport={"width": 1280, "height": 720})
        tab.goto(path.as_uri())
        wait(tab, "window.gonio?.frames > 0")
        wanted = fit(tab)
        times = [tab.evaluate(SLIDER, 0.1 + 0.02 * i) for i in range(20)]
        yield Figure("slider to picture, 640 x 360, median", statistics.median(times), "ms", 100.0)
        yield Figure("slider to picture, 640 x 360, worst of 20", max(times), "ms")
        compensated, plain = tab.evaluate(COST)
        yield Figure("GPU time of the compensated shader over the plain one's", compensated / plain, "x", 1.3)
        tab.evaluate("gonio.setState((state) => { state.solo = null; })")
        tab.evaluate(FURNACE)
        picture = pixels(tab.evaluate(PICTURE))
        upper = picture[: len(picture) // 2]
        off = np.abs(upper[upper[..., 3] >= 1 - 2**-11][:, :3] - 1.0).max()
        yield Figure("white furnace at F = 1, upper row's largest difference, of 255", off * 255, "", 1.0)
        tab.close()

        with serving(what) as url:
            tab = chromium.new_page(viewport=wanted)
            tab.goto(url)
            wait(tab, "window.gonio?.live?.status.done")
            test, reference = map(pixels, tab.evaluate(PICTURES))
            found, count = relmse(test, reference)
            samples = tab.evaluate("gonio.live.status.samples")
            yield Figure(f"raster against reference ({samples} spp), relMSE over {count} ball pixels", found, "", 1e-4)
            tab.close()


# A user-defined material: a Ward lobe, whose factor of 4 each save changes.
WARD = """import gonio as go
from gonio import ops
from gonio.ops import inv_pi, safe_div, sqr, where
from gonio.optics.frame import half_vector


class Ward(go.BSDF):
    kd: go.Colour = go.spectrum(0.3, "diffuse albedo", high=1.0)
    ks: go.Colour = go.spectrum(0.3, "specular albedo", high=1.0)
    slope: go.Number = go.number(0.3, "root mean square slope", low=0.01, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        h = half_vector(wo, wi)
        above = (wo.z > 0.0) & (wi.z > 0.0)
        tan2 = safe_div(1.0 - sqr(h.z), sqr(h.z))
        lobe = ops.exp(-tan2 / sqr(self.slope)) / (4.0 * sqr(self.slope))
        lobe = lobe * safe_div(inv_pi, ops.sqrt(ops.maximum(wo.z * wi.z, 0.0)))
        return where(above, (self.kd * inv_pi + self.ks * lobe) * wi.z, 0.0)
"""
SAVES = 20

# The times at which a save arrived and was drawn, by the clock that Python reads too. The readback waits for the GPU.
WATCH = """() => {
  const { app } = gonio;
  const [renew, refresh] = [app.renew.bind(app), app.onRefresh];
  app.renew = (made) => {
    window.came = Date.now() / 1000;
    renew(made);
    const { frames } = gonio;
    app.onRefresh = (what) => {
      if (what === "picture" && gonio.frames > frames) {
        gonio.readPixels();
        window.drawn = { revision: made.revision, time: Date.now() / 1000 };
        app.onRefresh = refresh;
      }
      refresh(what);
    };
  };
}"""


def saving_figures() -> Iterator[Figure]:
    """The time from saving a user's file to the new picture on the page, and its components."""
    with tempfile.TemporaryDirectory() as folder, browser.chromium() as chromium:
        path = Path(folder) / "ward.py"
        path.write_text(WARD)
        with serving(stage.of_targets([f"{path}:Ward"])) as url:
            tab = chromium.new_page(viewport={"width": 1280, "height": 720})
            tab.goto(url)
            wait(tab, "window.gonio?.live?.status.samples > 0")
            fit(tab)
            tab.evaluate(WATCH)
            parts: list[tuple[float, float, float]] = []
            for number in range(1, SAVES + 1):
                saved = time.time()
                path.write_text(WARD.replace("4.0 *", f"{4 + number / 100} *"))
                wait(tab, f"window.drawn?.revision === {number}")
                came, drawn = tab.evaluate("[came, drawn.time]")
                wait(tab, "gonio.live.status.samples > 0 && !gonio.app.reference.stale")
                parts.append((drawn - saved, came - saved, time.time() - saved))
            picture, on_the_page, reference = map(statistics.median, zip(*parts, strict=True))
            yield Figure(f"file saved to new picture, 640 x 360, median of {SAVES}", picture, "s", 0.5)
            yield Figure("file saved to its shader on the page, median", on_the_page, "s")
            yield Figure("file saved to the reference's first frame, median", reference, "s")
            tab.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print JSON")
    given = parser.parse_args()
    if browser.missing():
        sys.exit(browser.missing())
    what = stage.homework()
    figures = []
    for figure in itertools.chain(reference_figures(what), page_figures(what), saving_figures()):
        figures.append(figure)
        if not given.json:
            bar = (
                ""
                if figure.bar is None
                else f"  {'ok' if figure.passed else 'MISSED'}, bar {figure.bar:g} {figure.unit}"
            )
            print(f"{figure.what:<75} {figure.value:>10.4g} {figure.unit:<2}{bar}", flush=True)
    if given.json:
        print(json.dumps([{**vars(figure), "passed": figure.passed} for figure in figures]))
    else:
        print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    sys.exit(any(not figure.passed for figure in figures))


if __name__ == "__main__":
    main()
