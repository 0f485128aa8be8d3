"""KullaConty on bases whose energy is measured: furnaces, what counts as lost, what is refused."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.energy.albedo import quadrature
from gonio.material import BSDF, binding, spectrum
from gonio.material.parameters import Value
from gonio.ops import RecordingError, backend

MU = np.array([0.05, 0.1, 0.2, 0.4, 0.7, 0.95, 0.985, 0.996, 1.0])  # Oren-Nayar bends like sin(theta) at the normal
WO, WI = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, -0.8, 0.6]])


class Retro(BSDF):
    """A user's own material: a broad lobe back to the viewer, sampled by the cosine."""

    share: Value = spectrum(default=0.8, doc="what is kept", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """share (0.2 + 0.5 (o.i)^4) / pi cos theta_i."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        lobe = 0.2 + 0.5 * ops.sqr(ops.sqr(ops.dot(wo, wi)))
        return self.share * ops.where(above, lobe * wi.z * ops.inv_pi, 0.0)


WHITE = {
    "oren-nayar": go.OrenNayar(1.0, 0.5),
    "phong": go.Phong(0.1, 0.4, 30.0),
    "blinn-phong": go.BlinnPhong(0.1, 0.2, 60.0),
    "own": Retro(1.0),
    "metals": go.mix(go.Conductor(alpha=0.1, fresnel="one"), go.Conductor(alpha=0.6, fresnel="one"), 0.3),
    "coated": go.mix(go.Lambert(1.0), go.Conductor(alpha=0.3, fresnel="one"), 0.6),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", WHITE)
def test_the_furnace_is_closed_for_any_base_that_only_reflects(name):
    base = WHITE[name]
    assert go.albedo(base, MU).value.min() < 0.96  # something was missing
    np.testing.assert_allclose(go.albedo(go.KullaConty(base), MU).value, 1.0, atol=1e-3)


def test_lambert_misses_nothing_and_a_dark_base_stays_dark():
    dark = go.Lambert((0.1, 0.5, 0.9))
    np.testing.assert_allclose(go.KullaConty(dark).eval(WO, WI), dark.eval(WO, WI), rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("color", "power"), [("sheet", 1), ("bounce", 2)])
def test_what_is_given_back_has_the_colour_of_the_bounces(color, power):
    share = np.array([0.2, 0.5, 0.9])
    base = go.OrenNayar(tuple(share), 0.8)
    x, w = quadrature.gauss(10)
    lost = 1.0 - go.albedo(go.OrenNayar(1.0, 0.8), x).value[:, 0] @ (2.0 * w * x)
    added = go.albedo(go.KullaConty(base, color=color), 0.3).value - go.albedo(base, 0.3).value
    missing = 1.0 - go.albedo(go.OrenNayar(1.0, 0.8), 0.3).value[0, 0]
    expected = missing * share**power * (1.0 - lost) / (1.0 - share * lost)
    np.testing.assert_allclose(added[0], expected, atol=2e-3 * missing)


@pytest.mark.slow
def test_the_brightest_channel_of_a_material_without_shares_is_its_white():
    found = go.albedo(go.KullaConty(go.Phong((0.2, 0.1, 0.05), 0.0)), MU).value
    np.testing.assert_allclose(found[:, 0], 1.0, atol=1e-3)
    assert np.all(np.diff(found, axis=1) < -0.1)  # the others stay darker


@pytest.mark.slow
def test_where_a_base_gains_nothing_is_added():
    bright = go.Phong(1.0, 0.0)  # returns pi
    np.testing.assert_array_equal(go.KullaConty(bright).eval(WO, WI), bright.eval(WO, WI))


@pytest.mark.slow
def test_it_is_reciprocal_where_its_base_is():
    rng = np.random.default_rng(3)
    v = rng.normal(size=(500, 3))
    v = np.abs(v / np.linalg.norm(v, axis=1)[:, None])
    for name in ("oren-nayar", "metals", "own"):
        model = go.KullaConty(WHITE[name])
        forth, back = (model.f(*pair, precision="float64") for pair in ((v, v[::-1]), (v[::-1], v)))
        np.testing.assert_allclose(forth, back, rtol=1e-9)


@pytest.mark.sample(1)
@pytest.mark.long
@pytest.mark.parametrize("name", ["phong", "own", "coated"])
def test_weight_is_eval_over_pdf_and_sampling_finds_the_albedo(name):
    model = go.KullaConty(WHITE[name])
    s = model.sample(WO, np.random.default_rng(1).random((2000, 3)), precision="float64")
    good = s.pdf > 0
    value = (
        model.eval(WO, s.wi, precision="float64") / np.maximum(model.pdf(WO, s.wi, precision="float64"), 1e-9)[:, None]
    )
    np.testing.assert_allclose(s.weight[good], value[good], rtol=1e-9)
    drawn, exact = go.albedo(model, 0.5, method="sampling", samples=1 << 17), go.albedo(model, 0.5)
    assert np.all(np.abs(drawn.value - exact.value) < 6 * drawn.error + 5e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "base",
    [go.OrenNayar(0.8, 0.5), pytest.param(go.Phong(0.1, 0.4, 30.0), marks=pytest.mark.slow)],
    ids=lambda m: m.name,
)
def test_every_law_holds_or_is_declared(base):
    # not gradients, for which the base is measured a dozen times: they are tested below
    laws = ["positivity", "reciprocity", "energy", "pdf", "weight", "isotropy", "precision", "calls"]
    report = go.verify(go.KullaConty(base), quick=True, law=laws)
    assert report.passed, str(report)


def test_a_new_value_compiles_no_kernel():
    dr = backend.drjit()
    kind = backend.types("float32")
    wo, wi = (backend.vector_of(w, 3, kind) for w in (WO, WI))
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        for trial, sigma in enumerate((0.3, 0.4, 0.5)):
            dr.kernel_history_clear()
            dr.eval(go.KullaConty(go.OrenNayar(0.7 + 0.1 * sigma, sigma)).eval(wo, wi))
            if trial:
                assert all(k["cache_hit"] for k in dr.kernel_history([dr.KernelType.JIT]))
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, False)


@pytest.mark.slow
def test_its_gradient_is_that_of_differences():
    dr = backend.drjit()
    kind = backend.types("float64")
    wo, wi = (backend.vector_of(w, 3, kind) for w in (WO, WI))
    model = go.KullaConty(go.OrenNayar(0.8, 0.5))

    def value(sigma):
        bound = binding.bind(model, lambda p, v: sigma if p.name == "sigma" else p.bind(v, kind))
        return bound.eval(wo, wi).x

    sigma = kind.float(0.5)
    dr.enable_grad(sigma)
    dr.backward(value(sigma))
    step = 1e-4
    difference = (value(kind.float(0.5 + step)) - value(kind.float(0.5 - step)))[0] / (2 * step)
    assert dr.grad(sigma)[0] == pytest.approx(difference, rel=1e-5)


@pytest.mark.parametrize(
    ("base", "text"),
    [
        (go.mix(go.Lambert(), go.Dielectric(1.5, 0.3)), "Mix transmits"),
        (go.mix(go.Lambert(), go.Mirror()), "perfectly specular part"),
        (go.Mirror(), "perfectly specular part"),
        (go.two_sided(go.Lambert()), "seen from one side expected"),
        (go.RandomWalk(go.Conductor(alpha=0.5)), "is random"),
        (go.mix(go.Lambert(), go.Conductor(alpha=(0.1, 0.5))), "is anisotropic"),
    ],
    ids=["transmits", "half-mirror", "mirror", "two-sided", "random", "two-widths"],
)
def test_bases_that_cannot_be_measured_are_refused(base, text):
    with pytest.raises(go.InputError, match=text):
        go.KullaConty(base)


def test_values_that_vary_and_recording_are_refused():
    model = go.KullaConty(go.OrenNayar(0.5, np.array([0.1, 0.2])))
    with pytest.raises(go.InputError, match=r"OrenNayar.sigma varies"):
        model.eval(np.repeat(WO, 2, 0), WI)
    for base in (go.OrenNayar(), Retro()):
        with pytest.raises(RecordingError, match="cannot be recorded"):
            go.KullaConty(base).record("eval")


def test_textures_are_refused_when_the_scene_is_built():
    from gonio.bridge import adapter, engine

    mi = engine.load("cpu")
    adapter.register(mi)
    base = {"type": "gonio_oren_nayar", "albedo": {"type": "checkerboard"}}
    with pytest.raises(RuntimeError, match="this base needs tables, which are computed for colors and numbers"):
        mi.load_dict({"type": "gonio_kulla_conty", "base": base})
