"""The page's balls are as bright as the path-traced reference's: those of every model, choice, layer and preset."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import brightness
import numpy as np
import pytest
from brightness import BAR, Show
from gonio.material import models
from gonio.viewer import page as page_file
from gonio.viewer import reference, server, stage
from test_web_picture import python_picture
from web_page import COARSE, PIXELS, WIDE, Page, decoded

MODELS = [name for name in models() if not models()[name].stochastic]
SAMPLES = 64
FEW = 32  # the light of a whole ball is a mean over hundreds of pixels
LIVE = 16  # the same shaders as in an exported page: what may differ is what the server adds


def lean(what: stage.Stage, path: Path) -> Path:
    """An exported page without the variants of every layer, which take long to write."""
    data = page_file.page_data(what, socket="/none")
    path.write_text(page_file.html({**data, "mode": "export", "socket": None}), encoding="utf-8")
    return path


@pytest.mark.slow
def test_long_materials_and_those_with_tables_of_their_own_are_lit(chrome: Any, tmp_path: Path) -> None:
    """Two lamps on materials that are called in no loop, and coats over bases of two widths."""
    coats = [{"base.alpha": [0.05, 0.05]}, {"base.alpha": [0.6, 0.6]}]
    rows = {"disney2015": [{}, {"metallic": 0.5}], "coat": coats}
    what = stage.Stage(
        "",
        {name: stage.Material(name, stage.of_targets([name]).materials["m0"].bsdf) for name in rows},
        tuple(stage.Row(name, name, tuple(stage.Ball("", ball) for ball in balls)) for name, balls in rows.items()),
        lights=(brightness.SUN, brightness.POINT),
    )
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    page = Page(tab, lean(what, tmp_path / "page.html"))
    assert any(len(text) > 40_000 for text in page.tab.evaluate("() => gonio.app.balls().map((b) => b.shader.text)"))
    picture = page.picture(FEW)
    truth = python_picture(what, [*what.lights], picture.shape[1::-1], 4)
    shown = [(name, {}, balls) for name, balls in rows.items()]
    found = brightness.ratios(shown, what.framed(), picture, truth)
    assert abs(found - 1).max() < BAR, found
    assert page.problems == []
    tab.close()


# --------------------------------------------------------------------------- everything


def checked(
    what: stage.Stage, shows: list[Show], compared: Callable[[Any, Any, Any, int], np.ndarray], samples: int = SAMPLES
) -> list[str]:
    """What is out of range. A highlight narrower than a pixel is noise in both pictures: a ball that is out of range
    among many is looked at alone, larger."""
    wrong = []
    for show in shows:
        for lamp in show.lamps:
            rows = brightness.rows_of(show)
            found = compared(rows, [lamp], brightness.framed(what, rows), samples)
            far = ~(abs(found - 1) < BAR)
            for ball in np.flatnonzero(far):
                alone = [("m0", show.choices, [show.balls[ball]])]
                (ratio,) = compared(alone, [lamp], brightness.framed(what, alone), 4 * samples)
                if not abs(ratio - 1) < BAR:
                    wrong.append(f"{show.label}, {lamp['type']}, {show.balls[ball]}: {found[ball]:.3f}, {ratio:.3f}")
            print(f"{show.label}, {lamp['type']}: {found.min():.4f} to {found.max():.4f}", flush=True)
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_an_exported_page_is_as_bright_as_the_reference(chrome: Any, tmp_path: Path, name: str) -> None:
    what = stage.of_targets([name])
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    tab.set_default_timeout(600_000)
    page = Page(tab, page_file.export(what, tmp_path / "page.html"))
    tracer = reference.Reference(what)

    def compared(rows: Any, lights: Any, camera: Any, spp: int) -> np.ndarray:
        page.tab.evaluate(brightness.SHOW, [rows, lights, camera])
        assert page.tab.evaluate(brightness.LACKING) == 0 or "coat" in name
        picture = page.picture(SAMPLES)
        truth = brightness.traced(tracer, rows, lights, camera, picture.shape[1::-1], spp)
        return brightness.ratios(rows, camera, picture, truth)

    shows = list(brightness.shows(what))
    if what.materials["m0"].bsdf.fixed:  # tables of metals that are no ball's are a server's to find
        shows = [show for show in shows if not show.label.startswith("presets")]
    assert checked(what, shows, compared) == []
    assert page.problems == []
    tab.close()


@pytest.fixture
def live(chrome: Any) -> Iterator[Callable[[stage.Stage], Any]]:
    """Opens the page of a server on a stage."""
    opened = []

    def open_page(what: stage.Stage) -> Any:
        one = server.Server(server.Application(what, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, quiet=True)
        thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
        thread.start()
        while not one.started:
            time.sleep(0.01)
        tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
        opened.append((one, thread, tab))
        tab.set_default_timeout(600_000)
        tab.goto(one.url)
        return tab

    yield open_page
    for one, thread, tab in opened:
        tab.close()
        one.should_exit = True
        thread.join(20)


REFERENCE = (
    f"async () => {{ const gonio = {{ converge: () => window.gonio.app.referencePicture() }}; return ({PIXELS})(); }}"
)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_a_live_page_is_as_bright_as_its_reference(live: Any, name: str) -> None:
    what = stage.of_targets([name])
    tab = live(what)

    def wait(condition: str) -> None:
        end = time.monotonic() + 900
        while not tab.evaluate(condition):
            assert time.monotonic() < end, condition
            time.sleep(0.1)

    wait("() => window.gonio?.frames > 0")

    def compared(rows: Any, lights: Any, camera: Any, spp: int) -> np.ndarray:
        tab.evaluate(brightness.SHOW, [rows, lights, camera])
        wait(f"() => ({brightness.LACKING})() === 0")
        picture = decoded(tab.evaluate(PIXELS, spp))
        wait(
            f"() => {{ const r = gonio.app.referencePicture(); return r && !r.stale && r.samples >= {min(spp, 512)}; }}"
        )
        truth = decoded(tab.evaluate(REFERENCE))
        factor = len(picture) // len(truth)
        height, width = truth.shape[:2]
        return brightness.ratios(rows, camera, picture.reshape(height, factor, width, factor, 4).mean((1, 3)), truth)

    assert checked(what, list(brightness.shows(what)), compared, LIVE) == []
