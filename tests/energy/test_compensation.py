"""Materials that keep what they receive: white furnaces, reciprocity, sampling, colour, and what they refuse."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.energy import bend
from gonio.energy.albedo import quadrature, walk
from gonio.energy.compensation import curves
from gonio.ops import backend

MU = np.array([0.05, 0.1, 0.2, 0.4, 0.7, 1.0])
NODE, WEIGHT = quadrature.gauss(96)
COS = NODE**2  # dense at grazing
RING = np.stack([np.sqrt(1.0 - COS**2), 0.0 * COS, COS], axis=1)


def direction(mu, phi=0.0):
    s = np.sqrt(1.0 - mu * mu)
    return np.array([[s * np.cos(phi), s * np.sin(phi), mu]])


def whole_albedo(model, mu):
    """Base by its own quadrature, the rest (isotropic about the normal) by Gauss-Legendre over the cosine."""
    total = go.albedo(model.base, mu).value[0]
    for side in (1.0, -1.0) if model.transmits else (1.0,):
        wi = RING * [1.0, 1.0, side]
        both = [m.eval(direction(mu), wi, mode="importance", precision="float64") for m in (model, model.base)]
        total = total + 2.0 * np.pi * np.einsum("nc,n->c", both[0] - both[1], 2.0 * NODE * WEIGHT)
    return total


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("ndf", "masking"),
    [
        ("ggx", "smith-correlated"),
        pytest.param("ggx", "smith-separable", marks=pytest.mark.slow),
        pytest.param("beckmann", "smith-correlated", marks=pytest.mark.slow),
        ("beckmann", "smith-separable"),
    ],
)
def test_white_furnace_of_metal_is_closed(ndf, masking):
    for roughness in (0.05, 0.13, 0.31, 0.55, 0.8, 1.0):
        metal = go.KullaConty(go.Conductor(alpha=roughness**2, ndf=ndf, masking=masking, fresnel="one"))
        for mu in MU:
            assert whole_albedo(metal, mu) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("eta", [1.5, 1 / 1.5, pytest.param(1.33, marks=pytest.mark.slow)])
def test_white_furnace_of_glass_is_closed_on_both_sides(eta):
    for alpha in (0.05, 0.2, 0.5, 1.0):
        glass = go.KullaConty(go.Dielectric(eta, alpha))
        for mu in (*MU, *-MU):
            assert 0.995 <= whole_albedo(glass, mu)[0] <= 1.002


@pytest.mark.sample(1)
@pytest.mark.parametrize(("eta", "loss"), [(1.02, 0.015), (1.1, 0.004), (2.4, 0.002)])
def test_glass_keeps_nearly_all_its_energy_near_and_far_from_eta_1(eta, loss):
    for alpha in (0.1, 0.4, 1.0):
        value = go.albedo(go.KullaConty(go.Dielectric(eta, alpha)), np.concatenate([MU, -MU])).value
        np.testing.assert_allclose(value, 1.0, atol=loss)


def test_a_metal_with_two_widths_keeps_its_energy():
    metal = go.KullaConty(go.Conductor(alpha=(0.1, 0.4), fresnel="one", rotation=0.3))
    phi = (np.arange(48) + 0.5) / 48 * 2 * np.pi
    turned = np.array([[r[0] * np.cos(p), r[0] * np.sin(p), r[2]] for r in RING for p in phi])
    for mu, at in ((0.1, 0.0), (0.5, 1.0), (0.9, 2.0)):
        both = [m.eval(direction(mu, at), turned, precision="float64")[:, 0] for m in (metal, metal.base)]
        added = 2.0 * np.pi * np.sum((both[0] - both[1]).reshape(len(RING), -1).mean(1) * 2.0 * NODE * WEIGHT)
        assert go.albedo(metal.base, mu, at).value[0, 0] + added == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    "base",
    [go.Conductor.preset("Au", alpha=0.5), go.Conductor.preset("Cu", alpha=(0.2, 0.6)), go.Dielectric(1.5, 0.5)],
    ids=["metal", "turned", "glass"],
)
def test_kulla_conty_is_reciprocal(base):
    model = go.KullaConty(base)
    rng = np.random.default_rng(3)
    v = rng.normal(size=(500, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    w = v[::-1]
    if not base.transmits:
        v, w = np.abs(v), np.abs(w)

    def index(d):
        return np.where(d[:, 2:] > 0, 1.0, 1.5**2 if base.transmits else 1.0)

    forth = model.f(v, w, precision="float64") / index(v)
    back = model.f(w, v, precision="float64") / index(w)
    np.testing.assert_allclose(forth, back, rtol=1e-6, atol=1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("cls", [go.KullaConty, go.Turquin, go.FdezAguera])
@pytest.mark.parametrize("alpha", [0.1, 0.7, (0.2, 0.5)])
def test_weight_is_eval_over_pdf_and_pdf_integrates_to_one(cls, alpha):
    model = cls(go.Conductor.preset("Au", alpha=alpha))
    wo = direction(0.6, 0.4)
    rng = np.random.default_rng(1)
    s = model.sample(wo, rng.random((2000, 3)), precision="float64")
    good = s.pdf > 0
    expected = model.eval(wo, s.wi, precision="float64")[good]
    expected /= model.pdf(wo, s.wi, precision="float64")[good, None]
    np.testing.assert_allclose(s.weight[good], expected, rtol=1e-9)
    drawn = go.albedo(model, 0.6, 0.4, method="sampling", samples=1 << 17)
    exact = go.albedo(model, 0.6, 0.4)
    assert np.all(np.abs(drawn.value - exact.value) < 6 * drawn.error + 5e-4)


def test_broad_lobe_is_drawn_with_the_density_it_claims():
    model = go.KullaConty(go.Conductor(alpha=0.8, fresnel="one"))
    wo = direction(0.9)
    s = model.sample(wo, np.random.default_rng(5).random((400_000, 3)))
    good = s.pdf > 0
    counts, edges = np.histogram(s.wi[good, 2], bins=20, range=(0, 1))
    phi = (np.arange(256) + 0.5) / 256 * 2 * np.pi
    for count, a, b in zip(counts, edges[:-1], edges[1:], strict=True):
        z = a + (b - a) * quadrature.gauss(8)[0]
        grid = np.array([[np.sqrt(1 - c * c) * np.cos(p), np.sqrt(1 - c * c) * np.sin(p), c] for c in z for p in phi])
        density = model.pdf(wo, grid).reshape(8, -1).mean(1) * 2 * np.pi
        expected = (density @ quadrature.gauss(8)[1]) * (b - a) * len(s.pdf)
        assert abs(count - expected) < 5 * np.sqrt(expected) + 0.004 * expected


def test_the_term_vanishes_as_alpha_does():
    base = go.Conductor(alpha=2e-4, fresnel="one")
    wo, wi = direction(0.5), direction(0.4, 2.0)
    assert np.all(go.KullaConty(base).eval(wo, wi) - base.eval(wo, wi) < 1e-5)
    smooth = go.KullaConty(go.Conductor(alpha=0.0, fresnel="one"))
    s = smooth.sample(wo, np.array([[0.3, 0.3, 0.3]]))
    assert s.delta[0]
    assert s.weight[0, 0] == pytest.approx(1.0, abs=1e-6)


def test_the_polynomials_meet_the_quadrature():
    mu = np.linspace(0.01, 1.0, 60)
    roughness = np.linspace(0.05, 1.0, 37)
    for ndf, masking, bar in (
        ("ggx", "smith-correlated", 1e-4),
        ("beckmann", "smith-correlated", 1e-4),
        ("beckmann", "smith-separable", 6e-4),
        ("ggx", "schlick-direct", 1e-4),
    ):
        rows = np.array(ops.lookup(curves.isotropic(ndf, masking), ops.inset(roughness, curves.ROWS))).T
        form = bend.form_of(ndf, masking)
        knee = bend.numpy_knee(form, masking, roughness**2)
        ours = curves.evaluate(form, rows[:, :-1], knee, np.broadcast_to(mu, (37, 60)))
        exact = 1.0 - quadrature.moments(ndf, masking, mu, roughness[:, None] ** 2).white
        assert np.abs(ours - exact).max() < bar


@pytest.mark.parametrize(("ndf", "masking"), [("ggx", "smith-correlated"), ("beckmann", "smith-separable")])
def test_what_is_missing_keeps_its_digits_in_float32(ndf, masking):
    rng = np.random.default_rng(3)
    mu, roughness = rng.random(20000).astype(np.float32) * 0.999, (0.02 + 0.98 * rng.random(20000)).astype(np.float32)
    found = []
    for precision in ("float64", "float32"):
        kind = ops.backend.types(precision)
        alpha = ops.sqr(kind.float(roughness))
        form = bend.form_of(ndf, masking)
        rows = ops.lookup(curves.isotropic(ndf, masking), ops.inset(kind.float(roughness), curves.ROWS))
        found.append(np.array(curves.missing(form, rows, bend.knee(form, masking, alpha), kind.float(mu))))
    assert found[0].min() >= 0.0 and found[0][found[0] > 0].min() < 1e-5
    # and it is what the fit was made for, down to grazing
    grazing = np.append(mu[:200], [0.0, 1e-7, 1e-5, 1e-3, 1.0])
    rows = curves.isotropic(ndf, masking).values[(curves.ROWS - 1) // 2]
    knee = bend.numpy_knee(form, masking, np.array([0.25]))
    told = curves.evaluate(form, rows[None, :-1], knee, grazing[None])[0]
    kind = ops.backend.types("float64")
    ours = curves.missing(form, [kind.float(c) for c in rows], kind.float(knee), kind.float(grazing))
    assert np.array(ours) == pytest.approx(told, rel=1e-9, abs=1e-12)
    some = found[0] > 1e-12
    # 10 times the relative change of z / r, which near the normal is that of 1 - mu
    slack = 3e-6 + 1e-6 / (1.0 - mu[some])
    assert np.all(np.abs(found[1] - found[0])[some] <= slack * found[0][some])


@pytest.mark.parametrize("name", ["isotropic", "anisotropic", "glass"])
def test_no_coefficient_is_below_0(name):
    tables = getattr(curves, name)("ggx", "smith-correlated", *(["exact"] if name == "glass" else []))
    for table in tables.values() if name == "glass" else [tables]:
        assert table.values.min() >= 0.0


def test_colours_agree_in_a_furnace_and_differ_on_gold():
    wo, wi = direction(0.5), direction(0.4, 2.0)
    white = go.Conductor(alpha=0.8, fresnel="one")
    sheet, bounce = (go.KullaConty(white, color=c).eval(wo, wi) for c in ("sheet", "bounce"))
    np.testing.assert_allclose(sheet, bounce, rtol=1e-6)
    gold = go.Conductor.preset("Au", alpha=0.8)
    sheet, bounce = (go.KullaConty(gold, color=c).eval(wo, wi) for c in ("sheet", "bounce"))
    assert np.all(sheet > bounce)


@pytest.mark.parametrize("alpha", [0.3, 1.0])
def test_the_walk_returns_what_it_was_given(alpha):
    for base in (go.Conductor(alpha=alpha, fresnel="one"), go.Dielectric(1.5, alpha)):
        mean, _ = walk.albedo(base, 0.4, 100_000)
        np.testing.assert_allclose(mean, 1.0, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "base",
    [go.Conductor(alpha=0.8, fresnel="one"), go.Conductor.preset("Au", alpha=0.8), go.Dielectric(1.5, 0.5)],
    ids=["white", "gold", "glass"],
)
def test_the_walks_eval_has_the_walks_albedo(base):
    drawn = go.albedo(go.RandomWalk(base), 0.5, method="sampling", samples=1 << 18)
    mean, error = walk.albedo(base, 0.5, 400_000)
    assert np.all(np.abs(drawn.value[0] - mean) < 4 * np.hypot(drawn.error[0], error) + 1e-6)


@pytest.mark.parametrize(("eta", "mu"), [(1.5, 0.6), (1.5, -0.6), (1.33, 0.2)])
def test_walkers_that_leave_at_once_are_the_single_scattering_of_glass(eta, mu):
    count = 400_000
    dr, kind = backend.drjit(), backend.types("float32")
    bound = go.Dielectric(eta, 0.6).bind(kind)
    wo = kind.vec3(float(np.sqrt(1.0 - mu * mu)), 0.0, mu) + dr.zeros(kind.float, count)
    rng = kind.module.PCG32(size=count, initstate=7)
    _, left = walk.walk(bound, wo, None, rng, bound.alpha, True)
    once = np.asarray(left.bounces.numpy()) == 1
    same = np.asarray(left.w.z.numpy()) * mu > 0.0
    power = quadrature.glass(
        "ggx", "smith-correlated", "exact", quadrature.Points(abs(mu), 0.6), eta if mu > 0 else 1.0 / eta
    )
    for share, expected in ((once & same, power.reflected), (once & ~same, power.transmitted)):
        assert share.mean() == pytest.approx(float(expected), abs=4 * np.sqrt(0.25 / count) + 1e-3)


def test_bounce_is_nearer_to_the_walk_than_sheet_on_gold():
    gold = go.Conductor.preset("Au", alpha=0.8)
    away = {"sheet": 0.0, "bounce": 0.0}
    for mu in (0.2, 0.5, 0.9):
        mean, _ = walk.albedo(gold, mu, 400_000)
        for color in away:
            away[color] += np.abs(whole_albedo(go.KullaConty(gold, color=color), mu) - mean).sum()
    assert away["bounce"] < away["sheet"]


def test_turquin_scales_by_f0_and_what_is_missing():
    gold = go.Conductor.preset("Au", alpha=0.6)
    f0 = ((np.array(gold.eta) - 1) ** 2 + np.array(gold.k) ** 2) / (
        (np.array(gold.eta) + 1) ** 2 + np.array(gold.k) ** 2
    )
    for mu in (0.2, 0.8):
        e = float(quadrature.moments("ggx", "smith-correlated", mu, 0.6).white)
        expected = gold.eval(direction(mu), direction(0.5, 2.0)) * (1.0 + f0 * (1.0 - e) / e)
        np.testing.assert_allclose(go.Turquin(gold).eval(direction(mu), direction(0.5, 2.0)), expected, rtol=5e-4)


def test_fdez_aguera_adds_a_diffuse_lobe_of_its_own_formula():
    metal = go.Conductor(0.3, 2.0, alpha=0.7, fresnel="schlick")
    f0 = (0.7**2 + 4.0) / (1.3**2 + 4.0)
    mu = 0.5
    found = quadrature.moments("ggx", "smith-correlated", mu, 0.7)
    single, lost = f0 * (found.white - found.schlick) + found.schlick, 1.0 - found.white
    f_avg = f0 + (1.0 - f0) / 21.0
    wo, wi = direction(mu), direction(0.4, 2.0)
    added = go.FdezAguera(metal).eval(wo, wi) - metal.eval(wo, wi)
    expected = single * f_avg / (1.0 - f_avg * lost) * lost * 0.4 / np.pi
    np.testing.assert_allclose(added[0], float(expected), rtol=2e-3)


METAL = {"fresnel": "one", "ndf": "beckmann"}


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("model", "bar"),
    [
        (go.KullaConty(go.Conductor(alpha=0.8, fresnel="one")), 1.5),
        (go.KullaConty(go.Conductor(alpha=(0.1, 0.5), fresnel="one")), 3.0),
        (go.KullaConty(go.Conductor(alpha=(0.05, 0.9), **METAL)), 6.0),
        (go.KullaConty(go.Dielectric(1.5, 0.5)), 3.0),
        (go.KullaConty(go.Dielectric(1.5, (0.1, 0.5), ndf="beckmann")), 4.0),
        (go.KullaConty(go.OrenNayar(1.0, 0.5)), 1.1),
        (go.FdezAguera(go.Conductor(alpha=0.05, **METAL)), 1.5),
    ],
    ids=["metal", "two-widths", "two-widths-beckmann", "glass", "glass-of-two-widths", "measured", "fdez-aguera"],
)
def test_the_mixture_gives_each_lobe_its_share_so_that_no_weight_is_large(model, bar):
    rng = np.random.default_rng(2)
    mu, phi = rng.uniform(0.01, 1.0, 50_000), rng.uniform(0.0, 2.0 * np.pi, 50_000)
    wo, u = direction(mu, phi)[0].T, rng.random((50_000, 3))
    of_base = model.base.sample(wo, u, mode="importance").weight.max()  # 24 for Oren-Nayar at grazing angles
    assert model.sample(wo, u, mode="importance").weight.max() < bar * max(of_base, 1.0)


def test_scaling_methods_close_the_furnace():
    for cls in (go.Turquin, go.FdezAguera):
        for alpha in (0.1, 0.6, 1.0):
            model = cls(go.Conductor(alpha=alpha, fresnel="one"))
            np.testing.assert_allclose(go.albedo(model, MU).value, 1.0, atol=2e-3)


def test_recorded_graph_agrees_with_the_64_bit_twin():
    model = go.KullaConty(go.Conductor.preset("Au", alpha=0.4))
    graph = model.record("eval")
    wo, wi = direction(0.5), direction(0.7, 1.0)
    values = {"self_base_eta": np.array(model.base.eta)[:, None], "self_base_k": np.array(model.base.k)[:, None]}
    values |= {"self_base_alpha": np.array([[0.4], [0.4]]), "self_base_albedo": np.ones((3, 1))}
    found = graph.evaluate(wo=wo.T, wi=wi.T, **values)
    np.testing.assert_allclose(np.asarray(found).ravel(), model.eval(wo, wi, precision="float64").ravel(), rtol=1e-12)


def test_bases_that_cannot_be_compensated_are_refused():
    for cls in (go.Turquin, go.FdezAguera):
        with pytest.raises(go.InputError, match="Conductor or Dielectric expected"):
            cls(go.Lambert())
        with pytest.raises(go.InputError, match="transmits"):
            cls(go.Dielectric())
    with pytest.raises(go.InputError, match="smith-correlated expected"):
        go.RandomWalk(go.Conductor(ndf="beckmann"))
    with pytest.raises(go.InputError, match="unknown color"):
        go.KullaConty(go.Conductor(), color="gold")
