"""Conductor and Dielectric against Mitsuba's own plugins, pair by pair, on 100,000 random pairs on both sides.

Where the conventions agree the two must, within 1e-4. They agree in eval (masking smith-separable, exact Fresnel,
radiance), and differ, knowingly, in these:

- Mitsuba's density of visible Beckmann normals holds the rational fit of G1, ours the exact G1 (so that it
  integrates to one); the quotient is known in closed form and put in below.
- Mitsuba's `roughdielectric` widens alpha by 1.2 - 0.2 sqrt|cos theta| when it samples all normals; ours does not.
  The widened alpha, one per ray, is handed to ours below.
- Values under 1e-6 are compared absolutely: Mitsuba sets densities of normals below 1e-20 to 0.
- From inside, near the critical angle, Mitsuba takes 1 - F from a cosine that Snell's root has cancelled in float32;
  where a facet is just grazed, 1 - F cancels in any float32; at the critical angle itself F has an infinite slope; and
  m.z of a facet on edge is a difference of two float32. There (one pair in thirty) our float64 is the judge.
"""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.ops import backend
from gonio.optics.ndf import distribution

from sphere import random_directions, relative

COUNT = 100_000
WO = random_directions(COUNT, 31).astype(np.float32)
WI = random_directions(COUNT, 32).astype(np.float32)
GOLD_ETA, GOLD_K = (0.18, 0.42, 1.37), (3.42, 2.35, 1.77)
WIDTHS = [0.01, 0.1, 0.5, 1.0, (0.1, 0.4)]
BAR = 1e-4


@pytest.fixture(scope="module")
def native() -> Any:
    """eval and pdf of a native plugin: dict -> ((N, 3), (N,)) for WO, WI."""
    from gonio.bridge import engine

    mi = engine.load()
    import drjit as dr

    def ask(plugin: dict) -> tuple[np.ndarray, np.ndarray]:
        bsdf = mi.load_dict(plugin)
        si = dr.zeros(mi.SurfaceInteraction3f, COUNT)
        si.wi = mi.Vector3f(WO.T)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(WI.T))
        return np.array(value).T.astype(np.float64), np.array(pdf).astype(np.float64)

    return ask


def _common(ndf: str, alpha: Any, sampling: str) -> dict:
    along, across = alpha if isinstance(alpha, tuple) else (alpha, alpha)
    return {"distribution": ndf, "alpha_u": along, "alpha_v": across, "sample_visible": sampling == "visible"}


def _fit_over_exact(ndf: str, alpha: Any, sampling: str) -> np.ndarray:
    """G1 by Beckmann's fit over the exact G1, at wo; 1 where the pdf holds no fit."""
    if ndf != "beckmann" or sampling != "visible":
        return np.ones(COUNT)
    kind = backend.types("float64")
    widths = kind.vec2(*(alpha if isinstance(alpha, tuple) else (alpha, alpha)))
    wo = backend.vector_of(WO, 3, kind)
    beckmann = distribution("beckmann")
    return (beckmann.G1_customary(wo, widths) / beckmann.G1(wo, widths)).numpy()


@pytest.mark.sample(4)
@pytest.mark.parametrize("sampling", ["visible", "normals"])
@pytest.mark.parametrize("alpha", WIDTHS, ids=str)
@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
def test_conductor_is_mitsubas_roughconductor(native: Any, ndf: str, alpha: Any, sampling: str) -> None:
    eta, k = ({"type": "rgb", "value": list(x)} for x in (GOLD_ETA, GOLD_K))
    value, pdf = native({"type": "roughconductor", "eta": eta, "k": k, **_common(ndf, alpha, sampling)})
    ours = go.Conductor(GOLD_ETA, GOLD_K, alpha, ndf=ndf, masking="smith-separable", sampling=sampling)
    fit = _fit_over_exact(ndf, alpha, sampling)
    assert (value > 0).any()
    for precision in ("float32", "float64"):
        assert relative(ours.eval(WO, WI, precision=precision), value, 1e-6).max() < BAR
        assert relative(ours.pdf(WO, WI, precision=precision) * fit, pdf, 1e-6).max() < BAR


@pytest.mark.sample(4)
@pytest.mark.parametrize("sampling", ["visible", "normals"])
@pytest.mark.parametrize("alpha", WIDTHS, ids=str)
@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
def test_dielectric_is_mitsubas_roughdielectric(native: Any, ndf: str, alpha: Any, sampling: str) -> None:
    index = 1.5
    plugin = {"type": "roughdielectric", "int_ior": index, "ext_ior": 1.0, **_common(ndf, alpha, sampling)}
    value, pdf = native(plugin)
    ours = go.Dielectric(index, alpha, ndf=ndf, masking="smith-separable", sampling=sampling)
    widened: Any = alpha
    if sampling == "normals":
        scale = 1.2 - 0.2 * np.sqrt(np.abs(WO[:, 2].astype(np.float64)))
        widened = tuple(a * scale for a in alpha) if isinstance(alpha, tuple) else alpha * scale
    widest = np.maximum(*widened) if isinstance(alpha, tuple) else widened
    unclipped = np.broadcast_to(widest <= 1.0, COUNT)  # ours takes no alpha over 1: none is left of alpha = 1
    widened = tuple(np.minimum(a, 1.0) for a in widened) if isinstance(alpha, tuple) else np.minimum(widened, 1.0)
    sampler = go.Dielectric(index, widened, ndf=ndf, sampling=sampling)
    fit = _fit_over_exact(ndf, alpha, sampling)

    # |i.m| of the refracting facet on the far side, where Snell's root cancels, or 1 - F does at a grazed facet
    wo, wi = WO.astype(np.float64), WI.astype(np.float64)
    through = wo[:, 2] * wi[:, 2] < 0
    h = wo + wi * np.where(through, np.where(wo[:, 2] > 0, index, 1 / index), 1.0)[:, None]
    near, far = (np.abs(np.sum(w * h, 1)) / np.linalg.norm(h, axis=1) for w in (wo, wi))
    inside = wo[:, 2] < 0
    turning = inside & (np.abs(near - np.sqrt(5) / 3) < 3e-4)
    critical = np.where(through, inside & (far < 0.06), turning) | (near < 0.02)
    critical |= np.abs(h[:, 2]) < 1e-3 * np.linalg.norm(
        h, axis=1
    )  # m.z, a difference of two float32, is in the density
    assert critical.mean() < 0.04

    assert (value > 0).any()
    exact_value, exact_pdf = ours.eval(WO, WI, precision="float64"), sampler.pdf(WO, WI, precision="float64")
    for precision in ("float32", "float64"):
        ours_value, ours_pdf = ours.eval(WO, WI, precision=precision), sampler.pdf(WO, WI, precision=precision)
        assert relative(ours_value, value, 1e-6)[~critical].max() < BAR
        assert relative(ours_pdf * fit, pdf, 1e-6)[~critical & unclipped].max(initial=0) < BAR
        # at the critical angle: the float64 judges both
        assert np.percentile(relative(ours_value, exact_value, 1e-6)[critical], 99) < BAR
        assert np.percentile(relative(ours_pdf, exact_pdf, 1e-6)[critical], 99) < BAR
    ours_off = relative(ours.eval(WO, WI, precision="float32"), exact_value, 1e-6)[critical].max()
    assert ours_off <= max(relative(value, exact_value, 1e-6)[critical].max(), 1e-3)
