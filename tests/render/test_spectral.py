"""Spectral renders: what refracts where, by wavelength; lamps by their spectra; what all others see of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import scene
from gonio.bridge import adapter, engine
from gonio.bridge.adapter.variant import SEPARATES
from gonio.errors import InputError
from gonio.scene import spectra
from gonio.scene.values import Blackbody, Daylight, Led
from gonio.transport.integrators import Render, Settings

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

ROOT = Path(__file__).parents[2]
WHITE = {"type": "d65"}
WARM = {"type": "blackbody", "temperature": 2856}


@pytest.fixture(autouse=True)
def rgb_again() -> Iterator[None]:
    """Other files' tests count on three colours."""
    yield
    mi.set_variant("llvm_ad_rgb")


def _spectral() -> None:
    mi.set_variant("llvm_ad_spectral")
    adapter.register(mi)


def ball(eta: object, energy: object = WHITE, alpha: float = 0.0, size: int = 16, **more: object) -> dict[str, Any]:
    """A ball before a lamp: what is seen through it is the lamp, refracted twice."""
    glass = {"type": "gonio-dielectric", "eta": eta, "alpha": alpha, **more}
    lamp = {"type": "parallelogram", "base": [-1.6, -1.6, -3], "edge0": [1.6, 0, 0], "edge1": [0, 3.2, 0]}
    return {
        "output": {"filename": "ball.exr"},
        "sampler": {"type": "default", "samples": 64},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 6], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 18,
            "film": {"size": [size, size]},
        },
        "integrator": {"type": "path", "maxDepth": 6},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": glass}],
            "lights": [{"type": "areaLight", "energy": energy, "shape": lamp}],
        },
    }


def rendered(folder: Path, described: Mapping[str, object], **how: Any) -> np.ndarray:
    file = folder / "scene.json"
    file.write_text(json.dumps(described))
    return np.asarray(go.render(file, **how), float)


def test_a_color_of_at_most_1_is_the_same_at_all_points() -> None:
    """The tables of a coat are computed once, and the texture of such a color was taken for a varying one."""
    _spectral()
    metal = {"type": "gonio_conductor", "alpha": 0.3}
    metal |= {name: {"type": "rgb", "value": [value] * 3} for name, value in (("eta", 0.5), ("k", 0.8))}
    coated = mi.load_dict({"type": "gonio_coat", "base": metal, "index": 1.4})
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wavelengths = type(si.wavelengths)(450.0, 500.0, 550.0, 600.0)
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    value = np.array(coated.eval(mi.BSDFContext(), si, mi.Vector3f(0.0, 0.6, 0.8)))
    expected = go.Coat(base=go.Conductor(eta=0.5, k=0.8, alpha=0.3), index=1.4).eval([0.6, 0, 0.8], [0, 0.6, 0.8])
    np.testing.assert_allclose(value.ravel(), expected[0, 0], rtol=0.01)


# ---------------------------------------------------------------------- dispersion


def _refracted(name: str, wavelengths: list[float], sin: float, ctx: Any = None) -> np.ndarray:
    """sin theta_t of the plugin's transmitted direction, by the first wavelength of each ray."""
    _spectral()
    bsdf = mi.load_dict({"type": "gonio_dielectric", "eta": name, "alpha": 0.0})
    si = dr.zeros(mi.SurfaceInteraction3f, len(wavelengths))
    si.wavelengths = type(si.wavelengths)(mi.Float(wavelengths), mi.Float(400.0), mi.Float(500.0), mi.Float(600.0))
    si.wi = mi.Vector3f(sin, 0.0, float(np.sqrt(1.0 - sin**2)))
    if ctx is None:
        ctx = mi.BSDFContext()
        ctx.type_mask = SEPARATES
    found = bsdf.sample(ctx, si, mi.Float(0.999), mi.Point2f(0.5))[0].wo
    return np.abs(np.array(found)[0])


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["bk7", "diamond", "water", "cauchy(1.5, 0.01)"])
def test_each_wavelength_refracts_by_its_own_index(name: str) -> None:
    wavelengths = [380.5, 434.2, 486.1, 589.3, 656.27, 759.9]
    eta = go.refractive_index(name, wavelengths).eta
    np.testing.assert_allclose(_refracted(name, wavelengths, 0.6), 0.6 / eta, rtol=2e-6)


def test_beyond_its_source_an_index_stays_level_where_little_is_seen() -> None:
    eta = go.refractive_index("diamond", 760.0).eta
    np.testing.assert_allclose(_refracted("diamond", [760.0, 800.0, 830.0], 0.6), 0.6 / eta, rtol=2e-6)


def test_mitsubas_own_integrators_get_the_index_of_sodium_light() -> None:
    sines = _refracted("sf11", [400.0, 700.0], 0.6, ctx=engine.load().BSDFContext())
    np.testing.assert_allclose(sines, 0.6 / go.refractive_index("sf11", 589.3).eta, rtol=2e-6)


def test_in_rgb_glass_has_the_index_of_sodium_light(tmp_path: Path) -> None:
    named, number = (rendered(tmp_path, ball(eta), spp=16) for eta in ("sf11", 1.7844560))
    np.testing.assert_allclose(named, number, rtol=1e-3, atol=1e-4)


# smooth glass: the tests of Snell's window, of rainbows and of single wavelengths see it too
@pytest.mark.slow
@pytest.mark.parametrize("alpha", [pytest.param(0.0, marks=pytest.mark.slow), 0.15])
def test_a_dispersing_ball_is_the_sum_of_its_single_wavelengths(tmp_path: Path, alpha: float) -> None:
    """Lamps of four lines, and glass whose index differs much between them: each line alone sees a plain index."""
    glass, peaks = "cauchy(1.2, 0.08)", [[450, 4, 1.0], [520, 4, 0.6], [580, 4, 0.8], [640, 4, 1.0]]

    def seen(eta: object, light: dict[str, object], seed: int = 1) -> np.ndarray:
        picture = rendered(tmp_path, ball(eta, light, alpha, 32), spp=2048, spectral=True, seed=seed)
        return picture.reshape(4, 8, 4, 8, 3).mean((1, 3))  # a line is met by few of the samples

    together = seen(glass, {"type": "led", "peaks": peaks})
    shares = [spectra.curve(Led(type="led", peaks=[tuple(peak)])) for peak in peaks]
    luminous = [peak[2] / share.max() for peak, share in zip(peaks, shares, strict=True)]
    apart = 0.0
    for peak, weight in zip(peaks, luminous, strict=True):
        eta = float(go.refractive_index(glass, peak[0]).eta)
        light = {"type": "led", "peaks": [peak], "scale": weight / sum(luminous)}
        apart = apart + seen(eta, light, seed=3)
    scale = np.abs(apart).max()
    assert np.abs(together - apart).max() < 0.03 * scale
    np.testing.assert_allclose(together.mean((0, 1)), apart.mean((0, 1)), atol=0.01 * np.abs(apart.mean((0, 1))).max())
    plain = seen(1.45, {"type": "led", "peaks": peaks})
    assert np.abs(plain - apart).max() > 0.1 * scale, "or the test could not fail"


def test_without_dispersion_a_spectral_picture_is_as_quiet_as_ever(tmp_path: Path) -> None:
    """Only where indices differ does a path go on with one wavelength."""
    _spectral()
    file = tmp_path / "scene.json"
    for eta, separates in (("sf11", True), (1.5, False), ("glass", False)):
        file.write_text(json.dumps(ball(eta)))
        render = Render(scene.build(scene.read(file), mi), Settings("path"))
        assert render._integrator.disperses is separates, eta


@pytest.mark.slow
def test_a_normal_map_on_dispersing_glass_lets_it_disperse(tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(np.full((2, 2, 3), (128, 128, 255), np.uint8)).save(tmp_path / "flat.png")
    flat = {"normalmap": {"type": "imageTex", "file": "flat.png"}}
    plain, mapped = (rendered(tmp_path, ball("sf11", **more), spp=512, spectral=True) for more in ({}, flat))
    assert np.abs(plain - mapped).mean() < 0.02 * plain.mean()


# ---------------------------------------------------------------------- closed forms, by the scenes that show them


def _benchmark() -> Any:
    import importlib.util

    spec = importlib.util.spec_from_file_location("bench_spectral", ROOT / "benchmarks/spectral.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_a_prism_turns_each_line_as_snell_and_sellmeier_have_it() -> None:
    assert np.abs(_benchmark().prism()).max() < 0.005, "degrees"


@pytest.mark.slow
def test_snells_window_ends_at_the_critical_angle() -> None:
    assert abs(_benchmark().window(spp=16)) < 1.0, "pixels"


@pytest.mark.slow
def test_the_bows_of_water_are_where_descartes_has_them() -> None:
    assert np.abs(_benchmark().bow(rays=100_000)).max() < 0.05, "degrees"


# ---------------------------------------------------------------------- lamps


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "light",
    [
        WHITE | {"scale": 2.0},
        WARM,
        {"type": "led", "peaks": [[450, 20, 1.0], [570, 110, 0.8]], "scale": 0.7},
        {"type": "spectrum", "wavelengths": [380, 500, 780], "values": [0.2, 1.0, 0.6]},
    ],
)
def test_a_lamp_looks_alike_in_rgb_and_by_its_spectrum(tmp_path: Path, light: dict[str, object]) -> None:
    pictures = [rendered(tmp_path, ball(1.5, light), spp=1024, spectral=spectral) for spectral in (False, True)]
    seen = pictures[0].sum(2) > 0.5
    rgb, spectral = (picture[seen].mean(0) for picture in pictures)
    np.testing.assert_allclose(spectral, rgb, atol=0.01 * rgb.max())
    brightest = (pictures[1] @ [0.2126, 0.7152, 0.0722]).max()
    assert brightest == pytest.approx(light.get("scale", 1.0), rel=0.01), "beside the ball"


@pytest.mark.slow
@pytest.mark.parametrize("dark", ["a sky of no light", "a lamp of no power", "a lamp of 0 by its spectrum"])
def test_what_is_dark_beside_a_lamp_takes_nothing_from_it(tmp_path: Path, dark: str) -> None:
    mi.Bitmap(np.zeros((4, 8, 3), np.float32)).write(str(tmp_path / "dark.exr"))
    above = {"type": "parallelogram", "base": [-1, 2, -1], "edge0": [2, 0, 0], "edge1": [0, 0, 2]}
    light: dict[str, Any] = {"type": "areaLight", "energy": 0.0, "shape": above}
    if "sky" in dark:
        light = {"type": "environmentLight", "texture": {"type": "imageTex", "file": "dark.exr"}}
    if "spectrum" in dark:
        light["energy"] = {"type": "d65", "scale": 0.0}
    scene = ball(1.5, WHITE, 0.2)
    alone = rendered(tmp_path, scene, spp=64, spectral=True)
    scene["scene"]["lights"].append(light)
    for integrator in ("path", "caustics"):
        with_it = rendered(tmp_path, scene, spp=64, spectral=True, integrator=integrator)
        assert with_it.mean() == pytest.approx(alone.mean(), rel=0.02)
    scene["scene"]["lights"] = [light]
    assert not rendered(tmp_path, scene, spp=4, spectral=True).any()


def test_lamps_have_the_chromaticities_of_the_standard_illuminants() -> None:
    observer = spectra._observer()
    for light, x, y in (
        (Daylight(type="d65"), 0.3127, 0.3290),
        (Blackbody(type="blackbody", temperature=2856), 0.4476, 0.4074),
    ):
        xyz = observer @ spectra.curve(light)
        assert xyz[:2] / xyz.sum() == pytest.approx([x, y], abs=3e-4)
        assert xyz[1] == pytest.approx(1.0, rel=1e-9)


def test_a_colour_that_rgb_cannot_show_keeps_its_luminance() -> None:
    green = spectra.colour(Led(type="led", peaks=[(520, 10, 1)], scale=3.0))
    assert min(green) == 0.0 and np.dot(green, [0.212671, 0.715160, 0.072169]) == pytest.approx(3.0, rel=1e-5)


@pytest.mark.parametrize(
    "light, message",
    [
        ({"type": "blackbody", "temperature": 0}, "500"),
        ({"type": "blackbody"}, "temperature"),
        ({"type": "led", "peaks": [[1200, 20, 1]]}, "1200 nm is not visible"),
        ({"type": "led", "peaks": []}, "peaks"),
        ({"type": "led", "peaks": [[500, 20, 0]]}, "no peak"),
        ({"type": "spectrum", "wavelengths": [0.4, 0.7], "values": [1, 1]}, "no part of it is visible"),
        ({"type": "spectrum", "wavelengths": [700, 400], "values": [1, 1]}, "do not ascend"),
        ({"type": "spectrum", "wavelengths": [400, 700], "values": [1]}, "values"),
        ({"type": "blackbod", "temperature": 3000}, "blackbody"),
    ],
)
def test_lamps_that_cannot_be_are_one_clear_error(tmp_path: Path, light: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as refused:
        rendered(tmp_path, ball(1.5, light))
    assert message in str(refused.value) and "energy" in refused.value.where


@pytest.mark.parametrize("eta, message", [("bk8", "did you mean 'bk7'"), ("Au", "absorbs"), (-1.5, "out of range")])
def test_indices_that_cannot_be_are_one_clear_error_in_the_scene(tmp_path: Path, eta: object, message: str) -> None:
    with pytest.raises(InputError) as refused:
        rendered(tmp_path, ball(eta))
    assert message in str(refused.value) and "scene.json#/scene/shapes/0/material/eta" in refused.value.where


# ---------------------------------------------------------------------- the variant


def test_a_spectral_render_leaves_the_variant_as_it_was(tmp_path: Path) -> None:
    rendered(tmp_path, ball(1.5), spp=1, spectral=True)
    assert mi.variant() == "llvm_ad_rgb"


@pytest.mark.slow
def test_a_render_leaves_the_variant_of_a_program_as_it_was() -> None:
    mi.set_variant("llvm_ad_spectral")
    try:
        go.render(go.Lambert(), spp=1, size=(4, 4))
        assert mi.variant() == "llvm_ad_spectral"
    finally:
        mi.set_variant("llvm_ad_rgb")


@pytest.mark.slow
def test_a_material_is_shown_on_a_ball_by_wavelengths_too() -> None:
    glass = go.Dielectric(eta="sf11", alpha=0.05)
    pictures = [np.asarray(go.render(glass, spp=64, size=(24, 24), spectral=s), float) for s in (False, True)]
    np.testing.assert_allclose(pictures[1].mean((0, 1)), pictures[0].mean((0, 1)), rtol=0.05)
