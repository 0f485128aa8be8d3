"""`go.material`, and every public function, take a text, a file, a description, a class and an instance."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.fitting.models import moving_of
from gonio.ops import inv_pi, vec3, where

OWN = """
import gonio as go
from gonio.ops import inv_pi, where


class Own(go.BSDF):
    albedo: go.Colour = go.spectrum(0.5, "share", high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)
"""


class Half:
    """A class without a base."""

    def eval(self, wo, wi):  # type: ignore[no-untyped-def]
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0) * vec3(0.5, 0.5, 0.5)


FORMS: dict[str, Any] = {
    "instance": go.Lambert(0.5),
    "class": go.Lambert,
    "own class": Half,
    "own instance": Half(),
    "dictionary": {"type": "lambert", "albedo": 0.5},
    "text": "lambert(albedo=0.5)",
    "sum": "lambert(albedo=.25)+lambert(albedo=.25)",
    "file": "half.json",
    "path": Path("half.json"),
    "document": {"type": "json", "file": "half.json"},
    "code": "own.py:Own",
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "half.json").write_text(json.dumps({"type": "lambert", "albedo": 0.5}))
    (tmp_path / "own.py").write_text(OWN)


@pytest.mark.sample(8)
@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_a_material(form: str) -> None:
    value = go.material(FORMS[form]).eval([0.0, 0.0, 1.0], [0.6, 0.0, 0.8])
    np.testing.assert_allclose(value, np.full((1, 3), 0.5 * 0.8 / np.pi), rtol=1e-6)


FUNCTIONS: dict[str, Callable[[Any], object]] = {
    "albedo": lambda m: go.albedo(m, 0.5),
    "bake": lambda m: go.bake(m, lut=["E"], resolution=4),
    "compare": lambda m: go.compare(m, m),
    "emit": go.emit,
    "explain": go.explain,
    "fit": moving_of,
    "measure": lambda m: go.measure(m, theta_i=[0, 40]),
    "plot": lambda m: go.plot(m, kind="slice", angles=[0.0]),
    "render": lambda m: go.render(m, spp=1, size=(4, 4)),
    "study": lambda m: go.study(m, {"camera.verticalFov": [30]}, spp=1, size=(4, 4)),
    "verify": lambda m: go.verify(m, law="linearity", quick=True, isolated=False),
    "view": go.view,
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_takes_every_form(name: str, form: str) -> None:
    if name == "fit" and form not in ("class", "dictionary", "file", "path", "instance"):
        pytest.skip("a text holds the values that it gives")
    FUNCTIONS[name](FORMS[form])


def test_parameters_override_its_values() -> None:
    assert go.material("alum-bronze", alpha=(0.1, 0.2, 0.3)).alpha == (0.1, 0.2, 0.3)  # type: ignore[attr-defined]
    gold = go.material(go.Conductor, preset="Au", alpha=0.1)
    assert gold == go.Conductor.preset("Au", alpha=0.1)
    assert go.material(gold, alpha=0.3).alpha == 0.3  # type: ignore[attr-defined]
    assert go.material("lambert+ggx", **{"b.alpha": 0.3}).b.alpha == 0.3  # type: ignore[attr-defined]
    assert go.material("kulla-conty", alpha=0.2).base.alpha == 0.2  # type: ignore[attr-defined]
    rows = np.array([[0.1] * 3, [0.2] * 3])
    assert np.array_equal(go.material("lambert", albedo=rows).albedo, rows)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (3, "3 given, a material expected"),
        (int, "int has no eval"),
        ({"alpha": 1}, 'an object with a "type" expected'),
        ({"type": "conductr"}, "did you mean 'conductor'"),
        ("missing.json", "missing.json"),
        (["lambert"], "a material expected"),
    ],
)
def test_anything_else_is_one_clear_error(given: Any, words: str) -> None:
    with pytest.raises(InputError) as caught:
        go.material(given)
    assert words in f"{caught.value} {caught.value.hint}"
