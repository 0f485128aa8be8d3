"""Tables over half vector and difference, made from tables that are wrong where light grazes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gonio.errors import InputError
from gonio.measure import compare
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
    half, whole = (compare.convert(source, tmp_path / f"{phi}.binary", phi) for phi in (180, 360))
    assert 0.0 < half.resolution < half.error and 0.0 < half.reciprocity < half.error
    assert whole.error < half.error and whole.reciprocity == 0.0
    with pytest.raises(InputError, match="90 given for a merl file"):
        compare.convert(source, tmp_path / "x.binary", 90)
