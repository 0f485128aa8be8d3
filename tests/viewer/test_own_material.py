"""A stranger's material on the page: sliders, choices, presets, inner materials, and a distribution of its own."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage
from web_page import WIDE, Page

WARD = '''import gonio as go
from gonio.ops import exp, function, inv_pi, log, maximum, normalize, pi, safe_div, sincos, sqr, sqrt, vec3, where
from gonio.optics.frame import half_vector, rotate
from gonio.optics.ndf import distribution


@go.register
class Narrow(go.NDF):
    """Gaussian slopes of half the width, without masking."""

    name = "narrow"

    @function
    def D(self, m, alpha):
        """Density of normals."""
        cos2 = maximum(sqr(m.z), 1e-4)
        slopes = 4.0 * (sqr(m.x / alpha.x) + sqr(m.y / alpha.y)) / cos2
        return where(m.z > 0.0, 4.0 * inv_pi * exp(-slopes) / (alpha.x * alpha.y * sqr(cos2)), 0.0)

    def Lambda(self, v, alpha):
        return 0.0 * v.z

    def sample(self, u1, u2, alpha):
        r = 0.5 * sqrt(-log(maximum(1.0 - u1, 1e-7)))
        s, c = sincos(2.0 * pi * u2)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, 1.0 + 0.0 * r))


class Ward(go.BSDF):
    """Ward's anisotropic gloss over another material (Ward1992)."""

    ks: go.Colour = go.spectrum(0.3, "specular albedo", high=1.0)
    alpha: go.Width = go.width((0.2, 0.4), "slopes along x and y", low=0.02)
    rotation: go.Angle = go.angle(0.4, "turn of the slopes")
    ndf: str = go.choice("narrow", "distribution of normals", lambda: go.NDF.family.titles())
    twice: bool = go.flag(False, "double the gloss")
    base: go.BSDF = go.bsdf("what lies below", go.Lambert(albedo=(0.6, 0.3, 0.1)))

    @classmethod
    def presets(cls):
        return {
            "blue": go.Preset("blue paint", {"ks": (0.05, 0.05, 0.3)}),
            "bold": go.Preset("bold", {"ks": 0.2, "twice": True}),
        }

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        h = rotate(half_vector(wo, wi), self.rotation)
        gloss = 0.25 * distribution(self.ndf).D(h, self.alpha) * safe_div(1.0, sqrt(maximum(wo.z * wi.z, 1e-6)))
        gloss = where((wo.z > 0.0) & (wi.z > 0.0), gloss * wi.z, 0.0)
        return self.ks * (2.0 * gloss if self.twice else gloss) + self.base.eval(wo, wi, mode)
'''


@pytest.fixture(scope="module")
def opened(chrome: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("own")
    (folder / "ward.py").write_text(WARD)
    what = stage.of_targets([f"{folder / 'ward.py'}:Ward"])
    material = what.materials["m0"]
    wider = {"ndf": ("narrow", "ggx"), "twice": (False, True)}
    what = stage.Stage(what.title, {"m0": stage.Material(material.title, material.bsdf, wider)}, what.rows)
    tab = chrome.new_page(viewport=WIDE)
    yield what, Page(tab, page_file.export(what, folder / "page.html"))
    tab.close()
    go.NDF.family.remove("narrow")


def agrees(page: Page, bsdf: go.BSDF) -> bool:
    """Whether the page's shader says what Python does, with what is set on the page."""
    rng = np.random.default_rng(1)
    z, phi = rng.uniform(0.2, 1.0, (2, 200)), rng.uniform(0.0, 2 * np.pi, (2, 200))
    wo, wi = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=-1)
    given = [wo.ravel().tolist(), wi.ravel().tolist()]
    found = np.reshape(page.tab.evaluate("([wo, wi]) => gonio.evaluate(0, 2, wo, wi)", given)["value"], (-1, 3))
    return np.allclose(found, bsdf.eval(wo, wi, precision="float64"), rtol=2e-3, atol=1e-5)


@pytest.mark.slow
def test_its_sliders_choices_and_inner_materials_do_what_python_says(opened: tuple[stage.Stage, Page]) -> None:
    what, page = opened
    bsdf = stage.replaced(what.materials["m0"].bsdf, what.rows[0].balls[2].values)
    # the gloss has presets to choose from: the balls differ in what lies below
    assert [dict(ball.values) for ball in what.rows[0].balls[:2]] == [{"base.albedo": [v] * 3} for v in (0.1, 0.3)]
    names = [name.split()[0] for name in page.tab.locator(".lil-name").all_inner_texts()]
    assert names[:8] == ["Preset", "albedo", "ks", "roughness", "roughness", "rotation", "ndf", "twice"]
    assert agrees(page, bsdf)
    page.set("s.slots[0].values.alpha = [0.1, 0.6]; s.slots[0].values.rotation = 1.1;")
    bsdf = stage.replaced(bsdf, {"alpha": [0.1, 0.6], "rotation": 1.1})
    assert agrees(page, bsdf)
    page.control("ndf").locator("select").select_option("ggx")
    assert agrees(page, stage.replaced(bsdf, {"ndf": "ggx"}))
    page.control("ndf").locator("select").select_option("narrow")
    assert agrees(page, bsdf)
    assert page.problems == []


@pytest.mark.slow
def test_its_presets_set_values_and_choices(opened: tuple[stage.Stage, Page]) -> None:
    what, page = opened
    page.reset()
    start = stage.replaced(what.materials["m0"].bsdf, what.rows[0].balls[2].values)
    preset = page.control("Preset").locator("select")
    preset.select_option("bold")
    assert agrees(page, stage.replaced(start, {"ks": [0.2] * 3, "twice": True}))
    assert preset.input_value() == "bold"
    preset.select_option("blue paint")
    assert page.state("slots[0].values.ks") == [0.05, 0.05, 0.3]
    page.set("s.slots[0].values.ks = [0.2, 0.9, 0.9];")  # bold's 0.2 stands for all three
    assert preset.input_value() == ""


@pytest.mark.slow
def test_a_preset_of_what_the_balls_differ_in_sets_them_all(opened: tuple[stage.Stage, Page]) -> None:
    _, page = opened
    page.reset()
    page.set("s.slots[0].balls.forEach((ball, i) => { ball.set = { ks: [0.1 * i, 0.1 * i, 0.1 * i] }; });")
    page.control("Preset").locator("select").select_option("blue paint")
    assert page.tab.evaluate("gonio.state.slots[0].balls.map((ball) => ball.set.ks)") == [[0.05, 0.05, 0.3]] * 5
