"""The law of reciprocity: f(wo, wi) / eta_o^2 = f(wi, wo) / eta_i^2, in float64; and who breaks it says so."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from materials import FINITE, each
from sphere import random_directions

COUNT = 20_000
WO, WI = random_directions(COUNT, 81), random_directions(COUNT, 82)


def _index(material: go.BSDF, w: np.ndarray) -> np.ndarray:
    """Index of refraction on w's side, the outside's being 1."""
    if isinstance(material, go.Mix):
        return np.maximum(_index(material.a, w), _index(material.b, w))
    if "base" in material.parameters():
        return _index(material.base, w)
    return np.where(w[:, 2] < 0, material.eta if material.transmits else 1.0, 1.0)


LAWFUL = {name: m for name, m in FINITE.items() if "reciprocity" not in m.violations()}


@pytest.mark.sample(12)
@pytest.mark.parametrize("name", each(LAWFUL))
def test_scattering_is_reciprocal(name: str) -> None:
    material = LAWFUL[name]
    forth = material.f(WO, WI, precision="float64") / _index(material, WO)[:, None] ** 2
    back = material.f(WI, WO, precision="float64") / _index(material, WI)[:, None] ** 2
    assert (forth > 0).any()
    np.testing.assert_allclose(forth, back, rtol=1e-8, atol=1e-10 * np.median(forth[forth > 0]))


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "name", each([name for name, m in LAWFUL.items() if isinstance(m, go.Dielectric) and m.transmits])
)
def test_importance_scatters_as_radiance_does_the_other_way(name: str) -> None:
    """The adjoint: f*(wo, wi) = f(wi, wo), so a light tracer and a path tracer see one surface (Veach1997, ch. 5)."""
    material = LAWFUL[name]
    radiance = material.f(WO, WI, precision="float64")
    importance = material.f(WI, WO, "importance", precision="float64")
    scale = (_index(material, WI) / _index(material, WO))[:, None] ** 2
    np.testing.assert_allclose(
        importance, radiance * np.where(WO[:, 2:] * WI[:, 2:] < 0, 1.0, scale), rtol=1e-8, atol=1e-12
    )


@pytest.mark.parametrize("name", [name for name, m in FINITE.items() if "reciprocity" in m.violations()])
def test_models_that_declare_to_break_reciprocity_do_break_it(name: str) -> None:
    wo, wi = (np.where([False, False, True], np.abs(w), w) for w in (WO, WI))
    forth, back = FINITE[name].f(wo, wi, precision="float64"), FINITE[name].f(wi, wo, precision="float64")
    assert np.abs(forth - back).max() > 1e-2 * forth.max()
