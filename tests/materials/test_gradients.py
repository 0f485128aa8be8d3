"""The law that derivatives are those of finite differences, in float64, and never undefined."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.ops import backend

from sphere import random_directions

N = 500
WO, WI = random_directions(N, 101), random_directions(N, 102)
KIND = backend.types("float64")


def _derivative(make: Any, x: float, what: str = "eval") -> tuple[np.ndarray, np.ndarray]:
    """(by autodiff, by central differences) of the first channel, for every pair."""
    dr = backend.drjit()
    wo, wi = (backend.vector_of(w, 3, KIND) for w in (WO, WI))

    def value(parameter: Any) -> Any:
        got = getattr(make(parameter), what)(wo, wi)
        return got.x if what == "eval" else got

    p = KIND.float(np.full(N, x))
    dr.enable_grad(p)
    y = value(p)
    dr.forward(p)
    automatic = np.array(dr.grad(y))
    h = 1e-5 * max(x, 0.1)
    low, high = (value(KIND.float(np.full(N, x + d))).numpy() for d in (-h, h))
    return automatic, (high - low) / (2 * h)


def _agree(pair: tuple[np.ndarray, np.ndarray]) -> None:
    automatic, finite = pair
    assert np.isfinite(automatic).all()
    scale = np.abs(finite).max()
    assert scale > 0
    np.testing.assert_allclose(automatic, finite, rtol=1e-4, atol=1e-6 * scale)


@pytest.mark.sample(3)
@pytest.mark.parametrize("masking", ["smith-correlated", "smith-separable", "schlick-direct"])
@pytest.mark.parametrize("ndf", ["ggx", "beckmann", "student-t"])
@pytest.mark.parametrize("cls", [go.Conductor, go.Dielectric])
def test_gradient_by_width(cls: type, ndf: str, masking: str) -> None:
    _agree(_derivative(lambda a: cls(alpha=a, ndf=ndf, masking=masking), 0.4))


@pytest.mark.parametrize("fresnel", ["exact", "schlick"])
def test_gradient_by_index(fresnel: str) -> None:
    _agree(_derivative(lambda e: go.Conductor(eta=e, k=2.5, alpha=0.4, fresnel=fresnel), 0.6))
    _agree(_derivative(lambda k: go.Conductor(eta=0.6, k=k, alpha=0.4, fresnel=fresnel), 2.5))
    _agree(_derivative(lambda e: go.Dielectric(e, 0.4, fresnel=fresnel), 1.5))


@pytest.mark.parametrize("make", [
    lambda a: go.Lambert(a), lambda a: go.OrenNayar(a, 0.3), lambda a: go.Conductor(alpha=0.3, albedo=a),
    lambda a: go.Dielectric(1.5, 0.3, albedo=a), lambda a: go.mix(go.Lambert(0.2), go.Conductor(alpha=0.4), a),
    lambda s: go.OrenNayar(0.5, s), lambda kd: go.Phong(kd, 0.2, 5.0), lambda ks: go.Phong(0.2, ks, 5.0),
    lambda p: go.Phong(0.2, 0.2, 10 * p), lambda p: go.BlinnPhong(0.2, 0.2, 10 * p),
    lambda t: go.Conductor(alpha=(0.2, 0.6), rotation=t),
], ids=[
    "lambert", "oren-nayar", "conductor", "dielectric", "mix", "sigma", "kd", "ks", "phong-p", "blinn-p", "rotation"
])  # fmt: skip
def test_gradient_by_other_parameters(make: Any) -> None:
    _agree(_derivative(make, 0.5))


@pytest.mark.parametrize("cls", [go.Conductor, go.Dielectric])
def test_gradient_of_the_density_by_width(cls: type) -> None:
    _agree(_derivative(lambda a: cls(alpha=a), 0.4, "pdf"))


@pytest.mark.parametrize("ndf", ["ggx", "beckmann", "student-t"])
@pytest.mark.parametrize("make", [
    lambda a, n: go.Conductor(alpha=a, ndf=n), lambda a, n: go.Dielectric(1.5, a, ndf=n),
    lambda a, n: go.Conductor(alpha=a, ndf=n, masking="schlick-ibl"),
], ids=["conductor", "dielectric", "schlick"])  # fmt: skip
def test_gradients_are_finite_at_the_edges(make: Any, ndf: str) -> None:
    dr = backend.drjit()
    edges = np.array(
        [[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0], [np.sqrt(1 - 1e-12), 0, 1e-6], [0.6, 0, 0.8], [-0.6, 0, 0.8]]
    )
    wo, wi = (x.reshape(-1, 3) for x in np.broadcast_arrays(edges[:, None], edges[None, :]))
    for precision in ("float32", "float64"):
        kind = backend.types(precision)
        o, i = (backend.vector_of(w, 3, kind) for w in (wo, wi))
        for alpha in (0.0, 1e-4, 0.5, 1.0):
            a = kind.float(np.full(len(wo), alpha))
            dr.enable_grad(a)
            y = make(a, ndf).eval(o, i)
            dr.forward(a)
            assert np.isfinite(np.array(dr.grad(y))).all(), (precision, alpha)


def test_gradient_by_direction() -> None:
    dr = backend.drjit()
    wo = backend.vector_of(WO, 3, KIND)
    for material in (go.Conductor(alpha=0.4), go.Dielectric(1.5, 0.4), go.OrenNayar(0.5, 0.3)):
        wi = backend.vector_of(WI, 3, KIND)
        dr.enable_grad(wi)
        dr.backward(material.eval(wo, wi).x)
        assert np.isfinite(dr.grad(wi).numpy()).all()
