"""Shaders in a browser give the values of float64 Python, at random directions and parameters, extremes included.

Bar: relative error <= max(1e-5, 8 times the change of the float64 value when the inputs move by one float32), where the
value is over 1e-6. `tests/shaders/parity.py` says how each result is judged.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import parity
import pytest
from gonio.material.recording import switched_off
from gonio.shaders import bundle
from variants import ALIKE, EVERY, FEW, LEAN

import browser
import materials

RUN = {"glsl": parity.run_glsl, "wgsl": parity.run_wgsl}

# a sampled direction is found by Newton's method in float32 (Beckmann), or on a grazing pair sees its facet from behind
SAMPLED = 3e-4
# and the waves of a film magnify what rounding has done to the facet between two directions, most at grazing angles and
# at the critical angle of a bubble
FRINGES = 4e-4

# a guide's density near the rim of its chart, where the logarithm of the distance from the axis is rounded: 3 times
GUIDED = 6.0
# the base of a coat sees refracted directions, that of a normal map rotated ones, which are rounded once more: of a
# narrow lobe that is 1.3 and 2.2 times
ROUNDED = 2.5
# a browser's pow, magnified by the exponent of the masking of sheen, which reaches 20 near the horizon: 1.4 times
SHEEN = 1.5
# of layers one lets through what another does not reflect, which has no digits left where light grazes (.02 degrees),
# nor where an index is all but 1, as of a specular_weight of 0
LAYERED = 6e-3


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with browser.page() as opened:
        yield opened


def _check(page: Any, lang: str, name: str, side: int, lean: bool = False) -> None:
    material = LEAN[name] if lean else EVERY[name]
    made = bundle(material, lang, lean=lean)
    draws = parity.draw(material, np.random.default_rng(7), side * side, switched_off(material) if lean else ())
    got = RUN[lang](page, made, draws)
    verdicts = parity.judge(material, draws, got, [term["name"] for term in made.manifest["terms"]])
    assert {"eval", "pdf", "sample.wi", "sample.weight"} <= set(verdicts)
    for result, v in verdicts.items():
        share = SAMPLED if result.startswith("sample") else FRINGES if name.startswith("film") else 0.0
        share = max(share, LAYERED if lean or name in materials.COMPOSED else 0.0)
        share += 1.5 / len(draws.wo) if share else 0.0
        inputs = {path: rows[v.draw].tolist() for path, rows in draws.fields.items()}
        where = f"{result} at {draws.wo[v.draw].tolist()}, {draws.wi[v.draw].tolist()}, u {draws.u[v.draw].tolist()}"
        text = f"{where}, {inputs}: {v.got} in the shader, {v.right} in float64, {v.ratio:.3g} of what is allowed"
        if material.guided and v.ratio <= GUIDED and not result.startswith("eval"):
            continue
        if (("coat" in name or "normal-map" in name) and v.ratio <= ROUNDED) or ("sheen" in name and v.ratio <= SHEEN):
            continue
        assert v.share <= share, f"{text}; {v.share:.2g} of the draws"


# code that others have: the waves of film-on-metal, the tables of kulla-conty in WGSL, phong, glass-turned
SPARED = {"film-on-glass", "kulla-conty", "blinn-phong", "modified-phong", "glass-ggx-smith-correlated"}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", materials.each(FEW, set(FEW) - set(ALIKE) - SPARED))
def test_glsl_gives_the_values_of_python(page: Any, name: str) -> None:
    _check(page, "glsl", name, 64)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "name",
    [
        "metal-bounded-turned",
        "glass-turned",
        "mix-with-mirror",
        "phong",
        pytest.param("kulla-conty", marks=pytest.mark.slow),
    ],
)
def test_wgsl_gives_the_values_of_python(page: Any, name: str) -> None:
    if page.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
        pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
    _check(page, "wgsl", name, 64)


@pytest.mark.slow
@pytest.mark.parametrize("lang", ["glsl", "wgsl"])
@pytest.mark.parametrize("name", EVERY)
def test_every_model_at_65536_draws(page: Any, name: str, lang: str) -> None:
    _check(page, lang, name, 256)


@pytest.mark.slow
def test_a_lean_shader_gives_the_values_of_python(page: Any) -> None:
    _check(page, "glsl", "openpbr", 64, lean=True)


@pytest.mark.slow
@pytest.mark.parametrize("lang", ["glsl", "wgsl"])
@pytest.mark.parametrize("name", LEAN)
def test_every_lean_shader_at_65536_draws(page: Any, name: str, lang: str) -> None:
    _check(page, lang, name, 256, lean=True)
