"""Lights: the spherical rectangle against quadrature, the two-sided light, the choice among several."""

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport.lights import lights, solid_angles

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f


def rectangle() -> solid_angles.Rectangle:
    return solid_angles.Rectangle(
        mi.Point3f(-1, -0.5, 0), mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Float(2.0), mi.Float(1.5)
    )


def solid_angle_64(p: tuple[float, float, float]) -> float:
    """By midpoint quadrature of z / r^3 over the rectangle, in float64."""
    n = 2000
    x = -1 + 2.0 * (np.arange(n) + 0.5) / n - p[0]
    y = -0.5 + 1.5 * (np.arange(n) + 0.5) / n - p[1]
    rr = x[:, None] ** 2 + y[None, :] ** 2 + p[2] ** 2
    return float((abs(p[2]) / rr**1.5).mean() * 3.0)


@pytest.mark.parametrize(
    "p", [(0, 0, 1), (0.3, 0.2, -0.4), (3, 2, 1), (5, 0.1, 0.05), (0.2, 0.1, 20), (100, 50, 70), (-1, -0.5, 0.3)]
)
def test_solid_angle_agrees_with_quadrature_near_and_far(p: tuple[float, float, float]) -> None:
    seen = solid_angles.SphericalRectangle(rectangle(), mi.Point3f(p))
    assert float(seen.solid_angle[0]) == pytest.approx(solid_angle_64(p), rel=2e-5)


@pytest.mark.parametrize("p", [(0, 0, 1), (0.3, 0.2, -0.4), (3, 2, 1), (2, 2, 4), (-1, -0.5, 0.3), (0.2, 0.1, 60)])
def test_directions_are_uniform_in_the_solid_angle(p: tuple[float, float, float]) -> None:
    """Moments of the sampled points, weighted 1/pdf, are those of the rectangle under the solid angle measure."""
    n = 256
    u, v = (mi.Float(g.ravel().astype(np.float32)) for g in np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2))
    point, _, uv, pdf = solid_angles.SphericalRectangle(rectangle(), mi.Point3f(p)).sample(u, v)
    point, pdf, uv = np.array(point, np.float64), np.array(pdf, np.float64), np.array(uv, np.float64)
    assert np.allclose(point[0], -1 + 2 * uv[0], atol=1e-5) and np.allclose(point[1], -0.5 + 1.5 * uv[1], atol=1e-5)
    assert uv.min() > -1e-5 and uv.max() < 1 + 1e-5
    x = (np.arange(1000) + 0.5) / 1000
    gx, gy = np.meshgrid(-1 + 2 * x, -0.5 + 1.5 * x)
    density = abs(p[2]) / ((gx - p[0]) ** 2 + (gy - p[1]) ** 2 + p[2] ** 2) ** 1.5
    for f in (lambda a, b: a**0, lambda a, b: a, lambda a, b: b, lambda a, b: a * b, lambda a, b: a**2):
        expected = (density * f(gx, gy)).mean() * 3.0
        assert (f(point[0], point[1]) / pdf).mean() == pytest.approx(expected, rel=2e-3, abs=2e-3 * density.mean())


def test_tiny_and_huge_solid_angles_fall_back_to_the_area() -> None:
    seen = solid_angles.SphericalRectangle(rectangle(), mi.Point3f([0, 0, 0.3], [0, 0, 0.1], [500, 1e-7, 1]))
    assert list(seen.uniform) == [False, False, True]
    u = mi.Float([0.3, 0.3, 0.3])
    *_, pdf = seen.sample(u, u)
    assert np.isfinite(np.array(pdf)).all()


def lamp(emitter: dict, **shape: object) -> dict:
    return {"type": "rectangle", "emitter": emitter, **shape}


def both_sides(emitter: dict) -> np.ndarray:
    """Irradiance-like answers of the emitter, asked at a point above and a point below."""
    scene = mi.load_dict({"type": "scene", "light": lamp(emitter)})
    it = dr.zeros(mi.SurfaceInteraction3f, 2)
    it.p = mi.Point3f([0.2, 0.2], 0.1, [1.5, -1.5])
    ds, weight = scene.sample_emitter_direction(it, mi.Point2f([0.3, 0.3], 0.6), False)
    lit = np.array(weight[0]) > 0
    assert np.allclose(np.array(scene.pdf_emitter_direction(it, ds))[lit], np.array(ds.pdf)[lit], rtol=1e-4)
    ray = mi.Ray3f(it.p, ds.d)
    si = scene.ray_intersect(ray)
    seen = si.emitter(scene).eval(si)
    assert np.allclose(np.array(seen[0]), np.array(weight[0] * ds.pdf), rtol=1e-4)
    return np.array(weight[0])


def test_gonio_area_shines_from_both_sides_where_area_does_not() -> None:
    lights.register(mi)
    radiance = {"type": "rgb", "value": [3, 3, 3]}
    two = both_sides({"type": "gonio_area", "radiance": radiance})
    assert two[0] > 0 and two[1] == pytest.approx(two[0], rel=1e-5)
    one = both_sides({"type": "area", "radiance": radiance})
    assert one[0] > 0 and one[1] == 0


@pytest.mark.parametrize("shape", ["sphere", "disk", "cube", "cylinder"])
@pytest.mark.parametrize("z", [4.0, -4.0])
def test_gonio_area_sends_from_any_shape_what_rays_find_there(shape: str, z: float) -> None:
    """Fluence at a point: by sampling the light, and by rays in all directions that look for it."""
    lights.register(mi)
    scene = mi.load_dict({"type": "scene", "s": {"type": shape, "emitter": {"type": "gonio_area", "radiance": 2.0}}})
    n = 1 << 18
    it = dr.zeros(mi.SurfaceInteraction3f, n)
    it.p = mi.Point3f(0.2, 0.9, z)
    rng = mi.PCG32(size=n)
    sample = mi.Point2f(rng.next_float32(), rng.next_float32())
    ds, weight = scene.sample_emitter_direction(it, sample, True)
    lit = np.array(weight[0]) > 0
    assert np.allclose(np.array(scene.pdf_emitter_direction(it, ds))[lit], np.array(ds.pdf)[lit], rtol=1e-3)
    si = scene.ray_intersect(mi.Ray3f(it.p, mi.warp.square_to_uniform_sphere(sample)))
    found = np.array(si.emitter(scene).eval(si)[0]) * 4 * np.pi
    for values in (np.array(weight[0]), found):
        assert values.mean() > 0.05
    sigma = np.hypot(np.array(weight[0]).std(), found.std()) / np.sqrt(n)
    assert abs(np.array(weight[0]).mean() - found.mean()) < 5 * sigma


def test_registering_twice_does_nothing() -> None:
    lights.register(mi)
    lights.register(mi)


def test_a_sheared_rectangle_is_not_taken_for_a_rectangle() -> None:
    turned = T().rotate([1, 0, 0], 40).rotate([0, 0, 1], 20).scale([1, 3, 1])
    straight = mi.load_dict({"type": "rectangle", "to_world": turned})
    assert solid_angles.is_rectangle(mi, straight)
    sheared = mi.load_dict(
        {"type": "rectangle", "to_world": T([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])}
    )
    assert not solid_angles.is_rectangle(mi, sheared)
    assert not solid_angles.is_rectangle(mi, mi.load_dict({"type": "sphere"}))


def test_a_bright_light_is_chosen_more_often_and_none_never() -> None:
    def point(intensity: float) -> dict:
        return {"type": "point", "position": [0, 5, intensity], "intensity": {"type": "rgb", "value": intensity}}

    scene = mi.load_dict({"type": "scene", "s": {"type": "sphere"}, "a": point(1.0), "b": point(3.0), "c": point(0.0)})
    chance = sorted(np.array(lights.Lights(mi, scene).probability))
    assert sum(chance) == pytest.approx(1)
    assert chance[0] == pytest.approx(1 / 6, abs=1e-6)  # the dark one: its uniform half
    assert chance[2] > chance[1] > chance[0]


def test_an_area_light_without_radiance_is_one_clear_error() -> None:
    lights.register(mi)
    with pytest.raises(RuntimeError, match=r"gonio_area.radiance: missing"):  # a null pointer, before
        mi.load_dict({"type": "sphere", "emitter": {"type": "gonio_area"}})
