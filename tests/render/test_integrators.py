"""Integrators: against Mitsuba's own, against closed forms, and to the bit against themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.transport.integrators import Integrator, Render, Settings, path, progressive
from gonio.transport.integrators.base import SAMPLERS
from gonio.transport.lights import lights

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f
lights.register(mi)


def rgb(value: Any) -> dict:
    return {"type": "rgb", "value": value}


def rectangle(origin: tuple, edge: float, axis: tuple = (1, 0, 0), angle: float = 0.0, **rest: Any) -> dict:
    to_world = T().translate(origin).rotate(axis, angle).scale(edge / 2)
    return {"type": "rectangle", "to_world": to_world, **rest}


AREA = {"type": "area", "radiance": rgb([8, 6, 4])}
LAMP = rectangle((0, 2.5, 1), 1.5, (1, 0, 0), 90, emitter=AREA)  # faces down
LAMPS: dict[str, dict] = {
    "area": {"lamp": LAMP},
    "gonio_area": {"lamp": {**LAMP, "emitter": {**AREA, "type": "gonio_area"}}},
    "two areas": {"lamp": LAMP, "other": rectangle((-1.5, 1.5, 2), 0.5, (0, 1, 0), 140, emitter=AREA)},
    "sphere": {"lamp": {"type": "sphere", "center": [1, 2, 1], "radius": 0.3, "emitter": AREA}},
    "point": {"lamp": {"type": "point", "position": [1, 2, 2], "intensity": rgb([9, 8, 7])}},
    "constant": {"lamp": {"type": "constant", "radiance": rgb([0.5, 0.6, 0.7])}},
    "point and constant and area": {
        "lamp": LAMP,
        "point": {"type": "point", "position": [1, 2, 2], "intensity": rgb([3, 2, 1])},
        "sky": {"type": "constant", "radiance": rgb([0.2, 0.3, 0.4])},
    },
    "two gonio_areas": {
        "lamp": {**LAMP, "emitter": {**AREA, "type": "gonio_area"}},
        "other": {
            "type": "disk",
            "to_world": T().translate([-1, 1, 2]),
            "emitter": {**AREA, "type": "gonio_area", "tag": "b"},
        },
    },
}


def scene_dict(size: int = 24, lamp: dict | None = None, ball: dict | None = None, **rest: Any) -> dict:
    """A floor, a ball and a rougher ball under a lamp."""
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 40,
            "to_world": T().look_at([0, 1.5, 4], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
        },
        "floor": rectangle(
            (0, -0.5, 0), 6, (1, 0, 0), -90, bsdf={"type": "diffuse", "reflectance": rgb([0.7, 0.5, 0.3])}
        ),
        "ball": {
            "type": "sphere",
            "center": [-0.6, 0, 0],
            "radius": 0.5,
            "bsdf": ball or {"type": "roughconductor", "alpha": 0.3, "distribution": "ggx"},
        },
        "plastic": {"type": "sphere", "center": [0.6, 0, 0], "radius": 0.5, "bsdf": {"type": "plastic"}},
        **(LAMPS["area"] if lamp is None else lamp),
        **rest,
    }


def picture(scene: Any, spp: int, **settings: Any) -> np.ndarray:
    render = Render(scene, Settings(**settings))
    render.advance(spp)
    assert render.invalid == 0
    return render.image()


def agree(scene: Any, theirs_dict: dict, spp: int = 256, runs: int = 4, **settings: Any) -> None:
    """Means of `runs` pictures each, Mitsuba's and ours: every block of pixels and the whole within its error."""
    theirs_integrator = mi.load_dict(theirs_dict)
    theirs = np.array([np.array(mi.render(scene, integrator=theirs_integrator, spp=spp, seed=s)) for s in range(runs)])
    ours = np.array([picture(scene, spp, seed=s, **settings) for s in range(runs)])

    def blocks(images: np.ndarray) -> np.ndarray:
        n, h, w, c = images.shape
        return images.reshape(n, 4, h // 4, 4, w // 4, c).mean(axis=(2, 4)).reshape(n, -1)

    for a, b in ((blocks(theirs), blocks(ours)), (theirs.mean(axis=(1, 2)), ours.mean(axis=(1, 2)))):
        pooled = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / runs)
        # With 3 + 3 degrees of freedom a single sigma comes out too small by chance; their mean over blocks does not.
        sigma = np.maximum(pooled, pooled.mean()) + 1e-4 * a.mean()
        worst = (np.abs(a.mean(axis=0) - b.mean(axis=0)) / sigma).max()
        assert worst < 6, f"{worst:.1f} sigma apart"


@pytest.mark.sample(3)
@pytest.mark.parametrize("lamp", LAMPS)
def test_path_agrees_with_mitsuba_under_every_light(lamp: str) -> None:
    scene = mi.load_dict(scene_dict(lamp=LAMPS[lamp]))
    agree(scene, {"type": "path", "max_depth": 5}, integrator="path", max_depth=5)


@pytest.mark.sample(3)
@pytest.mark.parametrize("lamp", ["area", "gonio_area", "point", "constant", "two areas"])
def test_direct_agrees_with_mitsuba(lamp: str) -> None:
    scene = mi.load_dict(scene_dict(lamp=LAMPS[lamp]))
    agree(scene, {"type": "direct"}, integrator="direct")


@pytest.mark.sample(1)
@pytest.mark.parametrize("light", [{"type": "constant"}, {"type": "directional", "direction": [0.2, -1.0, 0.1]}])
def test_what_mitsuba_merges_stands_in_the_way_of_light(light: dict) -> None:
    """Two sheets of one material are one mesh, which the scene's box leaves out: without it light ends at 2 metres."""
    sheets = {
        "floor": rectangle((0, -0.5, 0), 10, angle=-90, bsdf={"type": "diffuse"}),
        "roof": rectangle((0, 9, 0), 14, angle=90, bsdf={"type": "diffuse"}),
    }
    eye = T().look_at([0, 1, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    described = {
        "type": "scene",
        "light": light,
        **sheets,
        "camera": {"type": "perspective", "to_world": eye, "film": film},
    }
    merged, apart = (mi.load_dict(described, optimize=both) for both in (True, False))
    assert len(merged.shapes()) == 1
    for name, spp in (("path", 64), ("light", 512), ("caustics", 64)):  # one after another, of one scene
        found, right = (picture(one, spp, integrator=name, max_depth=3).mean() for one in (merged, apart))
        assert found == pytest.approx(right, rel=0.02, abs=1e-6)


def test_the_comparison_would_see_a_missing_bounce() -> None:
    scene = mi.load_dict(scene_dict(lamp=LAMPS["constant"]))
    with pytest.raises(AssertionError, match="sigma apart"):
        agree(scene, {"type": "path", "max_depth": 5}, integrator="path", max_depth=4)


def test_long_paths_with_glass_and_roulette_agree_with_mitsuba() -> None:
    scene = mi.load_dict(scene_dict(lamp=LAMPS["constant"], ball={"type": "dielectric"}))
    agree(scene, {"type": "path", "max_depth": 12}, integrator="path", max_depth=12)


def test_rough_glass_agrees_with_mitsuba() -> None:
    scene = mi.load_dict(scene_dict(ball={"type": "roughdielectric", "alpha": 0.3, "distribution": "ggx"}))
    agree(scene, {"type": "path", "max_depth": 6}, integrator="path", max_depth=6)


@pytest.mark.parametrize("name", ["directSampleLight", "directSampleBSDF"])
def test_single_strategies_reach_the_same_mean(name: str) -> None:
    rough = {"type": "diffuse", "reflectance": rgb(0.5)}  # finite variance for either strategy alone
    scene = mi.load_dict(scene_dict(ball=rough, plastic={"type": "sphere", "center": [0.6, 0, 0], "bsdf": rough}))
    mixed, single = picture(scene, 512, integrator="direct"), picture(scene, 512, integrator=name)
    assert single.mean() == pytest.approx(mixed.mean(), rel=5e-3)


def test_direct_strategies_follow_mirrors_to_lights() -> None:
    scene = mi.load_dict(scene_dict(ball={"type": "conductor"}, lamp=LAMPS["constant"]))
    ball = np.s_[9:11, 6:8]  # its upper half, which mirrors the sky
    expected = picture(scene, 64, integrator="direct")[ball]
    assert expected.min() > 0.1
    for name in ("directSampleLight", "directSampleBSDF"):
        assert picture(scene, 64, integrator=name)[ball] == pytest.approx(expected, rel=1e-3)


def furnace(bsdf: dict, **settings: Any) -> np.ndarray:
    """Mean pixel of a ball that fills the view, in a constant sky of radiance 1."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": 5,
                "to_world": T().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
            },
            "ball": {"type": "sphere", "bsdf": bsdf},
            "sky": {"type": "constant"},
        }
    )
    return picture(scene, 256, **settings).mean(axis=(0, 1))


@pytest.mark.parametrize("name", ["path", "direct", "directSampleLight", "directSampleBSDF", "whitted"])
def test_a_white_ball_vanishes_in_a_white_furnace(name: str) -> None:
    assert furnace({"type": "diffuse", "reflectance": rgb(1.0)}, integrator=name) == pytest.approx(1, rel=2e-3)


@pytest.mark.parametrize("bsdf", [{"type": "conductor", "material": "none"}, {"type": "dielectric"}])
def test_mirror_and_glass_vanish_in_a_white_furnace(bsdf: dict) -> None:
    # Mitsuba's glass also scales radiance by 1/eta^2 on the way in and back on the way out: nothing remains.
    assert furnace(bsdf, integrator="path", max_depth=50) == pytest.approx(1, rel=2e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["path", "direct", "whitted", "directSampleBSDF", "normal"])
def test_passes_of_any_size_give_the_same_bits(name: str) -> None:
    scene = mi.load_dict(scene_dict(ball={"type": "dielectric"}, lamp=LAMPS["point and constant and area"]))

    def render(*passes: int) -> np.ndarray:
        r = Render(scene, Settings(name, seed=5, max_depth=6), aovs=True)
        for count in passes:
            r.advance(count)
        assert r.done == sum(passes)
        return np.concatenate([r.image(), *r.aov().values()])

    whole = render(37)
    assert np.array_equal(whole, render(16, 21)) and np.array_equal(whole, render(*[1] * 5, 30, 2))
    assert not np.array_equal(whole, Render(scene, Settings(name, seed=6)).image())


def test_seeds_give_different_noise_and_the_same_mean() -> None:
    scene = mi.load_dict(scene_dict())
    a, b = picture(scene, 64, seed=1), picture(scene, 64, seed=2)
    assert not np.array_equal(a, b)
    assert np.array_equal(a, picture(scene, 64, seed=1))
    assert a.mean() == pytest.approx(b.mean(), rel=0.02)


def test_max_depth_1_shows_lights_only_and_2_is_direct() -> None:
    scene = mi.load_dict(scene_dict(lamp=LAMPS["constant"]))
    lights_only = picture(scene, 16, max_depth=1)
    assert lights_only[20, 12].max() == 0 and lights_only[0, 0] == pytest.approx([0.5, 0.6, 0.7], rel=1e-3)
    assert np.array_equal(picture(scene, 16, max_depth=2), picture(scene, 16, integrator="direct"))


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["path", "direct", "directSampleLight"])
@pytest.mark.parametrize("kind, behind", [("gonio_area", True), ("area", False)])
def test_the_back_of_a_two_sided_lamp_lights_the_floor(name: str, kind: str, behind: bool) -> None:
    up = rectangle((0, 2.5, 1), 1.5, (1, 0, 0), -90, emitter={**AREA, "type": kind})
    image = picture(mi.load_dict(scene_dict(lamp={"lamp": up})), 16, integrator=name)
    assert (image[18:, :].min() > 0) == behind


def test_both_sides_of_a_two_sided_lamp_give_the_same_picture() -> None:
    down, up = (rectangle((0, 2.5, 1), 1.5, (1, 0, 0), a, emitter={**AREA, "type": "gonio_area"}) for a in (90, -90))
    a, b = (picture(mi.load_dict(scene_dict(lamp={"lamp": x})), 256) for x in (down, up))
    assert a.mean() == pytest.approx(b.mean(), rel=0.01)


def test_whitted_sees_lit_things_in_mirrors_and_no_bounced_light() -> None:
    scene = mi.load_dict(scene_dict(ball={"type": "conductor"}))
    whitted, light, path = (
        picture(scene, 64, integrator=name, max_depth=12) for name in ("whitted", "directSampleLight", "path")
    )
    mirror, floor = np.s_[13:16, 6:8], np.s_[20:, :]
    assert whitted[mirror].mean() > 0.05  # the lit floor, seen in the mirror ball
    assert light[mirror].mean() < 1e-6  # one scattering sees only lights there
    assert whitted[floor] == pytest.approx(light[floor], rel=1e-5)
    assert path[floor].mean() > whitted[floor].mean()


def test_whitted_follows_smooth_glass() -> None:
    scene = mi.load_dict(scene_dict(ball={"type": "dielectric"}))
    image = picture(scene, 64, integrator="whitted")
    assert image[11:14, 6:8].mean() > 0.05


def test_normal_and_uv_show_what_mitsuba_finds() -> None:
    scene = mi.load_dict(scene_dict())
    aov = mi.load_dict({"type": "aov", "aovs": "n:sh_normal,uv:uv"})
    theirs = np.array(mi.render(scene, integrator=aov, spp=1024, seed=1))[..., -5:]
    normal, uv = picture(scene, 1024, integrator="normal"), picture(scene, 1024, integrator="uv")
    background = np.all(theirs == 0, axis=-1)
    flat = np.s_[20:, 4:20]  # away from edges: the floor
    assert background.any() and np.all(normal[background] == 0)
    assert normal[flat] == pytest.approx((theirs[flat][..., :3] + 1) / 2, abs=1e-3)
    assert uv[flat][..., :2] == pytest.approx(theirs[flat][..., 3:], abs=2e-3) and np.all(uv[..., 2] == 0)


def test_row_0_is_the_top_and_the_film_may_be_of_any_size() -> None:
    d = scene_dict(lamp=LAMPS["constant"])
    d["sensor"]["film"] |= {"width": 13, "height": 7}
    image = picture(mi.load_dict(d), 16, max_depth=1)
    assert image.shape == (7, 13, 3) and image.dtype == np.float32
    assert image[0].min() > 0.4 and image[-1, 6].max() == 0


def test_aovs_are_the_first_hits_albedo_and_normal() -> None:
    scene = mi.load_dict(scene_dict())
    render = Render(scene, Settings(), aovs=True)
    render.advance(64)
    floor = np.s_[20:, 4:20]
    assert render.aov()["albedo"][floor] == pytest.approx(np.broadcast_to([0.7, 0.5, 0.3], (4, 16, 3)), abs=1e-4)
    assert render.aov()["normal"][floor] == pytest.approx(np.broadcast_to([0, 1, 0], (4, 16, 3)), abs=1e-4)
    assert np.array_equal(render.image(), picture(scene, 64))  # asking for them changes nothing
    with pytest.raises(InputError, match="aovs=True"):
        Render(scene, Settings()).aov()


def test_sobol_has_far_less_noise_than_independent_samples() -> None:
    scene = mi.load_dict(scene_dict())
    best = picture(scene, 4096, integrator="direct")
    error = {}
    for name in ("default", "independent"):
        runs = np.array([picture(scene, 64, integrator="direct", sampler=name, seed=9 + k) for k in range(4)])
        error[name] = np.median(np.mean((runs - best) ** 2, axis=(0, 3)))  # of pixels: no firefly decides
    assert error["default"] < error["independent"] / 8


def launched(work: Any) -> int:
    """How many kernels `work` compiled, in this process's eyes (a kernel found in memory counts none)."""
    dr.kernel_history_clear()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        work()
    return sum(not k["cache_hit"] for k in dr.kernel_history([dr.KernelType.JIT]))


def test_changed_values_recompile_nothing() -> None:
    ball = {"type": "roughconductor", "alpha": 0.3, "eta": rgb([0.2, 0.4, 1.4]), "k": rgb([3.9, 2.4, 1.6])}
    scene = mi.load_dict(scene_dict(ball=ball))
    params = mi.traverse(scene)
    picture(scene, 1)
    picture(scene, 2)
    changes = {
        "ball.bsdf.alpha.value": 0.11,
        "ball.bsdf.eta.value": [0.3, 0.3, 0.3],
        "floor.bsdf.reflectance.value": [0.1, 0.2, 0.9],
        "lamp.emitter.radiance.value": [1, 2, 3],
        "lamp.to_world": T().translate([0, 2, 1]).rotate([1, 0, 0], 80).scale(0.5),
        "sensor.to_world": T().look_at([0.5, 1.5, 4], [0, 0, 0], [0, 1, 0]),
    }
    last = picture(scene, 2)
    for name, value in changes.items():
        params[name] = type(params[name])(value)
        params.update()
        images = []
        compiled = launched(lambda images=images: images.append(picture(scene, 2)))
        assert compiled == 0, f"changing {name} compiled {compiled} kernels"
        assert not np.array_equal(images[0], last), f"changing {name} changed nothing"
        last = images[0]
    assert launched(lambda: picture(scene, 3, seed=77)) == 0
    assert launched(lambda: picture(scene, 17, max_depth=7)) == 0


def test_an_interrupt_while_a_loop_is_recorded_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    scene = mi.load_dict(scene_dict())
    before = picture(scene, 2)
    with monkeypatch.context() as patch:
        patch.setattr(path.Path, "bounce", interrupted)
        with pytest.raises(KeyboardInterrupt):
            picture(scene, 2)
    assert np.array_equal(picture(scene, 2), before)


def placed(offset: int, count: int) -> np.ndarray:
    """0, 1, ..., `offset` bytes behind where a cache line begins."""
    raw = np.empty(4 * count + 128, np.uint8)
    start = -raw.ctypes.data % 64 + offset
    lanes = raw[start : start + 4 * count].view(np.uint32)
    lanes[:] = np.arange(count)
    return lanes


def kernels(work: Callable[[], object]) -> set[str]:
    """What is launched: where a kernel lies in the cache on disk, one more counts as none in `launched`."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        return {k["hash"] for k in dr.kernel_history([dr.KernelType.JIT])}


def test_where_numpy_puts_an_array_recompiles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = mi.load_dict(scene_dict())
    found, images = [], []
    for offset in (0, 0, 4):  # the first loads the scene too
        monkeypatch.setattr(progressive, "tiles", lambda w, h, offset=offset: placed(offset, w * h))
        found.append(kernels(lambda: images.append(picture(scene, 2))))
    assert found[2] == found[1]
    assert np.array_equal(images[2], images[1])


def test_the_recompilation_test_would_see_a_new_kernel() -> None:
    scene = mi.load_dict(scene_dict())
    picture(scene, 1)
    scale = np.random.default_rng().uniform()  # a literal nobody has compiled before

    def work() -> None:
        dr.eval(dr.arange(mi.Float, 3) * scale + dr.sin(dr.arange(mi.Float, 3) * scale))

    assert launched(work) == 1


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["directSampleLight", "path"])
def test_ambient_light_adds_its_radiance_times_the_materials_coefficient(name: str) -> None:
    import gonio.mitsuba  # noqa: F401  (registers gonio_phong)

    phong = {"type": "gonio_phong", "ka": rgb([0.1, 0.2, 0.3])}
    scene = mi.load_dict(scene_dict(ball=phong))
    dark, light = (picture(scene, 64, integrator=name, ambient=a, max_depth=2) for a in (None, (2.0, 1.0, 1.0)))
    assert (light - dark)[11:14, 6:8] == pytest.approx(np.broadcast_to([0.2, 0.2, 0.3], (3, 2, 3)), rel=1e-4)
    assert np.array_equal(light[20:], dark[20:])  # the floor's material takes none


def test_ambient_light_changes_nothing_where_no_material_takes_it() -> None:
    scene = mi.load_dict(scene_dict())
    assert np.array_equal(picture(scene, 4), picture(scene, 4, ambient=(1.0, 1.0, 1.0)))


@pytest.mark.sample(1)
@pytest.mark.parametrize("lamp", ["area", "two areas"])
def test_a_spectral_scene_has_the_colours_of_mitsubas(lamp: str) -> None:
    try:
        mi.set_variant("llvm_ad_spectral")
        scene = mi.load_dict(scene_dict(size=8, lamp=LAMPS[lamp]))
        theirs = np.array(mi.render(scene, integrator=mi.load_dict({"type": "path", "max_depth": 3}), spp=4096))
        ours = picture(scene, 4096, max_depth=3)
    finally:
        mi.set_variant("llvm_ad_rgb")
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.01)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"integrator": "pathh"}, "unknown integrator 'pathh'"),
        ({"sampler": "halton"}, "unknown sampler 'halton'"),
        ({"max_depth": 0}, "max_depth 0"),
        ({"seed": -1}, "seed -1"),
    ],
)
def test_wrong_settings_are_one_clear_error(settings: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Settings(**settings)


def test_zero_samples_and_a_scene_without_a_camera_are_errors() -> None:
    with pytest.raises(InputError, match="0 samples"):
        Render(mi.load_dict(scene_dict()), Settings()).advance(0)
    with pytest.raises(InputError, match="no camera"):
        Render(mi.load_dict({"type": "scene", "s": {"type": "sphere"}}), Settings())


def test_every_name_renders() -> None:
    scene = mi.load_dict(scene_dict(size=4))
    for integrator in Integrator.family.all():
        assert np.isfinite(picture(scene, 1, integrator=integrator)).all()
    for sampler in SAMPLERS:
        assert np.isfinite(picture(scene, 1, sampler=sampler)).all()
