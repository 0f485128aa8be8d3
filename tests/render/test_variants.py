"""Plugins in every variant of Mitsuba: against Mitsuba's own, value by value, and as pictures."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import adapter, engine
from gonio.bridge.adapter.variant import Variant
from gonio.transport import integrators

from sphere import random_directions, random_numbers

mi: Any = engine.load()
import gonio.mitsuba  # noqa: E402
import drjit as dr  # noqa: E402

LLVM = [name for name in mi.variants() if name.startswith("llvm_")]
SCALAR = [name for name in mi.variants() if name.startswith("scalar_")]

N = 512
WO, WI, U = (
    x.astype(np.float32) for x in (random_directions(N, 211), random_directions(N, 212), random_numbers(N, 211))
)


@pytest.fixture(autouse=True)
def variant_restored() -> Iterator[None]:
    yield
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture(params=LLVM)
def variant(request: pytest.FixtureRequest) -> str:
    mi.set_variant(request.param)
    return request.param


def rgb(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def measured(metal: str) -> dict[str, Any]:
    """eta and k as Mitsuba's own plugin reads them."""
    from pathlib import Path

    folder = Path(mi.__file__).parent / "data" / "ior"
    return {name: {"type": "spectrum", "filename": str(folder / f"{metal}.{name}.spd")} for name in ("eta", "k")}


INDEX = {"eta": rgb(0.2, 0.5, 0.9), "k": rgb(0.9, 0.6, 0.8)}  # below 1, where every variant takes rgb as it stands
ROUGH = {"distribution": "ggx", "alpha": 0.3}
# Mitsuba's own plugin, and ours
PAIRS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "conductor": ({"type": "conductor", **INDEX}, {"type": "gonio_conductor", "alpha": 0.0, **INDEX}),
    "roughconductor": (
        {"type": "roughconductor", **ROUGH, **INDEX},
        {"type": "gonio_conductor", "alpha": 0.3, "masking": "smith-separable", **INDEX},
    ),
    "anisotropic": (
        {"type": "roughconductor", "distribution": "beckmann", "alpha_u": 0.1, "alpha_v": 0.5, **INDEX},
        {
            "type": "gonio_conductor",
            "ndf": "beckmann",
            "alpha_x": 0.1,
            "alpha_y": 0.5,
            "masking": "smith-separable",
            **INDEX,
        },
    ),
    "dielectric": (
        {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
        {"type": "gonio_dielectric", "alpha": 0.0, "eta": 1.5},
    ),
    "thindielectric": (
        {"type": "thindielectric", "int_ior": 1.5, "ext_ior": 1.0},
        {"type": "gonio_thin_dielectric", "eta": 1.5, "bounces": "mean"},
    ),
    "roughdielectric": (
        {"type": "roughdielectric", **ROUGH, "int_ior": 1.5, "ext_ior": 1.0},
        {"type": "gonio_dielectric", "alpha": 0.3, "eta": 1.5, "masking": "smith-separable"},
    ),
    "diffuse": (
        {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.8)},
        {"type": "gonio_lambert", "albedo": rgb(0.2, 0.5, 0.8)},
    ),
    "measured metal": (
        {"type": "roughconductor", **ROUGH, "material": "Cu"},
        {"type": "gonio_conductor", "alpha": 0.3, "masking": "smith-separable", "preset": "copper"},
    ),
}


def _interaction() -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, N)
    si.wi = mi.Vector3f(WO.T)
    si.n, si.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.uv = mi.Point2f(0.3, 0.6)
    if mi.is_spectral:
        channels = [np.linspace(370.0 + 5.0 * c, 810.0 + 5.0 * c, N).astype(np.float32) for c in range(4)]
        si.wavelengths = type(si.wavelengths)(*channels)
    return si


def _answers(bsdf: Any) -> tuple[np.ndarray, ...]:
    """(eval, pdf, weight, sampled direction, its pdf), values of unpolarized light; their matrices are checked."""
    si, ctx = _interaction(), mi.BSDFContext()
    value, pdf = bsdf.eval_pdf(ctx, si, mi.Vector3f(WI.T))
    bs, weight = bsdf.sample(ctx, si, mi.Float(U[:, 0]), mi.Point2f(U[:, 1], U[:, 2]))
    plain = [np.array(mi.unpolarized_spectrum(v)) for v in (value, weight)]
    value, weight = (np.broadcast_to(v.reshape(len(v), -1), (len(v), N)) for v in plain)
    return value, np.array(pdf), weight, np.array(bs.wo), np.array(bs.pdf)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", PAIRS)
def test_plugins_give_what_mitsubas_give(variant: str, name: str) -> None:
    if name == "measured metal" and not mi.is_spectral:
        pytest.skip("with three colours, or one, the preset is another fit; see below")
    native, ours = (_answers(mi.load_dict(plugin)) for plugin in PAIRS[name])
    channels = {"rgb": 3, "mono": 1, "spectral": 4}[variant.split("_")[2]]
    assert ours[0].shape == (channels, N) and np.isfinite(ours[0]).all()
    np.testing.assert_allclose(ours[0], native[0], rtol=1e-3, atol=1e-6)
    if name in ("conductor", "dielectric", "thindielectric"):
        up = WO[:, 2] > 0.0 if name == "conductor" else np.full(N, True)
        np.testing.assert_allclose(ours[2][:, up], native[2][:, up], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(ours[3][:, up], native[3][:, up], atol=1e-5)
    else:
        assert native[0].max() > 0.1, "both would be black"


@pytest.mark.sample(1)
@pytest.mark.parametrize("polarized", [name for name in LLVM if name.endswith("polarized")])
def test_pictures_of_unpolarized_light_are_those_of_the_plain_variant(polarized: str) -> None:
    pictures = []
    for name in (polarized.removesuffix("_polarized"), polarized):
        mi.set_variant(name)
        mi.set_log_level(mi.LogLevel.Error)
        to_world = mi.ScalarTransform4f
        kulla = {"type": "gonio_kulla_conty", "base": {"type": "gonio_conductor", "preset": "Au", "alpha": 0.5}}
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 3},
                "sensor": {
                    "type": "perspective",
                    "to_world": to_world().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]),
                    "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
                },
                "floor": {"type": "rectangle", "bsdf": kulla},
                "sky": {"type": "constant"},
            }
        )
        pictures.append(np.array(mi.render(scene, spp=64, seed=2)))
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=1e-3, atol=1e-4)


@pytest.mark.slow
def test_metals_in_spectral_variants_are_mitsubas_measurements_over_the_whole_range() -> None:
    """And how far the three numbers of the preset are from them, for which `Variant.measured` has the figures."""
    mi.set_variant("llvm_ad_spectral")
    wavelengths = np.arange(360.0, 831.0, 1.0).astype(np.float32)
    si = dr.zeros(mi.SurfaceInteraction3f, len(wavelengths))
    si.wavelengths = type(si.wavelengths)(*[mi.Float(wavelengths)] * 4)
    luminosity = np.array([np.array(mi.cie1931_xyz(mi.Float(wavelengths)))[1]]).ravel()
    apart = {}
    for symbol, preset in go.Conductor.presets().items():
        found = [Variant(mi).measured(symbol, name) for name in ("eta", "k")]
        if found[0] is None or found[1] is None:
            assert symbol in ("Fe", "Ti"), "these alone are not among Mitsuba's data"
            continue
        curves = [np.array(texture.eval(si))[0] for texture in found]
        three = [np.array(Variant(mi).through_rgb(preset.values[name]).eval(si))[0] for name in ("eta", "k")]
        bright = [np.sum(luminosity * _reflectance(*index)) for index in (curves, three)]
        apart[symbol] = bright[0] / bright[1] - 1.0
    figures = {"Ag": 0.010, "Al": 0.007, "Au": 0.061, "Cr": 0.189, "Cu": -0.049, "Hg": 0.001, "Ni": 0.002, "W": 0.004}
    assert apart == pytest.approx(figures, abs=1e-3)


def _reflectance(eta: np.ndarray, k: np.ndarray) -> np.ndarray:
    """At normal incidence."""
    return ((eta - 1.0) ** 2 + k**2) / ((eta + 1.0) ** 2 + k**2)


@pytest.mark.slow
@pytest.mark.parametrize("by", ["preset", "numbers"])
def test_a_metal_without_a_measured_spectrum_goes_through_its_three_values(by: str) -> None:
    """Mitsuba would turn numbers into a reflectance, of 1 at most."""
    mi.set_variant("llvm_ad_spectral")
    metal = go.Conductor.presets()["Ti"].values
    given = {"preset": "Ti"} if by == "preset" else {name: rgb(*metal[name]) for name in ("eta", "k")}
    bsdf = mi.load_dict({"type": "gonio_conductor", "alpha": 0.0, **given})
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.sh_frame = mi.Vector3f(0, 0, 1), mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.wavelengths = type(si.wavelengths)(650.0, 550.0, 450.0, 830.0)
    weight = np.array(bsdf.sample(mi.BSDFContext(), si, mi.Float(0.5), mi.Point2f(0.5))[1]).ravel()
    titanium = go.Conductor.preset("Ti", alpha=0.0).sample([0, 0, 1.0], [0.5, 0.5, 0.5]).weight[0]
    assert weight == pytest.approx([*titanium, titanium[0]], rel=1e-5)


@pytest.mark.slow
def test_negative_fitted_figures_are_one_clear_error_in_spectral_variants() -> None:
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(RuntimeError, match="a negative color has no spectrum"):
        mi.load_dict({"type": "gonio_shifted_gamma", "preset": "brass"})


@pytest.mark.slow
def test_a_colour_in_mono_is_its_luminance() -> None:
    mi.set_variant("llvm_ad_mono")
    bsdf = mi.load_dict({"type": "gonio_lambert", "albedo": rgb(0.2, 0.9, 0.4)})
    reflectance = np.array(bsdf.eval_diffuse_reflectance(_interaction())).ravel()
    assert reflectance == pytest.approx(float(mi.luminance(mi.Color3f(0.2, 0.9, 0.4))[0]), rel=1e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SCALAR)
def test_scalar_variants_are_one_clear_error(name: str) -> None:
    mi.set_variant(name)
    with pytest.raises(RuntimeError, match=rf"(?s)gonio_conductor: variant {name} works on one ray.*set llvm_ad_rgb"):
        mi.load_dict({"type": "gonio_conductor"})


@pytest.mark.parametrize(
    "name, what", [("llvm_ad_mono_polarized", "is polarized"), ("scalar_rgb", "works on one ray at a time")]
)
def test_our_integrators_say_in_which_variants_they_do_not_work(name: str, what: str) -> None:
    mi.set_variant(name)
    scene = mi.load_dict({"type": "scene", "camera": {"type": "perspective"}})
    with pytest.raises(go.InputError, match=f"{name} {what}"):
        integrators.Render(scene, integrators.Settings())


# --------------------------------------------------------------------------- a user's own material

WARD = """
import gonio as go
from gonio import BSDF, spectrum, width
from gonio.ops import where, exp, sqr, inv_pi

class Ward(BSDF):
    '''Ward's gloss, isotropic and without normalization.'''

    albedo: object = spectrum((0.9, 0.6, 0.3), "share of light that is reflected", high=1.0)
    alpha: object = width(0.3, "width of the highlight")

    def eval(self, wo, wi, mode="radiance"):
        h = wo + wi
        tan2 = (sqr(h.x) + sqr(h.y)) / sqr(h.z)
        lobe = exp(-tan2 / sqr(self.alpha.x)) * inv_pi / (4.0 * sqr(self.alpha.x))
        return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), lobe, 0.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize("order", [
    "import gonio.mitsuba; go.BSDF.family.add(Ward)",
    "go.BSDF.family.add(Ward); import gonio.mitsuba",
    "import mitsuba as mi; mi.set_variant('llvm_ad_spectral'); import gonio.mitsuba; go.BSDF.family.add(Ward)",
    "import mitsuba as mi; mi.set_variant('llvm_ad_spectral'); import gonio.mitsuba; go.BSDF.family.add(Ward); "
    "mi.set_variant('llvm_ad_mono')",
])  # fmt: skip
def test_a_registered_material_is_a_plugin_whenever_it_was_registered(order: str) -> None:
    code = (
        f"{WARD}\n{order}\n"
        + """
import mitsuba as mi, drjit as dr
bsdf = mi.load_dict({"type": "gonio_ward", "alpha": 0.2})
si = dr.zeros(mi.SurfaceInteraction3f)
si.wi = mi.Vector3f(0, 0, 1)
if mi.is_spectral: si.wavelengths = type(si.wavelengths)(550)
value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1))
expected = {3: 0.6, 1: 0.2126 * 0.9 + 0.7152 * 0.6 + 0.0722 * 0.3, 4: 0.6}[len(value)] / (4 * 0.04 * dr.pi)
assert abs(value[1 % len(value)][0] / expected - 1) < 0.02, (value, expected)
"""
    )
    got = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert got.returncode == 0, got.stderr[-2000:]


def test_a_preset_sets_choices_and_numbers_of_a_plugin() -> None:
    from collections.abc import Mapping

    from gonio.material import BSDF, Preset, choice, spectrum

    class Paint(BSDF):
        """A diffuse surface that is matte or dead."""

        kind: str = choice("dead", "how it reflects", {"matte": "as Lambert has it", "dead": "not at all"})
        albedo: Any = spectrum(0.5, "share of light that is reflected", high=1.0)

        @classmethod
        def presets(cls) -> Mapping[str, Preset]:
            return {"chalk": Preset("white chalk", {"kind": "matte", "albedo": 0.9})}

        def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
            return self.albedo * (go.ops.abs(wi.z) * (go.ops.inv_pi if self.kind == "matte" else 0.0))

    go.BSDF.family.add(Paint)
    try:
        bsdfs = [mi.load_dict({"type": "gonio_paint", **more}) for more in ({}, {"preset": "white chalk"})]
        dead, chalk = (np.array(b.eval(mi.BSDFContext(), _interaction(), mi.Vector3f(WI.T))) for b in bsdfs)
    finally:
        go.BSDF.family.remove("paint")
    assert not dead.any()
    np.testing.assert_allclose(chalk[1], 0.9 / np.pi * np.abs(WI[:, 2]), rtol=1e-5)


def test_a_class_loaded_anew_takes_its_place() -> None:
    plugins = []
    for factor in (1.0, 0.5):
        space: dict[str, Any] = {"__name__": __name__}
        exec(WARD.replace("self.albedo * where", f"{factor} * self.albedo * where"), space)
        go.BSDF.family.add(space["Ward"])
        plugins.append(mi.load_dict({"type": "gonio_ward"}))
    go.BSDF.family.remove("ward")
    values = [np.array(p.eval(mi.BSDFContext(), _interaction(), mi.Vector3f(WI.T))) for p in plugins]
    np.testing.assert_allclose(values[1], 0.5 * values[0], rtol=1e-6)
    assert adapter.plugin_name("blinn-phong") == "gonio_blinn_phong"
