"""Particle tracing and the map of caustics: against the path tracer, and to the bit against themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.transport import delta_retrace
from gonio.transport.integrators import Render, Settings
from gonio.transport.lights import lights
from gonio.transport.photons import Photon, PhotonMap, Search

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f
EXAMPLES = Path(__file__).parents[2] / "examples"
lights.register(mi)


def rgb(value: Any) -> dict:
    return {"type": "rgb", "value": value}


def rectangle(origin: tuple, half: float, angle: float = 0.0, **rest: Any) -> dict:
    return {"type": "rectangle", "to_world": T().translate(origin).rotate([1, 0, 0], angle).scale(half), **rest}


AREA = {"type": "area", "radiance": rgb([8, 6, 4])}
LAMP = rectangle((0, 2.5, 1), 0.75, 90, emitter=AREA)
PATTERN = mi.Bitmap(np.linspace(0.1, 2.0, 8 * 4 * 3).reshape(4, 8, 3).astype(np.float32))
LAMPS: dict[str, dict] = {
    "two-sided": {"lamp": rectangle((0.6, 0.8, 0.4), 0.3, 30, emitter={**AREA, "type": "gonio_area"})},
    "ball, point and sky": {
        "lamp": {"type": "sphere", "center": [1, 2, 1], "radius": 0.3, "emitter": AREA},
        "point": {"type": "point", "position": [1, 2, 2], "intensity": rgb([3, 2, 1])},
        "sky": {"type": "envmap", "bitmap": PATTERN},
    },
    "beam": {"lamp": {"type": "directional", "direction": [0.3, -1, -0.5], "irradiance": rgb([3, 2, 1])}},
}
GREY = {"type": "diffuse", "reflectance": rgb([0.7, 0.5, 0.3])}
BUMPS = np.full((2, 2, 3), 0.5, np.float32) + np.array([[[0.2, 0, 0.45], [0, 0.2, 0.45]]] * 2, np.float32)
BUMPY = {
    "type": "normalmap",
    "normalmap": {"type": "bitmap", "bitmap": mi.Bitmap(BUMPS), "raw": True},
    "bsdf": {"type": "diffuse", "reflectance": rgb(0.7)},
}
GLASS = {"type": "dielectric", "int_ior": 1.5}


def scene(lamp: dict, ball: dict, size: int = 24, **rest: Any) -> Any:
    """A floor and a ball under a lamp."""
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 1.5, 4], [0, 0, 0], [0, 1, 0])
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "fov": 40, "to_world": eye, "film": film},
            "floor": rectangle((0, -0.5, 0), 3, -90, bsdf=GREY),
            "ball": {"type": "sphere", "center": [0, 0, 0], "radius": 0.5, "bsdf": ball},
            **lamp,
            **rest,
        }
    )


def pictures(scene: Any, integrator: str, spp: int, runs: int = 4, depth: int = 5) -> np.ndarray:
    found = []
    for seed in range(runs):
        render = Render(scene, Settings(integrator, depth, seed=seed))
        render.advance(spp)
        assert render.invalid == 0
        found.append(render.image())
    return np.array(found)


def sigmas(a: np.ndarray, b: np.ndarray, side: int = 4) -> float:
    """How far apart the worst block of two stacks of pictures is; the error of a block is pooled with all blocks'."""

    def blocks(images: np.ndarray) -> np.ndarray:
        n, h, w, _ = images.shape
        grey = images.mean(-1)
        return grey.reshape(n, h // side, side, w // side, side).mean((2, 4)).reshape(n, -1)

    a, b = blocks(a), blocks(b)
    error = np.sqrt(a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b))
    error = np.maximum(error, error.mean()) + 1e-4 * a.mean()
    return float((abs(a.mean(0) - b.mean(0)) / error).max())


@pytest.mark.parametrize(
    "lamp", [n if k == 0 else pytest.param(n, marks=pytest.mark.slow) for k, n in enumerate(LAMPS)]
)
def test_particles_make_the_picture_of_paths(lamp: str) -> None:
    drawn = scene(LAMPS[lamp], GREY)
    assert sigmas(pictures(drawn, "path", 64), pictures(drawn, "light", 256)) < 6


def test_particles_leave_a_sphere_that_is_turned_from_its_surface() -> None:
    turned = T().translate([1, 2, 1]).rotate([0.6, 0, 0.8], 100).scale(0.3)
    drawn = scene({"lamp": {"type": "sphere", "to_world": turned, "emitter": AREA}}, GREY, size=8)
    render = Render(drawn, Settings("light"))
    particles = render._integrator.particles
    left, _ = particles.leave(particles.key(mi.UInt32(0)), dr.arange(mi.UInt32, 1024))
    outward = (np.array(left.origin).T - [1, 2, 1]) / 0.3
    assert np.sum(np.array(left.direction).T * outward, axis=1).min() > -1e-5
    # each carries the power pi L A that all have together
    assert np.array(left.flux)[0] == pytest.approx(np.full(1024, 8 * np.pi * 4 * np.pi * 0.09), rel=1e-3)


@pytest.mark.slow
def test_particles_see_bent_normals_and_rough_glass_as_paths_do() -> None:
    rough = {"type": "roughdielectric", "alpha": 0.5, "distribution": "ggx"}
    other = {"type": "sphere", "center": [0.9, 0, 0.3], "radius": 0.4, "bsdf": BUMPY}
    drawn = scene({"lamp": LAMP}, rough, other=other)
    assert sigmas(pictures(drawn, "path", 64, depth=7), pictures(drawn, "light", 256, depth=7)) < 6


@pytest.mark.slow
def test_particles_enter_rough_glass_beside_bent_normals_as_paths_do() -> None:
    """Once and not out again: a factor of the index that is wrong both ways shows on no closed ball."""
    rough = {"type": "roughdielectric", "alpha": 0.5, "distribution": "ggx"}
    drawn = scene({"lamp": LAMP}, BUMPY, size=20, pane=rectangle((0, 0.3, 1.2), 0.7, bsdf=rough))
    agree(pictures(drawn, "path", 256, 6), pictures(drawn, "light", 1024, 6))


@pytest.mark.slow
def test_particles_behind_a_thin_lens_are_not_seen() -> None:
    film = {"type": "hdrfilm", "width": 20, "height": 20, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 1.5, 4], [0, 0, 0], [0, 1, 0])
    lens = {"type": "thinlens", "fov": 40, "to_world": eye, "aperture_radius": 0.1, "focus_distance": 4, "film": film}
    wall = {"type": "rectangle", "to_world": T().translate([0, 1, 6]).rotate([0, 1, 0], 180).scale(4), "bsdf": GREY}
    drawn = scene({"lamp": LAMP, "sky": {"type": "constant", "radiance": rgb(0.3)}}, GREY, sensor=lens, wall=wall)
    agree(pictures(drawn, "path", 64, 6), pictures(drawn, "light", 512, 6))


@pytest.mark.sample(1)
@pytest.mark.parametrize("clip", [{"near_clip": 3.6}, {"far_clip": 4.0}])
def test_particles_are_seen_between_the_clips_of_the_camera(clip: dict[str, float]) -> None:
    film = {"type": "hdrfilm", "width": 20, "height": 20, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 1.5, 4], [0, 0, 0], [0, 1, 0])
    camera = {"type": "perspective", "fov": 40, "to_world": eye, "film": film, **clip}
    lights = {"lamp": LAMP, "sky": {"type": "constant", "radiance": rgb(0.3)}}
    sheet = rectangle((0.3, 0.9, 2), 0.3, bsdf={"type": "twosided", "side": GREY})  # nearer than the nearer clip
    drawn = scene(lights, GREY, sensor=camera, sheet=sheet)
    agree(pictures(drawn, "path", 64, 6), pictures(drawn, "light", 512, 6))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["light", "caustics"])
def test_particles_pass_instances(name: str) -> None:
    block = {"type": "cube", "to_world": T().translate([-0.5, -0.2, 0.8]).scale(0.3), "bsdf": GREY}
    group = {"group": {"type": "shapegroup", "block": block}}
    copies = {
        f"copy{x}": {"type": "instance", "to_world": T().translate([x, 0, 0]), "g": {"type": "ref", "id": "group"}}
        for x in (0, 1)
    }
    lamps = {"lamp": LAMP, "sky": {"type": "constant", "radiance": rgb(0.3)}}
    drawn = scene(
        lamps, GREY if name == "light" else {"type": "conductor", "material": "Ag"}, size=20, **group, **copies
    )
    agree(pictures(drawn, "path", 256, 6), pictures(drawn, name, 512 if name == "light" else 128, 6))


def test_particles_of_short_paths_show_the_lamp_alone() -> None:
    drawn = scene(LAMPS["two-sided"], GREY)
    a, b = pictures(drawn, "path", 16, depth=1), pictures(drawn, "light", 64, depth=1)
    assert a.max() > 1 and sigmas(a, b) < 6


WIDE = rectangle((0.5, 2.0, 0.5), 0.6, 90, emitter=AREA)
MIRROR = rectangle((0, 0.3, -1.2), 1.0, bsdf={"type": "conductor", "material": "Ag"})


@pytest.mark.slow
@pytest.mark.parametrize("lamp", ["wide", "ball, point and sky"])
def test_the_map_of_caustics_takes_nothing_and_adds_nothing(lamp: str) -> None:
    found = {"lamp": WIDE} if lamp == "wide" else {n: LAMPS[lamp][n] for n in ("lamp", "sky")}
    drawn = scene(found, GLASS, mirror=MIRROR)
    a, b = pictures(drawn, "path", 256, depth=8), pictures(drawn, "caustics", 32, depth=8)
    assert sigmas(a, b) < 6
    assert b.mean() == pytest.approx(a.mean(), rel=0.01)


def test_caustics_of_a_point_which_no_path_finds_are_those_of_particles() -> None:
    lamp = {"type": "point", "position": [2.5, 1.6, 0.5], "intensity": rgb(20)}
    drawn = scene({"lamp": lamp}, GLASS, size=32)
    path, light, caustics = (
        pictures(drawn, name, n, depth=8, runs=4).mean((0, 3))
        for name, n in (("path", 16), ("light", 256), ("caustics", 32))
    )
    floor = (abs(pictures(drawn, "normal", 16, 1)[0] - [0.5, 1.0, 0.5]) < 1e-4).all(-1)
    shadow = floor & (path < 0.1)  # of the ball, as a path sees it
    assert light[shadow].mean() > 2 * path[shadow].mean(), "no caustic stands in the shadow"
    assert caustics[shadow].mean() == pytest.approx(light[shadow].mean(), rel=0.02)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:a small lamp")
def test_caustics_by_wavelength_are_those_of_particles() -> None:
    """A ball of SF11, whose index depends on the wavelength, under a small lamp."""
    size, where = (48, 30), EXAMPLES / "glass-caustic"

    def picture(integrator: str, spp: int) -> np.ndarray:
        found = [go.render(where, size=size, spp=spp, integrator=integrator, spectral=True, seed=s) for s in (1, 2)]
        return np.mean(found, axis=0)

    floor = (abs(go.render(where, size=size, spp=16, integrator="normal") - [0.5, 1.0, 0.5]) < 1e-4).all(-1)
    light, caustics, path = picture("light", 512), picture("caustics", 64), picture("path", 16)
    seen = go.render(where, size=size, spp=64, integrator="caustics").mean(-1)
    focus = floor & (seen > 2 * np.median(seen[floor]))
    assert focus.sum() > 5, "no focus"
    for where_ in (floor, focus):
        assert caustics[where_].mean(0) == pytest.approx(light[where_].mean(0), rel=0.05)
    assert path[focus].mean() != pytest.approx(light[focus].mean(), rel=0.05), "paths would do"


@pytest.mark.slow
def test_caustics_by_wavelength_cut_into_passes_change_no_bit() -> None:
    with engine.using("llvm_ad_spectral"):
        drawn = scene({"lamp": LAMP}, GLASS, size=16)
        whole, cut = (Render(drawn, Settings("caustics", 6, seed=5)) for _ in range(2))
        whole.advance(11)
        for count in (3, 1, 7):
            cut.advance(count)
        assert whole.image().mean() > 0.01
        assert np.array_equal(whole.image(), cut.image())


@pytest.mark.parametrize("name", [pytest.param("light", marks=pytest.mark.slow), "caustics"])
def test_passes_states_and_threads_change_no_bit(name: str) -> None:
    drawn = scene(LAMPS["ball, point and sky"], GLASS, mirror=MIRROR, size=16)
    settings = Settings(name, 6, seed=5)

    def render(*passes: int) -> np.ndarray:
        found = Render(drawn, settings)
        for count in passes:
            found.advance(count)
        return found.image()

    whole = render(11)
    assert np.array_equal(whole, render(3, 1, 7))
    begun = Render(drawn, settings)
    begun.advance(5)
    state = {key: np.array(value) for key, value in begun.state().items()}
    begun.advance(1)
    other = Render(drawn, settings)
    other.restore(5, state)
    other.advance(6)
    assert np.array_equal(whole, other.image())
    before = dr.thread_count()
    dr.set_thread_count(2 if before != 2 else 3)
    try:
        assert np.array_equal(whole, render(11))
    finally:
        dr.set_thread_count(before)
    assert not np.array_equal(whole, pictures(drawn, name, 11, 1, 6)[0])


@pytest.mark.slow
def test_parts_of_a_picture_of_caustics_are_those_of_the_whole() -> None:
    drawn = scene({"lamp": LAMP}, GLASS, size=16)
    whole, part = Render(drawn, Settings("caustics", 6)), Render(drawn, Settings("caustics", 6))
    part.select(slice(64, 128))
    whole.advance(6)
    part.advance(6)
    assert np.array_equal(whole.state()["radiance0"][64:128], part.state()["radiance0"])


def test_a_scene_without_light_or_without_mirrors_needs_no_map() -> None:
    dark = scene({}, GLASS, size=8)
    for name in ("light", "caustics", "path"):
        assert not pictures(dark, name, 4, 1).any()
    plain = scene({"lamp": LAMP}, GREY, size=8)
    assert sigmas(pictures(plain, "caustics", 16), pictures(plain, "path", 16)) < 6


def odd_sky(pixels: np.ndarray) -> dict:
    return {"lamp": {"type": "envmap", "bitmap": mi.Bitmap(pixels.astype(np.float32))}}


@pytest.mark.parametrize(
    "name",
    ["path", "light", pytest.param("caustics", marks=pytest.mark.slow), pytest.param("direct", marks=pytest.mark.slow)],
)
def test_odd_lamps_give_a_picture_without_a_hole(name: str) -> None:
    sun = np.full((8, 16, 3), 0.1)
    sun[2, 3] = 1e6
    for lamp in (
        odd_sky(np.zeros((4, 8, 3))),
        odd_sky(np.full((2, 2, 3), 0.5)),
        odd_sky(sun),
        {"lamp": rectangle((0, 2, 0), 0.5, 90, emitter={"type": "area", "radiance": rgb(0.0)})},
        {"lamp": rectangle((0, 2, 0), 1e-4, 90, emitter={"type": "area", "radiance": rgb(1e6)})},
    ):
        assert np.isfinite(pictures(scene(lamp, GLASS, size=8), name, 4, 1)).all()


@pytest.mark.slow
def test_a_camera_inside_of_glass_looks_out() -> None:
    around = {"type": "sphere", "center": [0, 1.5, 4], "radius": 0.3, "bsdf": GLASS}
    drawn = scene({"lamp": WIDE}, GREY, around=around)
    path, caustics = pictures(drawn, "path", 256, depth=6), pictures(drawn, "caustics", 32, depth=6)
    assert path.mean() > 0.01 and sigmas(path, caustics) < 6


def test_what_particles_cannot_do_is_one_clear_error() -> None:
    drawn = scene({"lamp": LAMP}, GREY, size=8)
    with pytest.raises(InputError, match="no features for the denoiser"):
        Render(drawn, Settings("light"), aovs=True)
    shifted = {"type": "perspective", "principal_point_offset_x": 0.2}
    with pytest.raises(InputError, match="principal point"):
        Render(scene({"lamp": LAMP}, GREY, sensor=shifted), Settings("light"))


def test_path_says_where_it_starves_and_what_does_not() -> None:
    small = {"lamp": rectangle((1, 3, 1), 0.05, 90, emitter=AREA)}
    assert "--integrator caustics" in Render(scene(small, GLASS, size=8), Settings("path")).advice
    for lamp, ball, settings in (
        (small, GREY, Settings("path")),
        ({"lamp": WIDE}, GLASS, Settings("path")),
        (small, GLASS, Settings("caustics")),
        (small, GLASS, Settings("direct")),
    ):
        assert Render(scene(lamp, ball, size=8), settings).advice == ""


# ---------------------------------------------------------------------- second trips

COATED = {"type": "plastic", "diffuse_reflectance": rgb(0.6)}
SILVER = {"type": "conductor", "material": "Ag"}


def before_a_wall(glass: dict, radius: float, size: int = 20, wall: dict | None = SILVER, **rest: Any) -> Any:
    """A ball before a wall, a ball lamp beside it."""
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    eye = T().look_at([0, 0.3, 4], [0, 0, 0], [0, 1, 0])
    lamp = {"type": "sphere", "center": [1.2, 1, 1.2], "radius": radius, "emitter": AREA}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective", "fov": 30, "to_world": eye, "film": film},
            "ball": {"type": "sphere", "radius": 0.7, "bsdf": glass},
            "lamp": lamp,
            **({"wall": {"type": "rectangle", "to_world": T().translate([0.2, 0, -1]), "bsdf": wall}} if wall else {}),
            **rest,
        }
    )


def agree(a: np.ndarray, b: np.ndarray) -> None:
    """Two stacks of pictures have the same mean, known to 3 %, and so have their blocks."""
    assert sigmas(a, b, 5) < 5
    found = [x.mean((1, 2)) for x in (a, b)]
    error = np.sqrt(sum(x.var(0, ddof=1) / len(x) for x in found))
    assert np.all(error < 0.03 * found[1].mean(0))
    assert np.all(abs(found[0].mean(0) - found[1].mean(0)) < 5 * error)


BUMPED = {"type": "bumpmap", "arbitrary": {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(np.eye(4, dtype="f"))}}


COPPER = {"type": "conductor", "material": "Cu"}
MATERIALS = {
    "glass": GLASS,
    "two glasses": {"type": "blendbsdf", "weight": 0.3, "a": GLASS, "b": {"type": "dielectric", "int_ior": 1.8}},
    "copper with holes": {"type": "mask", "opacity": 0.4, "bsdf": COPPER},
    "glass with holes": {"type": "mask", "opacity": 0.6, "bsdf": GLASS},
    "a pane": {"type": "thindielectric", "int_ior": 1.8},
    "bent glass": {**BUMPED, "bsdf": GLASS},
    "coated": COATED,
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [n if k < 3 else pytest.param(n, marks=pytest.mark.slow) for k, n in enumerate(MATERIALS)]
)
def test_the_retrace_takes_nothing_and_adds_nothing(name: str) -> None:
    drawn = before_a_wall(MATERIALS[name], 0.5)
    agree(pictures(drawn, "caustics", 64, 6, 8), pictures(drawn, "path", 512, 6, 8))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ball", "pane"])
def test_light_from_a_mirror_is_seen_through_a_rough_surface(name: str) -> None:
    """Particles come to the side of it that is turned away from the camera."""
    frosted = {"type": "roughdielectric", "alpha": 0.5}
    pane = {"type": "rectangle", "to_world": T().rotate([0, 1, 0], 20).scale(2), "bsdf": frosted}
    drawn = before_a_wall(frosted, 0.5) if name == "ball" else before_a_wall(frosted, 0.5, ball=pane)
    agree(pictures(drawn, "caustics", 64, 6, 8), pictures(drawn, "path", 512, 6, 8))


@pytest.mark.slow
def test_the_retrace_finds_light_that_first_traces_hardly_find(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = before_a_wall(GLASS, 0.3, wall=None)
    with_them = pictures(drawn, "caustics", 64, 12, 8)
    monkeypatch.setattr(delta_retrace, "is_possible", lambda *_: False)
    without = pictures(drawn, "caustics", 64, 12, 8)
    assert with_them.var(0, ddof=1).mean() < 0.5 * without.var(0, ddof=1).mean()


@pytest.mark.slow
def test_the_retrace_ends_where_light_is_scattered(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = before_a_wall(GLASS, 0.5, wall=COATED)
    with_them = pictures(drawn, "caustics", 256, 6, 8)
    monkeypatch.setattr(delta_retrace, "is_possible", lambda *_: False)
    agree(with_them, pictures(drawn, "caustics", 256, 6, 8))


def test_features_are_those_of_first_traces() -> None:
    drawn = before_a_wall(GLASS, 0.5)
    path, caustics = (Render(drawn, Settings(name, 8), aovs=True) for name in ("path", "caustics"))
    for render in (path, caustics):
        render.advance(16)
    for name, feature in path.aov().items():
        assert np.array_equal(feature, caustics.aov()[name])


@pytest.mark.slow
def test_a_lamp_that_mirrors_alone_show_is_seen_once() -> None:
    other = {"type": "sphere", "center": [-1, -0.7, 0.5], "radius": 0.2, "bsdf": GLASS}
    drawn = before_a_wall(SILVER, 0.5, other=other)
    agree(pictures(drawn, "caustics", 64, 6, 8), pictures(drawn, "path", 256, 6, 8))


@pytest.mark.slow
def test_long_chains_keep_their_weights_finite() -> None:
    drawn = before_a_wall({"type": "dielectric", "int_ior": 1.01}, 0.5, size=8)
    found = pictures(drawn, "caustics", 2048, 1, depth=100)  # asserts that no value is left out
    assert found.mean() > 0.01


# ---------------------------------------------------------------------- the map


@pytest.mark.slow
def test_a_map_gives_the_particles_within_its_radius() -> None:
    """Against a sum over all of them; so many that their keys take more than 16 bits. What has come from below counts
    on surfaces that face the same way as that of the place, what has come from above on all."""
    rng = np.random.default_rng(7)
    count, radius = 60000, 0.0025  # few enough of a row that none is left out
    at = rng.random((3, count)).astype(np.float32) * [[2], [2], [0]]
    kept = rng.random(count) < 0.8
    flux = rng.random(count).astype(np.float32)
    photon = Photon.none(mi)
    photon.position, photon.flux = mi.Point3f(*map(mi.Float, at)), mi.Spectrum(mi.Float(flux))
    sides = rng.choice([-1.0, 1.0], (2, count)).astype(np.float32)
    photon.normal, photon.direction = (mi.Vector3f(0, 0, mi.Float(side)) for side in sides)
    counted = kept & ((sides[0] > 0) | (sides[1] > 0))
    photon.density, photon.depth = dr.zeros(mi.Float, count), dr.zeros(mi.UInt32, count)
    photon.again = dr.zeros(mi.Bool, count)
    halves = np.split(np.arange(count), 2)  # two kinds, as first and second particles are

    def part(numbers: np.ndarray) -> Photon:
        return dr.gather(Photon, photon, mi.UInt32(numbers.astype(np.uint32)))

    found = PhotonMap(mi, [part(half) for half in halves], [mi.Bool(kept[half]) for half in halves], radius)
    assert found.count == kept.sum() > 2**15
    assert np.array_equal(
        np.sort(np.array(found.values).reshape(-1, 16)[:, 0]), np.sort(at[0, kept].astype(np.float32))
    )
    places = 2 * rng.random((2, 300)).astype(np.float32)
    place = mi.Point3f(mi.Float(places[0]), mi.Float(places[1]), 0)
    zero = dr.zeros(mi.Spectrum, 300)
    up, every = dr.zeros(mi.Vector3f, 300) + mi.Vector3f(0, 0, 1), dr.full(mi.Bool, True, 300)
    search = Search(place, up, up, dr.zeros(mi.Float, 300))
    summed, above = found.gather(search, zero, lambda p, w, here: p.flux * w, every, 0.5)
    distance2 = ((places[:, :, None] - at[:2, None, counted]) ** 2).sum(0)

    def by(reach: float) -> np.ndarray:
        return np.maximum(1 - distance2 / reach**2, 0) * 2 / (np.pi * reach**2) @ flux[counted]

    assert np.array(summed)[0] == pytest.approx(by(radius), rel=1e-3, abs=1)
    assert np.array(above)[0] == pytest.approx(by(radius) - by(0.5 * radius), rel=1e-3, abs=50)
