"""Lamps that are balls, or closed: against closed forms, from outside, from inside, and on the lamp itself."""

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport.fast import inline
from gonio.transport.integrators import Render, Settings
from gonio.transport.lights import lights, solid_angles

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

lights.register(mi)
T = mi.ScalarTransform4f
GREY = 0.5
KINDS = ["gonio_area", "area"]
FLOOR = {
    "type": "rectangle",
    "to_world": T().rotate([1, 0, 0], -90).scale(5),
    "bsdf": {"type": "diffuse", "reflectance": GREY},
}


def ball(kind: str, centre: tuple[float, float, float], radius: float, **other: object) -> dict:
    place = T().translate(centre).rotate([0.48, 0.6, 0.64], 70).scale(radius)
    return {"type": "sphere", "to_world": place, "emitter": {"type": kind, "radiance": 1.0}, **other}


def grey(albedo: float) -> dict:
    return {"type": "twosided", "b": {"type": "diffuse", "reflectance": albedo}}


def picture(
    origin: list[float], target: list[float], fov: float, integrator: str, depth: int, spp: int = 256, **scene: dict
) -> np.ndarray:
    camera = {
        "type": "perspective",
        "fov": fov,
        "to_world": T().look_at(origin, target, [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
    }
    loaded = mi.load_dict({"type": "scene", "camera": camera, **scene}, optimize=False)  # lamps alike stay several
    render = Render(loaded, Settings(integrator, depth))
    render.advance(spp)
    assert render.invalid == 0
    return render.image()[..., 1]


# Mitsuba's `ray_test` tells a ball of 1 mm, three metres away, from what is beside it by float32: to a sixth.
WAYS = [pytest.param(inline.MAX_COST, r, id=f"kernel-{r}") for r in (0.001, 0.05, 1.0, 2.5)]
WAYS += [pytest.param(0, r, id=f"embree-{r}") for r in (0.01, 1.0)]


@pytest.mark.sample(2)
@pytest.mark.parametrize("most, radius", WAYS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_ball_lights_the_floor_by_the_closed_form(
    radius: float, kind: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pi L (r / d)^2 straight below. Mitsuba's own samples of the smallest are 7 % too bright, and a lamp hides its
    limb from shadow rays that end on it: of one of 5 cm, .1 %."""
    monkeypatch.setattr(inline, "MAX_COST", most)
    for integrator in ("directSampleLight", "path"):
        image = picture([4.5, 1, 0], [0, 0, 0], 0.02, integrator, 3, floor=FLOOR, lamp=ball(kind, (0, 3, 0), radius))
        assert image.mean() == pytest.approx(GREY * (radius / 3) ** 2, rel=3e-4)


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", KINDS)
def test_one_of_several_balls_does_too(kind: str) -> None:
    """Chosen among others, one of them a sky: what all send adds up."""
    lamps = {f"l{i}": ball(kind, (0, 3, z), r) for i, (r, z) in enumerate([(0.001, 0), (0.2, 2), (0.5, -2)])}
    for lamp in lamps.values():
        lamp["bsdf"] = grey(0.0)
    sky = {"type": "constant", "radiance": 1e-4}
    expected = sum(r**2 / (9 + z**2) * 3 / np.sqrt(9 + z**2) for r, z in [(0.001, 0), (0.2, 2), (0.5, -2)]) + 1e-4 * (
        1 - sum(r**2 / (9 + z**2) * 3 / np.sqrt(9 + z**2) for r, z in [(0.2, 2), (0.5, -2)])
    )
    image = picture([4.5, 1, 0], [0, 0, 0], 0.02, "path", 2, spp=4096, floor=FLOOR, sky=sky, **lamps)
    assert image.mean() == pytest.approx(GREY * expected, rel=2e-3)


@pytest.mark.sample(2)
@pytest.mark.parametrize("most", [inline.MAX_COST, 0], ids=["kernel", "embree"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_ball_does_not_light_itself(kind: str, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However white it is. Toward a place on itself a sphere's cap is that place, in a direction made of rounding."""
    monkeypatch.setattr(inline, "MAX_COST", most)
    for radius, centre in ((0.4, (2, 4, 3)), (0.01, (0, 0, 5))):
        x, y, z = centre
        lamp = ball(kind, centre, radius, bsdf=grey(0.9))
        image = picture([x + 5 * radius, y, z + radius], list(centre), 8, "path", 5, spp=16, lamp=lamp)
        assert image == pytest.approx(1.0, abs=1e-4)


@pytest.mark.sample(1)
@pytest.mark.parametrize("flipped", [False, True])
def test_within_a_ball_light_is_a_geometric_series(flipped: bool) -> None:
    """1 + r + r^2 ... of albedo r, a term for each segment, wherever one looks."""
    lamp = ball("gonio_area", (0.3, 0.2, 0.1), 2.0, bsdf=grey(0.5), flip_normals=flipped)
    for integrator, depth in (("directSampleLight", 2), ("directSampleBSDF", 2), ("path", 2), ("path", 5)):
        image = picture([0.5, 0.1, 0], [-1, 0.3, 0.2], 60, integrator, depth, spp=64, lamp=lamp)
        assert image == pytest.approx(2 - 0.5 ** (depth - 1), rel=2e-3)


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize("shape", ["cube", "sphere"])
def test_a_closed_lamp_sends_the_same_whether_its_inner_side_shines(shape: str) -> None:
    """Shadow rays that end short of a place on the far side, in front of the near one, add 1 % of light."""
    place = T().translate([0, 3, 0]).scale(0.1)
    found = []
    for kind in KINDS:
        lamp = {"type": shape, "to_world": place, "emitter": {"type": kind, "radiance": 1.0}, "bsdf": grey(0.0)}
        found.append(picture([4.5, 1, 0], [0.3, 0, 0.2], 5, "path", 2, spp=4096, floor=FLOOR, lamp=lamp).mean())
    assert found[0] == pytest.approx(found[1], rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_what_leaves_a_ball_inward_does_not_leave_it_outward(kind: str) -> None:
    """A particle begins a step off its surface, which leads out of one that is smaller, at the other side."""
    for radius in (0.05, 1e-4, 1e-5):
        lamp = ball(kind, (0, 3, 0), radius, bsdf=grey(0.0))
        found = [picture([3, 2, 0], [0, 0, 0], 60, name, 2, 4096, floor=FLOOR, lamp=lamp) for name in ("light", "path")]
        assert found[0].mean() == pytest.approx(found[1].mean(), rel=0.02)


@pytest.mark.sample(1)
@pytest.mark.parametrize("others", [0, 1])
@pytest.mark.parametrize("integrator", ["path", "directSampleLight", "directSampleBSDF"])
def test_what_is_close_to_a_lamp_hides_it(integrator: str, others: int) -> None:
    """A black sheet one two-thousandth of the way before a lamp leaves the floor dark."""
    down = T().translate([0, 3, 0]).rotate([1, 0, 0], 90).scale(0.5)
    lamp = {"type": "rectangle", "to_world": down, "emitter": {"type": "area", "radiance": 1.0}}
    sheet = {"type": "rectangle", "to_world": T().translate([0, 2.9985, 0]).rotate([1, 0, 0], 90), "bsdf": grey(0.0)}
    more = {f"m{i}": ball("area", (0, -3 - i, 0), 0.1, bsdf=grey(0.0)) for i in range(others)}
    scene = {"floor": FLOOR, "lamp": lamp, **more}
    assert picture([4.5, 1, 0], [0, 0, 0], 5, integrator, 3, **scene).mean() > 1e-3
    assert not np.any(picture([4.5, 1, 0], [0, 0, 0], 5, integrator, 3, sheet=sheet, **scene))


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", KINDS)
def test_a_ball_with_a_texture_is_found_as_rays_find_it(kind: str) -> None:
    """Bright in a few stripes of its u, on a turned sphere: sampled lights and sampled lobes agree on a small floor."""
    stripes = np.zeros((4, 8, 3), np.float32)
    stripes[:, [0, 1, 4, 7]] = 1.0
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(stripes), "raw": True, "filter_type": "nearest"}
    lamp = ball(kind, (0, 3, 0), 2.0, bsdf=grey(0.0))
    lamp["emitter"] = {"type": kind, "radiance": texture}
    found = [
        picture([4.5, 0.5, 0], [0, 0, 0], 2, integrator, 2, spp=4096, floor=FLOOR, lamp=lamp).mean()
        for integrator in ("directSampleLight", "directSampleBSDF")
    ]
    assert 0.02 * GREY < found[1] < 0.4 * GREY
    assert found[0] == pytest.approx(found[1], rel=4e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("others", [0, 1])
@pytest.mark.parametrize(
    "shape, flipped",
    [("cube", False), ("rectangle", True), ("sphere", True), ("sphere", False), ("cylinder", False), ("disk", False)],
)
def test_a_lamp_with_a_texture_is_found_as_rays_find_it(shape: str, flipped: bool, others: int) -> None:
    """Whose sides share their uv, or which is round or turned inside out: Mitsuba's `area` samples those wrongly."""
    pixels = np.random.default_rng(3).uniform(0, 8, (4, 4, 3)).astype(np.float32)
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": True, "filter_type": "nearest"}
    place = T().translate([0, 2, 0]).rotate([1, 0, 0], -90 if flipped else 90).scale(1.5)
    if shape in ("sphere", "cylinder"):
        place = T().translate([0, 2, 0]).rotate([0.62, -0.77, 0.151], 210).scale(5.5 if flipped else 0.8)
    lamp = {"type": shape, "to_world": place, "flip_normals": flipped, "bsdf": grey(0.0)}
    lamp["emitter"] = {"type": "area", "radiance": texture}
    more = {f"m{i}": ball("area", (3, 3, 0), 0.5, bsdf=grey(0.0)) for i in range(others)}
    found = [
        picture([4.0, 0.5, 0], [0, 0, 0], 40, integrator, 2, spp=2048, floor=FLOOR, lamp=lamp, **more).mean()
        for integrator in ("directSampleLight", "directSampleBSDF", "path")
    ]
    assert found[1] > 0.02
    assert found[0] == pytest.approx(found[1], rel=0.01) and found[2] == pytest.approx(found[1], rel=0.01)


@pytest.mark.parametrize("p", [(0, 0, 5), (1.2, -0.3, 0.4), (300, 20, -10), (0.3, 0.2, 0.1), (0.6, 0.9, 0.8)])
def test_a_cap_is_sampled_with_the_density_that_it_tells(p: tuple[float, float, float]) -> None:
    """Moments of directions, weighted by 1 / pdf, are those of all directions that meet the ball."""
    centre, radius = np.array([0.3, 0.2, 0.1]), 0.7
    ball_ = solid_angles.Ball(mi.Point3f(*map(float, centre)), mi.Float(radius), mi.Float(1))
    seen = solid_angles.SphericalCap(mi, ball_, mi.Point3f(*map(float, p)))
    n = 512
    u, v = (mi.Float(g.ravel().astype(np.float32)) for g in np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2))
    point, normal, _, pdf = seen.sample(u, v)
    point, normal, pdf = (np.array(x, np.float64) for x in (point, normal, pdf))
    assert np.allclose(point - centre[:, None], radius * normal, rtol=0, atol=1e-5)
    assert np.allclose(np.linalg.norm(normal, axis=0), 1, rtol=0, atol=1e-5)
    away = point - np.array(p)[:, None]
    distance = np.linalg.norm(away, axis=0)
    again = seen.pdf(mi.Float(distance.astype(np.float32)), mi.Float(abs((away * normal).sum(0)) / distance))
    assert np.allclose(again, pdf, rtol=1e-2, atol=0)
    far = np.linalg.norm(centre - p)
    if far < radius:
        expected, mean = 4 * np.pi, 0.0
    else:
        cosine = np.sqrt(1 - (radius / far) ** 2)
        expected = 2 * np.pi * (radius / far) ** 2 / (1 + cosine)
        mean = (1 + cosine) / 2
        assert float(seen.solid_angle[0]) == pytest.approx(expected, rel=1e-5)
        towards = (away / distance).T @ (centre - p) / far
        assert (towards / pdf).mean() == pytest.approx(mean * expected, rel=1e-3)
    assert (1 / pdf).mean() == pytest.approx(expected, rel=1e-3)


def test_uv_of_a_ball_are_those_that_rays_find() -> None:
    rng = np.random.default_rng(3)
    for scale in ([2, 2, 2], [-2, 2, 2]):
        place = T().translate([1, 2, 3]).rotate([0.48, 0.6, 0.64], 70).scale(scale)
        scene = mi.load_dict({"type": "scene", "s": {"type": "sphere", "to_world": place}})
        shape = scene.shapes()[0]
        ball_ = solid_angles.Ball.of(mi, shape)
        normal = rng.normal(size=(3, 1000))
        normal = mi.Vector3f((normal / np.linalg.norm(normal, axis=0)).astype(np.float32))
        si = scene.ray_intersect(mi.Ray3f(ball_.center + 3 * normal, -normal))
        assert dr.all(si.is_valid())
        u, v = (np.array(x) for x in ball_.uv(normal))
        gap = np.abs(u - np.array(si.uv.x))
        assert np.allclose(np.minimum(gap, 1 - gap), 0, rtol=0, atol=2e-4)
        assert np.allclose(v, si.uv.y, rtol=0, atol=1e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("others", [0, 1])
def test_a_rectangle_shines_from_the_side_of_its_normal(others: int, mirror: int, flip: bool) -> None:
    """Turned over, mirrored, with flipped normals, alone and beside another one: as Mitsuba has it."""
    for turn in (90, -90):
        place = T().translate([0, 3, 0]).rotate([1, 0, 0], turn).scale([mirror, 1, 1])
        red = {"type": "area", "radiance": {"type": "rgb", "value": [2.0, 1.0, 0.5]}}
        lamp = {"type": "rectangle", "to_world": place, "flip_normals": flip, "emitter": red, "bsdf": grey(0.0)}
        more = {f"m{i}": ball("area", (2, 2, 2), 0.2, bsdf=grey(0.0)) for i in range(others)}
        scene = {"floor": FLOOR, "lamp": lamp, **more}
        film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
        view = {"type": "perspective", "fov": 9, "to_world": T().look_at([4.5, 1, 0], [0, 0, 0], [0, 0, 1])}
        loaded = mi.load_dict({"type": "scene", "camera": {**view, "film": film}, **scene}, optimize=False)
        render = Render(loaded, Settings("path", 2))
        render.advance(1024)
        expected = np.array(mi.render(loaded, integrator=mi.load_dict({"type": "path", "max_depth": 2}), spp=1024))
        assert render.image().mean((0, 1)) == pytest.approx(expected.mean((0, 1)), rel=3e-3, abs=1e-9)
