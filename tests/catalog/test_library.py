"""The named materials: their figures are those of an independent implementation, and their names are understood."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import library, notation
from gonio.verify import quality
from gonio.verify.subject import Subject

from sphere import relative

ORACLE = Path(__file__).parent / "oracle/published.npz"
NAMES = [(fit, name) for fit, one in library.published().items() for name in one.materials]


def oracle() -> tuple[np.ndarray, np.ndarray, dict[tuple[str, str], np.ndarray]]:
    """(wo, wi, f of each fit and material), as tests/catalog/oracle/make_published.py has stored them."""
    with np.load(ORACLE) as data:
        return data["wo"], data["wi"], dict(zip(NAMES, data["f"].astype(float), strict=True))


def test_there_are_1302_fits_of_a_hundred_materials() -> None:
    assert len(NAMES) == 1302 and len(go.materials()) == 100
    assert {len(one.materials) for one in library.published().values()} == {86, 100}


def test_every_ninth_fit_is_what_the_independent_code_says() -> None:
    wo, wi, expected = oracle()
    for fit, name in NAMES[::9]:
        value = go.material(name, fit).f(wo, wi, precision="float64")
        assert relative(value, expected[fit, name], 1e-9).max() < 1e-5, (fit, name)


@pytest.mark.slow
def test_every_fit_is_what_the_independent_code_says() -> None:
    wo, wi, expected = oracle()
    for fit, name in NAMES:
        value = go.material(name, fit).f(wo, wi, precision="float64")
        assert relative(value, expected[fit, name], 1e-9).max() < 1e-5, (fit, name)


@pytest.mark.slow
def test_every_fit_of_bagher_samples_itself_no_worse_than_the_cosine_and_ten_times_better_in_the_median() -> None:
    found = [quality.of(Subject(go.material(name), name)) for name in go.materials()]
    factors = np.array([one.cosine for one in found if one is not None and one.cosine is not None])
    assert len(factors) == 100 and factors.min() >= 1.0 and np.median(factors) > 10.0


def test_a_name_is_bagher_s_fit_and_a_fit_may_be_named() -> None:
    assert go.material("alum-bronze") == go.model("shifted-gamma").preset("alum-bronze")
    other = go.material("alum-bronze", fit="low2012/lowsmooth_E2", eta=2.0)
    assert other.name == "low-smooth" and other.eta == 2.0 and other.b == 16711.814477
    assert go.fits("alum-bronze")[0] == "bagher2012/sgd" and len(go.fits("alum-bronze")) == 14
    assert "ngan2005/ward" not in go.fits("two-layer-gold")


def test_names_stand_where_materials_do() -> None:
    named = notation.named("mix(a=chrome,b=chrome:ngan2005/ward(alpha=.2),weight=.25)")[0]
    assert (named.a.name, named.b.name, named.b.alpha) == ("shifted-gamma", "ward", 0.2)
    assert notation.named("ward(preset=chrome:ngan2005/ward)")[0] == go.material("chrome", "ngan2005/ward")


@pytest.mark.parametrize(
    "text, said",
    [
        ("alum-bronz", "did you mean 'alum-bronze'"),
        ("alum-bronze:low2012/lowsmoth_E2", "did you mean 'low2012/lowsmooth_E2'"),
        ("two-layer-gold:ngan2005/ward", "ngan2005/ward does not include 'two-layer-gold'"),
        ("conducter", "did you mean 'conductor'"),
    ],
)
def test_an_unknown_name_is_an_error_with_the_nearest_known_one(text: str, said: str) -> None:
    with pytest.raises(go.InputError, match=said):
        notation.named(text)


def test_scenes_take_names(scene: Path) -> None:
    raw = json.loads((scene / "scene.json").read_text())
    raw["scene"]["shapes"][0]["material"] = {"type": "chrome:low2012/cooktorrance_E2"}
    (scene / "scene.json").write_text(json.dumps(raw))
    from gonio.scene.reader import read

    material = read(scene / "scene.json").contents.shapes[0].material
    assert material.model is go.model("cook-torrance") and material.preset == "chrome:low2012/cooktorrance_E2"


def test_a_misspelt_name_in_a_scene_is_told_with_its_place(scene: Path) -> None:
    raw = json.loads((scene / "scene.json").read_text())
    raw["scene"]["shapes"][0]["material"] = {"type": "alum-bronz"}
    (scene / "scene.json").write_text(json.dumps(raw))
    from gonio.scene.reader import read

    with pytest.raises(go.InputError, match="did you mean 'alum-bronze'") as error:
        read(scene / "scene.json")
    assert "/scene/shapes/0/material/type" in str(error.value)
