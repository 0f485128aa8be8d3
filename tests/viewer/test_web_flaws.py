"""What is no light is not shown as light: a pattern and a line for it; and a sign while nothing can be drawn yet."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import PIL.Image
import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage
from web_page import COARSE, WIDE, Page

BROKEN = '''
import gonio as go
from gonio import ops

class Broken(go.BSDF):
    """The root of what is below zero where the light comes from the right."""

    albedo: go.Colour = go.spectrum(default=0.5, doc="share of light", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        lit = self.albedo * ops.sqrt(wi.x + 0.5) * wi.z * 0.3
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), lit, 0.0)
'''
# lamps never reach the shader, as when a driver drops a uniform
UNLIT = """const set = WebGL2RenderingContext.prototype.uniform3fv;
WebGL2RenderingContext.prototype.uniform3fv = function (place, values) {
  if (values.length < 24) set.call(this, place, values);
};"""
WATCHED = """addEventListener("DOMContentLoaded", () => {
  window.said = [];
  new MutationObserver(() => {
    const sign = document.querySelector(".busy");
    const text = !sign || sign.hidden ? "" : sign.textContent.replace(/ · .*/, "");
    if (text !== window.said.at(-1)) window.said.push(text);
  }).observe(document.body, { subtree: true, childList: true, attributes: true, characterData: true });
});"""


@pytest.fixture
def opened(chrome: Any, tmp_path: Path) -> Iterator[Any]:
    """Opens the exported page of a material, one ball of it, after a script."""
    contexts = []

    def open_page(material: go.BSDF, script: str = "") -> Page:
        row = stage.Row("one", "m0", (stage.Ball("ball"),))
        what = stage.Stage("one ball", {"m0": stage.Material(type(material).__name__, material)}, (row,))
        contexts.append(chrome.new_context(viewport=WIDE, device_scale_factor=COARSE))
        contexts[-1].add_init_script(script)
        return Page(contexts[-1].new_page(), page_file.export(what, tmp_path / "page.html"))

    yield open_page
    for context in contexts:
        context.close()


def magenta(page: Page) -> int:
    """Pixels of the pattern on the screen."""
    shown = np.asarray(PIL.Image.open(io.BytesIO(page.tab.locator("canvas.picture").screenshot())).convert("RGB"), int)
    return int(((shown[..., 0] > 200) & (shown[..., 1] < 60) & (shown[..., 2] > 150)).sum())


def line(page: Page, seconds: float = 30.0) -> str:
    """What the page says of flaws, as soon as it does."""
    end = time.monotonic() + seconds
    while not (text := page.tab.locator(".flaws").text_content()) and time.monotonic() < end:
        page.tab.wait_for_timeout(20)
    return str(text)


@pytest.mark.slow
def test_values_that_are_no_numbers_are_a_pattern_and_count_as_such(opened: Any, tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN)
    page = opened(stage.of_targets([f"{tmp_path / 'broken.py'}:Broken"]).materials["m0"].bsdf)
    picture = page.picture(8)
    bad = np.isnan(picture[..., :3]).any(-1)
    assert 0.05 < bad.sum() / (picture[..., 3] > 0).sum() < 0.95
    said = r"A 1: \d+ pixels have no finite value"
    assert re.fullmatch(said + r" \(checkered\)", line(page))
    assert magenta(page) > 0.3 * bad.sum()
    assert page.problems and all(re.fullmatch(said, problem) for problem in page.problems)
    # beside a reference that is right everywhere else
    page.tab.evaluate("() => gonio.app.store.set('dock.open', 'compare')")
    page.tab.wait_for_timeout(300)
    page.picture(8)
    page.tab.evaluate(
        """() => {
          const picture = gonio.app.picture();
          const cover = (i) => picture.data[i - (i % 4) + 3];
          const data = picture.data.map((v, i) => (Number.isNaN(v) ? 0.2 * cover(i) : v));
          gonio.app.setReference({ ...picture, data, done: true });
        }"""
    )
    end = time.monotonic() + 30
    while page.tab.evaluate("() => gonio.comparison().figures?.flip ?? null") is None and time.monotonic() < end:
        page.tab.wait_for_timeout(50)
    figures = page.tab.evaluate("() => gonio.comparison().figures")
    assert figures["rmse"] < 0.05 and figures["broken"] > 0 and figures["flip"] > 0.1


@pytest.mark.slow
def test_black_by_a_fault_is_told_from_black_by_nature(opened: Any) -> None:
    """No lamp reached long shaders, and five black balls stood there without a word."""
    page = opened(go.Lambert(), UNLIT)
    assert page.picture(4)[..., :3].max() == 0
    assert line(page) == "A 1: black, although the material scatters the incident light (checkered)"
    assert magenta(page) > 100
    assert len(page.problems) == 1
    mirror = opened(go.Mirror())
    assert mirror.picture(4)[..., :3].max() == 0
    assert mirror.tab.locator(".flaws").is_hidden() and magenta(mirror) == 0
    mirror.set("s.lights[0].direction = [0.3, 0.2, -1]; s.slots[0].values.albedo = [0.5, 0.5, 0.5]")
    assert mirror.problems == []


@pytest.mark.slow
def test_a_page_says_that_it_compiles(opened: Any) -> None:
    page = opened(go.model("film-conductor")(), WATCHED)
    page.picture(4)
    page.tab.wait_for_function("() => document.querySelector('.busy').hidden")
    said = page.tab.evaluate("() => window.said.filter((text) => text)")
    assert said and set(said) == {"Compiling the shader of FilmConductor"}
    assert page.problems == []


@pytest.mark.slow
def test_a_value_that_this_page_has_no_tables_for_stays(opened: Any) -> None:
    page = opened(go.model("coat")(base=go.Conductor(alpha=0.2)))  # type: ignore[call-arg]
    before = page.picture(4)
    page.control("roughness").first.locator("input[type=number]").fill("0.9")
    page.tab.keyboard.press("Enter")
    assert "Row A is unchanged" in str(page.tab.locator(".toast").text_content())
    assert page.state("slots[0].values") == {}
    assert np.array_equal(page.picture(4), before)
    assert page.problems == []
