"""Mueller matrices of the plugins: against Mitsuba's own, and against the Fresnel equations in 64 bits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.optics.fresnel import waves

from sphere import random_directions, random_numbers

mi: Any = engine.load()
import gonio.mitsuba  # noqa: E402
import drjit as dr  # noqa: E402

N = 2000
WO, WI, U = (
    x.astype(np.float32) for x in (random_directions(N, 311), random_directions(N, 312), random_numbers(N, 311))
)
BAR = 1e-5  # of the first entry


@pytest.fixture(autouse=True, params=["llvm_ad_mono_polarized", "llvm_ad_spectral_polarized"])
def variant(request: pytest.FixtureRequest) -> Iterator[None]:
    mi.set_variant(request.param)
    yield
    mi.set_variant("llvm_ad_rgb")


def rgb(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


ETA, K = 0.4, 0.9  # grey, and below 1, where every variant takes rgb as it stands
INDEX = {"eta": rgb(ETA, ETA, ETA), "k": rgb(K, K, K)}
COLOURED = {"eta": rgb(0.2, 0.5, 0.9), "k": rgb(0.9, 0.6, 0.8)}
METAL = {"type": "gonio_conductor", "alpha": 0.3, "masking": "smith-separable"}


def interaction(wo: np.ndarray) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi = mi.Vector3f(wo.T)
    si.n, si.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f(mi.Normal3f(0, 0, 1))
    if mi.is_spectral:
        si.wavelengths = type(si.wavelengths)(450, 520, 600, 650)
    return si


def matrices(value: Any) -> np.ndarray:
    """(channels, N, 4, 4)."""
    return np.moveaxis(np.array(value).reshape(4, 4, -1, N), (2, 3), (0, 1)).astype(np.float64)


def evaluated(bsdf: Any, wo: np.ndarray, wi: np.ndarray, mode: Any) -> np.ndarray:
    return matrices(bsdf.eval(mi.BSDFContext(mode), interaction(wo), mi.Vector3f(wi.T)))


def sampled(bsdf: Any, wo: np.ndarray, mode: Any) -> tuple[np.ndarray, np.ndarray]:
    u = mi.Float(U[:, 0]), mi.Point2f(U[:, 1], U[:, 2])
    bs, weight = bsdf.sample(mi.BSDFContext(mode), interaction(wo), *u)
    return np.array(bs.wo).T, matrices(weight)


def apart(got: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The largest difference of an entry over the first, where there is light."""
    some = right[..., 0, 0] > 1e-8
    return np.abs(got - right).max(axis=(-2, -1))[some] / right[..., 0, 0][some]


# ---------------------------------------------------------------------- the equations, in NumPy


def cross_of(normal: np.ndarray, ray: np.ndarray) -> np.ndarray:
    across = np.cross(normal, ray)
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def rotator(current: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """From a basis to Mitsuba's own of the ray."""
    target = np.array(mi.mueller.stokes_basis(mi.Vector3f(ray.T.astype(np.float32)))).T.astype(np.float64)
    cos, sin = (current * target).sum(1), (np.cross(current, target) * ray).sum(1)
    turn = np.tile(np.eye(4), (len(ray), 1, 1))
    turn[:, 1, 1] = turn[:, 2, 2] = cos**2 - sin**2
    turn[:, 1, 2] = 2 * sin * cos
    turn[:, 2, 1] = -turn[:, 1, 2]
    return turn


def truth(wo: np.ndarray, wi: np.ndarray, eta: Any, k: Any = 0.0) -> np.ndarray:
    """The matrix of one facet over its first entry, from the basis of -wi to that of wo."""
    wo, wi = wo.astype(np.float64), wi.astype(np.float64)
    wo, wi = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wo, wi))
    eta = np.broadcast_to(np.where(wo[:, 2] > 0, eta, 1 / np.asarray(eta)) if np.all(k == 0.0) else eta, len(wo))
    reflects = wo[:, 2] * wi[:, 2] > 0
    h = wo + np.where(reflects, 1.0, eta)[:, None] * wi
    m = h / np.linalg.norm(h, axis=1, keepdims=True)
    theta = np.arctan2(np.linalg.norm(np.cross(m, wo), axis=1), np.abs((m * wo).sum(1)))
    at = go.fresnel(theta, eta, k)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(
            reflects[:, None, None], at.reflection / at.R[:, None, None], at.refraction / at.T[:, None, None]
        )
    into, out = rotator(cross_of(m, -wi), -wi), rotator(cross_of(m, wo), wo)
    return out @ own @ into.transpose(0, 2, 1)


# ---------------------------------------------------------------------- against Mitsuba


@pytest.mark.sample(1)
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_a_rough_metal_has_mitsubas_matrices(mode: str) -> None:
    transport = getattr(mi.TransportMode, mode)
    native = mi.load_dict({"type": "roughconductor", "distribution": "ggx", "alpha": 0.3, **COLOURED})
    ours = mi.load_dict({**METAL, **COLOURED})
    wo, wi = np.abs(WO), np.abs(WI) * [1, -1, 1]
    got, right = (evaluated(b, wo, wi.astype(np.float32), transport) for b in (ours, native))
    assert apart(got, right).max() < BAR and right[..., 1, 2].any()


@pytest.mark.sample(1)
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_a_polished_metal_has_mitsubas_matrices(mode: str) -> None:
    transport = getattr(mi.TransportMode, mode)
    native = mi.load_dict({"type": "conductor", **COLOURED})
    ours = mi.load_dict({"type": "gonio_conductor", "alpha": 0.0, **COLOURED})
    (_, got), (_, right) = (sampled(b, np.abs(WO), transport) for b in (ours, native))
    assert apart(got, right).max() < BAR and right[..., 3, 2].any()


@pytest.mark.sample(1)
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_smooth_glass_has_mitsubas_matrices(mode: str) -> None:
    """But where Mitsuba's own are off the equations in 64 bits, by up to 3e-4: at grazing angles from inside."""
    transport = getattr(mi.TransportMode, mode)
    native = mi.load_dict({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    ours = mi.load_dict({"type": "gonio_dielectric", "alpha": 0.0, "eta": 1.5})
    (wi, got), (_, right) = (sampled(b, WO, transport) for b in (ours, native))
    pair = (WO, wi) if mode == "Radiance" else (wi, WO)
    exact = truth(*pair, 1.5) * got[0, :, :1, :1]
    assert apart(got[0], exact).max() < BAR
    assert (wi[:, 2] * WO[:, 2] < 0).any() and (np.abs(got[0, :, 3, 2]) > 0.1).any()  # both, and total reflection
    sound = apart(right[0], exact) < 0.5 * BAR
    assert sound.mean() > 0.98 and apart(got[:, sound], right[:, sound]).max() < BAR


# ---------------------------------------------------------------------- against the equations


@pytest.mark.sample(1)
@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_rough_glass_polarizes_as_its_facets_do(alpha: float) -> None:
    """Mitsuba's depolarizes."""
    glass = mi.load_dict({"type": "gonio_dielectric", "alpha": alpha, "eta": 1.5})
    wi, weight = sampled(glass, WO, mi.TransportMode.Radiance)
    got = evaluated(glass, WO, wi.astype(np.float32), mi.TransportMode.Radiance)
    exact = truth(WO, wi, 1.5)
    lit = (got[0, :, 0, 0] > 1e-6) & np.isfinite(exact).all(axis=(1, 2))
    assert lit.mean() > 0.7
    for found in (got[0], weight[0]):
        # float32 directions of a pair that is nearly straight through hardly tell the facet between them
        off = apart(found[lit], exact[lit] * found[lit][:, :1, :1])
        assert np.quantile(off, 0.99) < BAR and off.max() < 1e-3


@pytest.mark.sample(1)
def test_a_rough_metal_polarizes_as_its_facets_do() -> None:
    got = evaluated(mi.load_dict({**METAL, **INDEX}), np.abs(WO), np.abs(WI), mi.TransportMode.Radiance)
    exact = truth(np.abs(WO), np.abs(WI), ETA, K)
    assert apart(got[0], exact * got[0, :, :1, :1]).max() < BAR


@pytest.mark.sample(1)
def test_a_mirror_is_a_perfect_conductor() -> None:
    wi, got = sampled(mi.load_dict({"type": "gonio_mirror"}), np.abs(WO), mi.TransportMode.Radiance)
    near = truth(np.abs(WO), wi, 1e-9, 1e10)  # an index without end: r_s = -1, r_p = 1
    assert apart(got[0], near).max() < BAR


@pytest.mark.slow
def test_a_pane_has_the_matrices_of_all_its_bounces() -> None:
    wi, got = sampled(mi.load_dict({"type": "gonio_thin_dielectric", "eta": 1.5}), WO, mi.TransportMode.Radiance)
    cos = np.abs(WO[:, 2].astype(np.float64))
    outside = go.fresnel(np.arccos(np.minimum(cos, 1.0)), 1.5)
    inside = go.fresnel(np.arcsin(np.sqrt(1.0 - cos**2) / 1.5), 1 / 1.5)
    back, on, inner = outside.reflection, outside.refraction, inside.reflection
    out = inside.refraction
    through, turns = np.zeros_like(back), np.tile(np.eye(4), (N, 1, 1))
    reflected = back.copy()
    for _ in range(200):
        through += out @ turns @ on
        reflected += out @ inner @ turns @ on
        turns = inner @ inner @ turns
    reflects = wi[:, 2] * WO[:, 2] > 0
    own = np.where(reflects[:, None, None], reflected, through)
    up = np.tile([0.0, 0.0, 1.0], (N, 1))
    wo, wi = WO.astype(np.float64), wi.astype(np.float64)
    wi = np.where(reflects[:, None], wo * [-1.0, -1.0, 1.0], -wo)
    exact = rotator(cross_of(up, wo), wo) @ own @ rotator(cross_of(up, -wi), -wi).transpose(0, 2, 1)
    exact *= (got[0, :, 0, 0] / exact[:, 0, 0])[:, None, None]
    usual = cos > 0.02  # 200 bounces are not all where nearly all is reflected
    assert reflects.any() and (~reflects).any()
    assert apart(got[0][usual], exact[usual]).max() < BAR


@pytest.mark.slow
def test_a_film_polarizes_as_its_layers_do() -> None:
    if not mi.is_spectral:
        pytest.skip("of the waves at single wavelengths: a film in mono is a sum of many")
    film = {"type": "gonio_film_conductor", "alpha": 0.3, "thickness": 400.0, "film_eta": 1.6, **INDEX}
    wo, wi = np.abs(WO), np.abs(WI)
    got = evaluated(mi.load_dict(film), wo, wi, mi.TransportMode.Radiance)
    bare = evaluated(
        mi.load_dict({"type": "gonio_conductor", "alpha": 0.3, **INDEX}), wo, wi, mi.TransportMode.Radiance
    )
    a, b = (w.astype(np.float64) / np.linalg.norm(w.astype(np.float64), axis=1, keepdims=True) for w in (wo, wi))
    m = (a + b) / np.linalg.norm(a + b, axis=1, keepdims=True)
    cos, sin2 = (m * a).sum(1), 1.0 - (m * a).sum(1) ** 2
    into, out = rotator(cross_of(m, -b), -b), rotator(cross_of(m, a), a)
    w2, w3 = np.sqrt(1.6**2 - sin2), np.sqrt((ETA + 1j * K) ** 2 - sin2)
    for channel, nm in enumerate((450.0, 520.0, 600.0, 650.0)):
        delta = 2 * np.pi * 400.0 * w2 / nm
        fields = []
        for x, y, z in ((cos, w2, w3), (cos, w2 / 1.6**2, w3 / (ETA + 1j * K) ** 2)):
            top, other = np.cos(delta) - 1j * np.sin(delta) * z / y, z * np.cos(delta) - 1j * y * np.sin(delta)
            fields.append((x * top - other) / (x * top + other))
        s, p = fields
        own = waves.mueller(np.abs(s) ** 2, np.abs(p) ** 2, s * np.conj(p))
        uncoated = go.fresnel(np.arccos(cos), ETA, K).R
        exact = out @ own @ into.transpose(0, 2, 1) * (bare[channel, :, 0, 0] / uncoated)[:, None, None]
        assert apart(got[channel], exact).max() < 1e-4  # float32, and fringes


# ---------------------------------------------------------------------- materials of materials


@pytest.mark.sample(1)
def test_what_is_not_specular_depolarizes() -> None:
    for plugin in ("lambert", "oren_nayar", "phong", "metal"):
        got = evaluated(mi.load_dict({"type": f"gonio_{plugin}"}), WO, WI, mi.TransportMode.Radiance)
        assert got[..., 0, 0].max() > 0.01
        got[..., 0, 0] = 0.0
        assert not got.any()


@pytest.mark.sample(1)
def test_of_a_compensated_metal_the_light_scattered_once_is_polarized() -> None:
    base = {**METAL, **INDEX, "alpha": 0.8}
    wo, wi = np.abs(WO), np.abs(WI)
    single = evaluated(mi.load_dict(base), wo, wi, mi.TransportMode.Radiance)
    for name in ("kulla_conty", "turquin", "fdez_aguera"):
        got = evaluated(mi.load_dict({"type": f"gonio_{name}", "base": base}), wo, wi, mi.TransportMode.Radiance)
        assert np.all(got[..., 0, 0] >= single[..., 0, 0])
        got[..., 0, 0] = single[..., 0, 0]
        assert apart(got, single).max() < BAR


@pytest.mark.sample(1)
def test_a_mix_has_the_matrices_of_both() -> None:
    a, b = {**METAL, **INDEX}, {"type": "gonio_dielectric", "alpha": 0.5, "eta": 1.7}
    mixed = {"type": "gonio_mix", "a": a, "b": b, "weight": 0.25}
    first, second, got = (evaluated(mi.load_dict(p), WO, WI, mi.TransportMode.Radiance) for p in (a, b, mixed))
    assert apart(got, 0.75 * first + 0.25 * second).max() < BAR


@pytest.mark.sample(1)
def test_both_sides_of_a_two_sided_metal_polarize_alike() -> None:
    """Mirrored at the surface: the sense in which light turns is then the other one."""
    plugin = mi.load_dict({**METAL, **INDEX, "two_sided": True})
    below = np.array([1, 1, -1], np.float32)
    got = evaluated(plugin, np.abs(WO) * below, np.abs(WI) * below, mi.TransportMode.Radiance)
    exact = truth(np.abs(WO) * below, np.abs(WI) * below, ETA, K)
    assert apart(got[0], exact * got[0, :, :1, :1]).max() < BAR


@pytest.mark.sample(1)
def test_samples_weigh_what_eval_says() -> None:
    for plugin in ({**METAL, **INDEX}, {"type": "gonio_kulla_conty", "base": {**METAL, **INDEX}}):
        bsdf, ctx = mi.load_dict(plugin), mi.BSDFContext()
        wo = np.abs(WO)
        wi, weight = sampled(bsdf, wo, mi.TransportMode.Radiance)
        value = evaluated(bsdf, wo, wi, mi.TransportMode.Radiance)
        pdf = np.array(bsdf.pdf(ctx, interaction(wo), mi.Vector3f(wi.T.astype(np.float32))))
        drawn = pdf > 0
        assert apart(weight[:, drawn] * pdf[drawn][:, None, None], value[:, drawn]).max() < 1e-4
