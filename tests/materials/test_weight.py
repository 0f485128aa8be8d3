"""The law weight = eval / pdf, ray by ray, and its conventions for delta and failed samples."""

from __future__ import annotations

import numpy as np
import pytest

from materials import ALL, EACH, IDEAL, each
from sphere import random_directions, random_numbers

COUNT = 20_000
WO, U = random_directions(COUNT, 11), random_numbers(COUNT, 11)


BOTH_MODES = [
    pytest.param(name, mode, marks=() if name in EACH else pytest.mark.slow)
    for mode in ("radiance", "importance")
    for name, material in ALL.items()
    if mode == "radiance" or material.transmits
]


@pytest.mark.sample(6)
@pytest.mark.parametrize(("name", "mode"), BOTH_MODES)
def test_weight_is_eval_over_pdf_in_float64(name: str, mode: str) -> None:
    material = ALL[name]
    s = material.sample(WO, U, mode, precision="float64")
    value = material.eval(WO, s.wi, mode, precision="float64")
    pdf = material.pdf(WO, s.wi, precision="float64")
    drawn = (s.pdf > 0) & ~s.delta
    np.testing.assert_allclose(pdf[drawn], s.pdf[drawn], rtol=1e-9)
    # what is compared is the product: a weight may be small where eval is, both by the same factor
    np.testing.assert_allclose(s.weight[drawn] * s.pdf[drawn, None], value[drawn], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(s.wi, axis=1), 1.0, rtol=1e-10)


@pytest.mark.sample(12)
@pytest.mark.parametrize("name", each(ALL))
def test_failed_samples_have_neither_weight_nor_density(name: str) -> None:
    s = ALL[name].sample(WO, U)
    failed = s.pdf <= 0
    assert not s.weight[failed].any() and not s.pdf[failed].any() and not s.delta[failed].any()


@pytest.mark.parametrize("name", IDEAL)
def test_delta_samples_have_a_probability_while_eval_and_pdf_are_zero(name: str) -> None:
    material = IDEAL[name]
    wo = WO if material.transmits else WO * np.sign(WO[:, 2:])
    s = material.sample(wo, U, precision="float64")
    assert s.delta.all() and (s.pdf > 0).all() and (s.pdf <= 1).all()
    assert not material.eval(wo, s.wi, precision="float64").any()
    assert not material.pdf(wo, s.wi, precision="float64").any()


@pytest.mark.sample(6)
@pytest.mark.parametrize(("name", "mode"), BOTH_MODES)
def test_weight_is_eval_over_pdf_in_float32(name: str, mode: str) -> None:
    """For every ray and parameter: both are made of the same rounded wi."""
    material = ALL[name]
    s = material.sample(WO, U, mode)
    value, pdf = material.eval(WO, s.wi, mode), material.pdf(WO, s.wi)
    drawn = (s.pdf > 0) & ~s.delta & (pdf > 0)
    if not drawn.any():
        assert name in IDEAL
        return
    # below 1e-30 the values lose digits to float32's smallest numbers
    whole = np.where(value[drawn] > 1e-30, value[drawn] / pdf[drawn, None], s.weight[drawn])
    np.testing.assert_allclose(s.weight[drawn], whole, rtol=1e-5)
