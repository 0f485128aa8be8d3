"""The law that 32 bits say what 64 bits say, and that nothing is ever infinite or undefined."""

from __future__ import annotations

import itertools

import gonio as go
import numpy as np
import pytest

from materials import ALL, FINITE, NDFS, SMALL, each
from sphere import at, random_directions, random_numbers, relative

COUNT = 20_000
# directions that float32 holds exactly: the rounding of the input is not the model's
WO = random_directions(COUNT, 21).astype(np.float32).astype(np.float64)
U = random_numbers(COUNT, 21)


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", each(FINITE))
def test_float32_is_close_to_float64(name: str) -> None:
    material = FINITE[name]
    wi = material.sample(WO, U, precision="float64").wi.astype(np.float32).astype(np.float64)
    for method in (material.eval, material.pdf):
        worst = relative(method(WO, wi, precision="float32"), method(WO, wi, precision="float64"), 1e-6)
        # rounding of the half vector, 6e-8, is magnified by at most 1 / alpha in D, and by a cancelled |o.m| or
        # |i.m| in the rays that just graze a facet: one in a thousand
        assert np.percentile(worst, 99.9) < 5e-5
        # and 1 - F has an infinite slope at the critical angle: the root of 6e-8, a few times over
        assert worst.max() < 5e-3


@pytest.mark.parametrize(
    "material",
    [go.AshikhminShirley(coupled=True, specular=0.0), go.Dielectric(1.5, 0.6, masking="v-groove")],
    ids=["coupled diffuse term", "v-grooves"],
)
def test_no_digits_are_lost_where_wo_grazes(material: go.BSDF) -> None:
    cos = np.logspace(-6, -2, 60)
    wo = np.stack([np.sqrt(1.0 - cos**2), np.zeros(60), cos], 1).astype(np.float32).astype(np.float64)
    wi = np.broadcast_to(at(130.0 if material.transmits else 50.0, 180.0), wo.shape).astype(np.float32).astype(float)
    exact = material.eval(wo, wi, precision="float64")
    assert exact.min() > 0.0
    assert relative(material.eval(wo, wi, precision="float32"), exact, 0.0).max() < 1e-5


def test_transmission_near_the_critical_angle_keeps_its_digits_in_float32() -> None:
    # from inside, 1 - F vanishes with the transmitted cosine: taken from Snell's root, it would be off by 10 % here
    glass = go.Dielectric(1.5, 0.5)
    wo = np.tile(at(180 - 30), (2000, 1)).astype(np.float32).astype(np.float64)
    m = random_directions(2000, 22, upper=True)
    # directions whose refracting facet is met within 0.01 of grazing on the far side
    tangent = np.cross(m, np.cross(wo, m))
    wi = -tangent / np.linalg.norm(tangent, axis=1, keepdims=True) + np.linspace(1e-4, 1e-2, 2000)[:, None] * m
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    precise, quick = glass.eval(wo, wi, precision="float64"), glass.eval(wo, wi, precision="float32")
    lit = precise[:, 0] > 0
    assert lit.sum() > 100
    assert np.median(relative(quick[lit], precise[lit])) < 1e-4


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", each(FINITE))
def test_samples_in_float32_are_those_in_float64(name: str) -> None:
    quick = FINITE[name].sample(WO, U, precision="float32")
    precise = FINITE[name].sample(WO, U, precision="float64")
    same = (quick.pdf > 0) == (precise.pdf > 0)
    assert same.mean() > 0.999  # a direction on the horizon, a number on a lobe's border
    both = same & (precise.pdf > 0)
    turned = np.linalg.norm(quick.wi - precise.wi, axis=1)[both]
    assert np.percentile(turned, 99.5) < 2e-4
    assert np.median(turned) < 2e-6


EDGES = np.array(
    [
        at(0),
        at(1e-3, 20),
        at(45, 10),
        at(89, -30),
        at(89.99, 200),
        at(89.9999, 90),
        at(90.0001, 90),
        at(91, 120),
        at(135, -80),
        at(179.999, 0),
        at(180),
        [1.0, 0.0, 0.0],
    ]
)
CORNERS = np.array(list(itertools.product([0.0, 1e-7, 0.5, 0.99999994], repeat=3)))
EXTREME = {
    f"{type(base).__name__}-{ndf}-{masking}-{base.sampling}-{base.fresnel}-{alpha}-{eta}": (
        base,
        ndf,
        masking,
        alpha,
        eta,
    )
    for ndf in NDFS
    for base, masking, alpha, eta in [
        (go.Conductor(), "smith-correlated", 1e-4, (0.0, 1.0001, 4.0)),
        (go.Conductor(), "smith-separable", (1e-4, 1.0), (0.2, 1.0, 9.0)),
        (go.Conductor(sampling="bounded"), "schlick-direct", 1.0, 1.0),
        (go.Conductor(sampling="normals", fresnel="schlick"), "smith-separable-exact", 1.01e-4, 4.0),
        (go.Dielectric(), "smith-correlated", 1e-4, 1.0001),
        (go.Dielectric(), "smith-correlated", 1.0, 4.0),
        (go.Dielectric(), "smith-separable", (1e-4, 1.0), 4.0),
        (go.Dielectric(sampling="bounded"), "schlick-ibl", 0.5, 1 / 4),
        (go.Dielectric(sampling="normals", fresnel="schlick"), "smith-correlated", 1e-3, 1 / 1.0001),
        (go.Dielectric(transmission=False), "smith-separable", 0.02, 1.00001),
    ]
}


def _finite_everywhere(material: go.BSDF) -> None:
    wo, wi = (x.reshape(-1, 3) for x in np.broadcast_arrays(EDGES[:, None], EDGES[None, :]))
    wide_wo, u = (x.reshape(-1, 3) for x in np.broadcast_arrays(EDGES[:, None], CORNERS[None, :]))
    for precision in ("float32", "float64"):
        for mode in ("radiance", "importance") if material.transmits else ("radiance",):
            value = material.eval(wo, wi, mode, precision=precision)
            assert np.isfinite(value).all() and (value >= 0).all()
            s = material.sample(wide_wo, u, mode, precision=precision)
            for part in s:
                assert np.isfinite(part).all()
            assert (s.weight >= 0).all() and (s.pdf >= 0).all()
        pdf = material.pdf(wo, wi, precision=precision)
        assert np.isfinite(pdf).all() and (pdf >= 0).all()
        assert np.isfinite(material.f(wo, wi, precision=precision)).all()


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", [*SMALL, *(pytest.param(x, marks=pytest.mark.slow) for x in ALL if x not in SMALL)])
def test_every_model_is_finite_and_positive_at_the_edges(name: str) -> None:
    _finite_everywhere(ALL[name])


@pytest.mark.sample(6)
@pytest.mark.parametrize("name", EXTREME)
def test_facets_are_finite_and_positive_at_extreme_parameters(name: str) -> None:
    import dataclasses

    base, ndf, masking, alpha, eta = EXTREME[name]
    _finite_everywhere(dataclasses.replace(base, ndf=ndf, masking=masking, alpha=alpha, eta=eta))
