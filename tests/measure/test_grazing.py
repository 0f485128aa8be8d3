"""Tables over half vector and difference, made from tables that are wrong where light grazes."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.errors import InputError
from gonio.measure import SAMPLE, compare
from gonio.measure.tables.half_difference import centres, sampled

SHAPE = (12, 12, 16)


def paint(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """f cos theta_i of a matte paint, off by 0.01 wherever the light stands, as measurements are."""
    return np.repeat(0.8 / np.pi * wi[:, 2:] + 0.01, 3, axis=1)


@pytest.mark.parametrize("turn", [np.pi, 2.0 * np.pi])
def test_light_that_grazes_invents_nothing(turn: float) -> None:
    made = sampled(paint, SHAPE, turn)
    wo, wi = centres(SHAPE, turn)
    highest = np.maximum(wo[:, 2], wi[:, 2]) if turn < 4.0 else np.maximum(wi[:, 2], 0.03)
    told = made.valid.ravel() & (highest > 0.02)
    off = made.values.reshape(-1, 3)[told, 0] - 0.8 / np.pi
    assert np.all(off <= 0.02 / highest[told])  # 0.01 (c + c') / (c^2 + c'^2)


@pytest.mark.slow
def test_the_error_of_a_conversion_is_parted(shared: Path, tmp_path: Path) -> None:
    source = shared / "data/rgl/paper_white_rgb.bsdf"
    results = [go.convert(source, tmp_path / f"{phi}.binary", phi=phi) for phi in (180, 360)]
    half, full = (result.facts for result in results)
    assert 0.0 < half["resolution"] < half["error"] and 0.0 < half["reciprocity"] < half["error"]
    assert full["error"] < half["error"] and full["reciprocity"] == 0.0
    assert "by the asymmetry of the table; --phi 360 preserves it" in str(results[0]) and "phi" not in str(results[1])
    with pytest.raises(InputError, match="90 given for a merl file"):
        compare.convert(source, tmp_path / "x.binary", 90)


def test_the_range_of_phi_is_an_option_of_the_command_and_a_keyword(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InputError, match="90 given for a merl file"):
        go.convert(SAMPLE, tmp_path / "x.binary", phi=90)
    with pytest.raises(InputError, match="360 given for a gonio file"):
        go.convert(SAMPLE, tmp_path / "x.gonio", phi=360)
    material = tmp_path / "m.json"
    material.write_text('{"type": "lambert", "albedo": 0.5}')
    assert cli.run(["convert", str(material), "-o", str(tmp_path / "m.mtlx"), "--phi", "360"]) == 2
    assert "not a table of measured values" in capsys.readouterr().err
