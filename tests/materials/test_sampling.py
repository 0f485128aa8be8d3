"""The law that samples follow the density, and that the density integrates to one minus what fails."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from chi_square import SIGNIFICANCE, p_value
from materials import EACH, FINITE, HISTORIC, NDFS, SMALL
from sphere import SEED, at, hemisphere

COUNT = 120_000
VIEWS = {"normal": at(0), "30": at(30, 40), "60": at(60, 200), "grazing": at(86, 100), "inside": at(140, -20)}


def _judge(material: go.BSDF, wo: np.ndarray, count: int = COUNT) -> tuple[float, float, float]:
    """(p-value, integral of the density, failed fraction) of what is not drawn from a delta lobe."""
    u = np.random.default_rng(SEED).random((count, 3), dtype=np.float32)
    s = material.sample(np.broadcast_to(wo, (count, 3)), u)  # float32, as users sample; judged by float64's density
    rest = ~s.delta
    share = 1.0 - (
        float(s.pdf[s.delta][0]) if s.delta.any() else 0.0
    )  # the delta lobe's probability is the same for all
    valid = s.pdf[rest] > 0
    p, integral = p_value(
        s.wi[rest].astype(np.float64), valid, lambda w: material.pdf(wo, w, precision="float64") / share
    )
    return p, integral, 1.0 - valid.mean()


def _views(material: go.BSDF) -> list[str]:
    both = material.transmits or isinstance(material, go.TwoSided)
    return [name for name in VIEWS if both or name != "inside"]


QUICK = {name: m for name, m in EACH.items() if name in FINITE and (name in SMALL or name in HISTORIC)}
QUICK.update({f"{kind}-{ndf}-{way}": FINITE[f"{kind}-{ndf}-{way}"] for kind, ndf, way in [
    ("metal", "ggx", "alpha-0.01"), ("glass", "ggx", "alpha-0.01"), ("metal", "beckmann", "alpha-1.0"),
    ("glass", "beckmann", "alpha-0.01"), ("metal", "ggx", "bounded"), ("glass", "ggx", "normals"),
]})  # fmt: skip
# these from everywhere, the others from the side, and from inside where they let light through
ROUND = ("lambert", "lafortune", "sheen", "metal-bounded-turned", "glass-turned", "metal-ggx-alpha-0.01", "two-sided")


def _few_views(name: str) -> list[str]:
    views = _views(QUICK[name])
    return views if name in ROUND else [view for view in views if view in ("60", "inside")]


@pytest.mark.sample(3)
@pytest.mark.parametrize("name, view", [(name, view) for name in QUICK for view in _few_views(name)])
def test_samples_follow_the_density(name: str, view: str) -> None:
    p, integral, failed = _judge(QUICK[name], VIEWS[view])
    assert p > SIGNIFICANCE, f"seed {SEED}: p = {p:.2g}, integral {integral:.5f}, failed {failed:.5f}"


@pytest.mark.slow
@pytest.mark.parametrize("name, view", [(name, view) for name, m in FINITE.items() for view in _views(m)])
def test_samples_of_every_model_follow_the_density(name: str, view: str) -> None:
    p, integral, failed = _judge(FINITE[name], VIEWS[view], 400_000)
    assert p > SIGNIFICANCE, f"seed {SEED}: p = {p:.2g}, integral {integral:.5f}, failed {failed:.5f}"


@pytest.mark.parametrize("fault", ["tilted", "unnormalized", "samples too wide"])
def test_the_chi_square_test_rejects_a_wrong_density(fault: str) -> None:
    material = go.Conductor(alpha=0.3)
    wo = VIEWS["30"]
    u = np.random.default_rng(SEED).random((COUNT, 3), dtype=np.float32)
    s = material.sample(np.broadcast_to(wo, (COUNT, 3)), u)
    taken_for = go.Conductor(alpha=0.27) if fault == "samples too wide" else material

    def wrong(w: np.ndarray) -> np.ndarray:
        pdf = taken_for.pdf(wo, w, precision="float64")
        return pdf * (1.0 + 0.3 * w[:, 0]) if fault == "tilted" else pdf * 0.95 if fault == "unnormalized" else pdf

    assert p_value(s.wi.astype(np.float64), s.pdf > 0, wrong)[0] < SIGNIFICANCE


@pytest.mark.sample(2)
@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("ndf", NDFS)
def test_visible_normals_estimate_the_same_albedo_as_all_normals_and_as_quadrature(ndf: str, alpha: float) -> None:
    w, weights = hemisphere(320, 160)
    w, weights = np.concatenate([w, w * [1, 1, -1]]), np.concatenate([weights, weights])
    u = np.random.default_rng(SEED).random((100_000, 3))
    for wo in (at(70, 30), at(150)):
        exact = go.Dielectric(1.5, alpha, ndf=ndf).eval(wo, w, precision="float64")[:, 0] @ weights
        for sampling in ("visible", "bounded", "normals"):
            glass = go.Dielectric(1.5, alpha, ndf=ndf, sampling=sampling)
            weight = glass.sample(np.broadcast_to(wo, u.shape), u, precision="float64").weight[:, 0]
            error = weight.std() / np.sqrt(len(u))
            assert abs(weight.mean() - exact) < 5 * error + 2e-3 * exact, (wo, sampling)
