"""What a scene file says is what Mitsuba gets: places, orientations, texture coordinates, materials."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import scene
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.render.prepare import prepare
from gonio.render.request import Request


def scene_with(shapes: list, lights: list | None = None, **changes: Any) -> dict:
    return {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "xSamples": 2, "ySamples": 2},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 1, 4], "up": [0, 1, 0], "lookAt": [0, 0, 0]},
            "verticalFov": 45,
            "film": {"size": [60, 40]},
        },
        "integrator": {"type": "direct"},
        "scene": {"shapes": shapes, "lights": lights or []},
    } | changes


@pytest.fixture(scope="module")
def mi():
    return engine.load()


@pytest.fixture
def build(mi, tmp_path):
    """Write a scene and build it; returns the Mitsuba scene."""

    def make(shapes: list, lights: list | None = None, **changes: Any) -> Any:
        (tmp_path / "scene.json").write_text(json.dumps(scene_with(shapes, lights, **changes)))
        return scene.build(scene.read(tmp_path), mi)

    make.folder = tmp_path
    return make


def hit(mi, built, origin, direction) -> Any:
    ray = mi.Ray3f(mi.Point3f(*map(float, origin)), mi.Vector3f(*map(float, direction)))
    return built.ray_intersect(ray)


def vector(value: Any) -> np.ndarray:
    return np.array(value)[:, 0]


def save(mi, path: Path, pixels: np.ndarray) -> None:
    mi.Bitmap(np.ascontiguousarray(pixels)).write(str(path))


# ---------------------------------------------------------------------- camera


@pytest.mark.parametrize("near, far", [(None, None), (0.1, 1e4)])
def test_camera_looks_from_position_to_look_at_with_right_as_forward_cross_up(mi, build, near, far):
    data = scene_with([])
    if near:
        data["camera"] |= {"tNear": near, "tFar": far}
    sensor = build([], camera=data["camera"]).sensors()[0]
    right_of_middle, above_middle = (0.9, 0.5), (0.5, 0.1)  # film coordinates, y downward
    forward = np.array([0, -1, -4]) / math.sqrt(17)
    right = np.array([1.0, 0, 0])
    up = np.cross(right, forward)
    half = math.tan(math.radians(22.5))
    for position, offset in ((right_of_middle, right * 0.8 * half * 60 / 40), (above_middle, up * 0.8 * half)):
        ray, _ = sensor.sample_ray(0.0, 0.0, mi.Point2f(*position), mi.Point2f(0.5))
        expected = (forward + offset) / np.linalg.norm(forward + offset)
        assert np.allclose(vector(ray.d), expected, atol=1e-6)


# ---------------------------------------------------------------------- shapes


def test_sphere_has_u_about_y_from_z_toward_x_and_v_from_plus_y(mi, build):
    built = build([{"type": "sphere", "center": [1, 2, 3], "radius": 2}])
    for theta, phi in [(1.0, 0.5), (1.0, 2.0), (2.0, -1.0)]:
        out = np.array([math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)])
        si = hit(mi, built, [1, 2, 3] + 5 * out, -out)
        assert np.allclose(vector(si.uv), [phi / (2 * math.pi) % 1, theta / math.pi], atol=1e-5)
        assert np.allclose(vector(si.n), out, atol=1e-5)
        assert float(si.t[0]) == pytest.approx(3, abs=1e-5)


def test_sphere_radius_is_not_scaled_but_its_centre_is(mi, build):
    transform = {"translate": [0, 0, 1], "rotate": {"axis": [0, 0, 1], "radian": math.pi / 2}, "scale": [3, 1, 1]}
    built = build([{"type": "sphere", "center": [1, 0, 0], "radius": 0.5, "transform": transform}])
    si = hit(mi, built, [0, 10, 1], [0, -1, 0])  # x = 1 -> scaled 3 -> turned to y = 3 -> moved to z = 1
    assert np.allclose(vector(si.p), [0, 3.5, 1], atol=1e-5)


def test_sheared_parallelogram_is_base_plus_u_edge0_plus_v_edge1(mi, build):
    base, edge0, edge1 = np.array([1.0, 0, 0]), np.array([2.0, 0, 0]), np.array([1.0, 3, 0.5])
    built = build([{"type": "parallelogram", "base": [1, 0, 0], "edge0": [2, 0, 0], "edge1": [1, 3, 0.5]}])
    area = np.cross(edge0, edge1)
    normal = area / np.linalg.norm(area)
    for u, v in [(0.1, 0.9), (0.95, 0.95), (0.5, 0.1)]:
        si = hit(mi, built, base + u * edge0 + v * edge1 + normal, -normal)
        assert np.allclose(vector(si.uv), [u, v], atol=1e-5)
        assert np.allclose(vector(si.sh_frame.n), normal, atol=1e-5)
        assert np.allclose(vector(si.dp_du), edge0, atol=1e-5)
    for u, v in [(1.01, 0.5), (0.5, -0.01)]:
        assert not hit(mi, built, base + u * edge0 + v * edge1 + normal, -normal).is_valid()[0]
    shape = built.shapes()[0]
    sample = shape.sample_position(0.0, mi.Point2f(0.3, 0.6))
    assert np.allclose(vector(sample.p), base + 0.3 * edge0 + 0.6 * edge1, atol=1e-5)
    assert float(sample.pdf[0]) == pytest.approx(1 / np.linalg.norm(area), rel=1e-5)


@pytest.mark.parametrize("scale", [[1, 1, 1], [0.5, 2, 1], [-1, 1, 1]])
def test_cube_normals_point_outward_even_when_mirrored(mi, build, scale):
    built = build([{"type": "cube", "transform": {"scale": scale}}])
    for axis in range(3):
        for side in (-1, 1):
            out = np.eye(3)[axis] * side
            si = hit(mi, built, 5 * out + 0.1, -out)
            assert np.allclose(vector(si.n), out, atol=1e-6)
            assert np.allclose(vector(si.sh_frame.n), out, atol=1e-6)
            assert np.abs(vector(si.p)[axis]) == pytest.approx(abs(scale[axis]))


def test_disk_lies_in_z_0_with_v_from_the_rim_inward(mi, build):
    built = build([{"type": "disk", "radius": 2, "inner_radius": 0.5, "phi_max": 3}])
    for radius, phi in [(1.9, 0.2), (0.6, 2.9), (1.2, 1.5)]:
        si = hit(mi, built, [radius * math.cos(phi), radius * math.sin(phi), 1], [0, 0, -1])
        assert np.allclose(vector(si.n), [0, 0, 1], atol=1e-6)
        assert np.allclose(vector(si.uv), [phi / 3, 1 - radius / 2], atol=1 / 1024)
        along = vector(si.dp_du) / np.linalg.norm(vector(si.dp_du))
        assert np.allclose(along, [-math.sin(phi), math.cos(phi), 0], atol=math.pi / 1024)
    for radius, phi in [(0.4, 1), (2.1, 1), (1, 3.1)]:
        assert not hit(mi, built, [radius * math.cos(phi), radius * math.sin(phi), 1], [0, 0, -1]).is_valid()[0]


def test_cylinder_stands_from_0_to_height_with_normals_outward(mi, build):
    built = build([{"type": "cylinder", "radius": 0.5, "height": 3, "phi_max": 5}])
    for z, phi in [(0.1, 0.3), (2.9, 4.9), (1.5, 2.1)]:
        out = np.array([math.cos(phi), math.sin(phi), 0])
        si = hit(mi, built, out * 2 + [0, 0, z], -out)
        assert np.allclose(vector(si.uv), [phi / 5, z / 3], atol=1 / 1024)
        assert np.allclose(vector(si.sh_frame.n), out, atol=1e-5)
        assert np.linalg.norm(vector(si.p)[:2]) == pytest.approx(0.5, rel=1e-5)
    assert not hit(mi, built, [0, 0, 9], [0, 0, -1]).is_valid()[0]  # open at both ends


def test_cone_rises_to_its_apex_with_normals_outward(mi, build):
    built = build([{"type": "cone", "radius": 1, "height": 2}])
    for z, phi in [(0.2, 0.3), (1.8, 4.9)]:
        radius = 1 - z / 2
        out = np.array([math.cos(phi), math.sin(phi), 0])
        si = hit(mi, built, out * 5 + [0, 0, z], -out)
        normal = (out * 2 + [0, 0, 1]) / math.sqrt(5)
        assert np.allclose(vector(si.p), out * radius + [0, 0, z], atol=1e-4)
        assert np.allclose(vector(si.sh_frame.n), normal, atol=math.pi / 1024)
        assert float(si.uv.y[0]) == pytest.approx(z / 2, abs=1e-4)


def test_tessellated_areas_are_within_the_stated_error(mi, build):
    built = build([{"type": "disk"}, {"type": "cylinder", "height": 2}, {"type": "cone", "height": 1}])
    areas = [float(shape.surface_area()[0]) for shape in built.shapes()]
    assert areas == pytest.approx([math.pi, 4 * math.pi, math.pi * math.sqrt(2)], rel=1e-5)


def test_transform_scales_then_rotates_then_translates(mi, build):
    transform = {"translate": [5, 0, 0], "rotate": {"axis": [0, 0, 1], "radian": math.pi / 2}, "scale": [2, 1, 1]}
    built = build([{"type": "cube", "transform": transform}])
    assert np.allclose(np.array(built.bbox().min), [4, -2, -1], atol=1e-5)
    assert np.allclose(np.array(built.bbox().max), [6, 2, 1], atol=1e-5)


# ---------------------------------------------------------------------- lights


def test_shapes_of_equal_material_lie_within_the_scene(mi, build):
    """Mitsuba makes one mesh of them; beyond the scene's box nothing is in the way of a sky."""
    cube = {"type": "cube", "transform": {"translate": [3, 0, 0]}}
    sheets = [{"type": "parallelogram", "base": [-9, y, -9], "edge0": [0, 0, 18], "edge1": [18, 0, 0]} for y in (-1, 7)]
    box = build([cube, *sheets, {"type": "sphere", "center": [0, 0, 0], "radius": 0.5}]).bbox()
    np.testing.assert_allclose([box.min, box.max], [[-9, -1, -9], [9, 7, 9]])


def test_area_light_shines_from_both_sides_of_any_shape(mi, build):
    shapes = [
        {"type": "parallelogram", "base": [0, 0, 0], "edge0": [1, 0, 0], "edge1": [0, 1, 0]},
        {"type": "sphere", "center": [5, 0, 0], "radius": 1},
        {"type": "disk", "transform": {"translate": [10, 0, 0]}},
    ]
    built = build([], [{"type": "areaLight", "energy": [1, 2, 3], "shape": shape} for shape in shapes])
    assert len(built.emitters()) == 3
    for x in (0.5, 5, 9.9):
        for side in (-1, 1):
            si = hit(mi, built, [x, 0.25, 5 * side], [0, 0, -side])
            assert np.allclose(vector(si.emitter(built).eval(si)), [1, 2, 3])


def test_spot_light_is_a_point_of_that_intensity(mi, build):
    built = build([], [{"type": "spotLight", "position": [0, 3, 0], "energy": 8}])
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(0, 1, 0)
    ds, weight = built.sample_emitter_direction(si, mi.Point2f(0.5))
    assert np.allclose(vector(weight), 8 / 4)
    assert np.allclose(vector(ds.p), [0, 3, 0])


@pytest.mark.parametrize("length", [1e-25, 1.0, 1e17])
def test_directional_light_arrives_from_everywhere_with_that_irradiance(mi, build, length):
    ground = {"type": "parallelogram", "base": [-9, 0, 9], "edge0": [18, 0, 0], "edge1": [0, 0, -18]}
    light = {"type": "directionalLight", "direction": [0.6 * length, -0.8 * length, 0], "energy": [1, 2, 3]}
    built = build([{**ground, "material": {"type": "matte", "albedo": 0.5}}], [light])
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(0, 1, 0)
    ds, weight = built.sample_emitter_direction(si, mi.Point2f(0.5))
    assert np.allclose(vector(weight), [1, 2, 3])
    assert np.allclose(vector(ds.d), [-0.6, 0.8, 0], atol=1e-6)


def test_directional_light_lights_a_matte_floor_by_its_cosine(scene):
    description = json.loads((scene / "scene.json").read_text())
    description["camera"]["transform"] = {"position": [0, 5, 0], "lookAt": [0, 0, 0], "up": [0, 0, -1]}
    floor = {"type": "parallelogram", "base": [-9, 0, 9], "edge0": [18, 0, 0], "edge1": [0, 0, -18]}
    light = {"type": "directionalLight", "direction": [0.6, -0.8, 0], "energy": [1, 2, 3]}
    description["scene"] = {"shapes": [{**floor, "material": {"type": "matte", "albedo": 0.5}}], "lights": [light]}
    expected = 0.5 / math.pi * 0.8 * np.array([1, 2, 3])
    for integrator in ("directSampleLight", "path", "caustics", "light"):
        depth = {} if integrator.startswith("direct") else {"maxDepth": 3}
        (scene / "scene.json").write_text(json.dumps({**description, "integrator": {"type": integrator, **depth}}))
        picture = np.asarray(go.render(scene, spp=16 if integrator != "light" else 256))
        error = np.abs(picture.mean((0, 1)) / expected - 1.0).max()
        assert error < (1e-5 if integrator != "light" else 0.02), integrator


@pytest.mark.parametrize("height, width", [(8, 16), (5, 7)])
def test_environment_looks_up_texel_centres_by_the_format_s_angles(mi, build, height, width):
    pixels = np.random.default_rng(1).random((height, width, 3)).astype(np.float32)
    save(mi, build.folder / "sky.exr", pixels)
    light = {"type": "environmentLight", "texture": {"type": "imageTex", "file": "sky.exr"}}
    built = build([], [light])
    for row in range(height):
        for column in range(0, width, 3):
            theta, phi = (row + 0.5) / height * math.pi, (column + 0.5) / width * 2 * math.pi
            sky = [math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)]
            si = hit(mi, built, [0, 0, 0], sky)
            assert np.allclose(vector(built.environment().eval(si)), pixels[row, column], atol=2e-3)


def test_constant_environment(mi, build):
    for light in ({"radiance": [1, 2, 3]}, {"texture": [1, 2, 3]}):
        built = build([], [{"type": "environmentLight"} | light])
        si = hit(mi, built, [0, 0, 0], [0, 1, 0])
        assert np.allclose(vector(built.environment().eval(si)), [1, 2, 3])


# ---------------------------------------------------------------------- materials


def reflected(mi, built, at=(0.5, 0.5), wi=(0, 0, 1), wo=(0, 0, 1)) -> np.ndarray:
    """f cos of the unit square in z = 0 at a uv, seen along wo and lit along wi (world, unit)."""
    si = hit(mi, built, np.array([*at, 0]) + np.array(wo), -np.array(wo))
    return vector(si.bsdf().eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(*map(float, wi)))))


def square(material: dict) -> list:
    edges = {"base": [0, 0, 0], "edge0": [1, 0, 0], "edge1": [0, 1, 0]}
    return [{"type": "parallelogram", "material": material} | edges]


def test_absent_material_is_matte_one_half(mi, build):
    shape = square({})[0]
    del shape["material"]
    assert np.allclose(reflected(mi, build([shape])), 0.5 / math.pi)


def test_equal_materials_share_one_bsdf(mi, build):
    shapes = [*square({"type": "matte", "albedo": [0.1, 0.2, 0.3]}) * 3, *square({"type": "matte"})]
    assert len({shape.bsdf() for shape in build(shapes).shapes()}) == 2


def test_texture_has_v_0_at_the_top_and_counts_bytes_as_v_over_255(mi, build):
    pixels = np.array([[[255, 0, 0], [0, 51, 0]], [[0, 0, 102], [51, 102, 153]]], np.uint8)
    save(mi, build.folder / "t.png", pixels)
    texture = {"type": "imageTex", "file": "t.png", "filter": "nearest"}
    built = build(square({"type": "matte", "albedo": texture}))
    for row in range(2):
        for column in range(2):
            got = reflected(mi, built, ((column + 0.5) / 2, (row + 0.5) / 2)) * math.pi
            assert np.allclose(got, pixels[row, column] / 255, atol=1e-6)


def test_colour_space_srgb_decodes(mi, build):
    save(mi, build.folder / "t.png", np.full((2, 2, 3), 188, np.uint8))
    texture = {"type": "imageTex", "file": "t.png", "colorSpace": "srgb"}
    got = reflected(mi, build(square({"type": "matte", "albedo": texture}))) * math.pi
    assert np.allclose(got, ((188 / 255 + 0.055) / 1.055) ** 2.4, atol=1e-5)


def conductor(mi, build, **keys: Any) -> np.ndarray:
    half = np.array([0.3, 0.1, 0.9])
    wi = 2 * half[2] * half - [0, 0, half @ half]
    material = {"type": "conductor", "eta": [0.2, 0.4, 1.4], "k": [3.4, 2.3, 1.8]} | keys
    return reflected(mi, build(square(material)), wi=wi / np.linalg.norm(wi))


def test_lab_roughness_is_alpha_and_gonio_roughness_is_its_square_root(mi, build):
    lab = conductor(mi, build, roughness=0.25, ndf="ggx")
    explicit = {"ndf": "ggx", "masking": "smith-separable", "fresnel": "schlick", "type": "gonio-conductor"}
    assert np.allclose(lab, conductor(mi, build, alpha=0.25, **explicit), rtol=1e-5)
    assert np.allclose(lab, conductor(mi, build, roughness=0.5, **explicit), rtol=1e-5)
    assert np.allclose(lab, conductor(mi, build, alpha=0.25, ndf="ggx"), rtol=1e-5)


def test_lab_conductor_without_ndf_is_beckmann(mi, build):
    assert np.allclose(conductor(mi, build, roughness=0.3), conductor(mi, build, roughness=0.3, ndf="beckmann"))
    assert not np.allclose(
        conductor(mi, build, roughness=0.3), conductor(mi, build, roughness=0.3, ndf="ggx"), rtol=0.01
    )


def test_width_may_be_a_pair_or_a_texture(mi, build):
    grey = np.full((2, 2, 3), [102, 127.5, 153], np.float32) / 255  # mean 0.5
    save(mi, build.folder / "r.exr", grey)
    texture = {"type": "imageTex", "file": "r.exr"}
    one = conductor(mi, build, roughness=0.5)
    assert np.allclose(one, conductor(mi, build, roughness=texture), rtol=1e-3)
    assert np.allclose(one, conductor(mi, build, roughness=[0.5, 0.5]), rtol=1e-5)
    assert np.allclose(one, conductor(mi, build, roughness=[0.5, texture]), rtol=1e-3)
    assert not np.allclose(one, conductor(mi, build, roughness=[0.5, 0.2]), rtol=1e-3)
    dial = {"type": "gonio-conductor"}
    assert np.allclose(
        conductor(mi, build, alpha=0.25, **dial), conductor(mi, build, roughness=texture, **dial), rtol=1e-3
    )


def test_preset_sets_the_index(mi, build):
    material = {"type": "conductor", "roughness": 0.3}
    gold = reflected(mi, build(square(material | {"preset": "Au"})))
    same = {"eta": [0.18299, 0.42108, 1.3734], "k": [3.4242, 2.3459, 1.7704]}
    assert np.allclose(gold, reflected(mi, build(square(material | same))), rtol=1e-5)


def test_opaque_materials_are_not_black_from_behind(mi, build):
    for material in ({"type": "matte"}, {"type": "lambert"}, {"type": "phong", "p": 8}):
        built = build(square(material))
        assert np.allclose(
            reflected(mi, built, wi=(0, 0, -1), wo=(0, 0, -1)), reflected(mi, built, wi=(0, 0, 1), wo=(0, 0, 1))
        )
    built = build(square({"type": "lambert", "two_sided": False}))
    assert np.all(reflected(mi, built, wi=(0, 0, -1), wo=(0, 0, -1)) == 0)


def test_mix_nests_materials(mi, build):
    mix = {
        "type": "mix",
        "a": {"type": "matte", "albedo": 0.2},
        "b": {"type": "lambert", "albedo": 0.6},
        "weight": 0.25,
    }
    assert np.allclose(reflected(mi, build(square(mix))), 0.3 / math.pi, rtol=1e-5)


@pytest.mark.parametrize("tilt", [[0.6, 0, 0.8], [0, 0.6, 0.8], [-0.36, 0.48, 0.8]])
def test_normal_map_is_tangent_bitangent_normal_with_bitangent_n_cross_t(mi, build, tilt):
    save(mi, build.folder / "n.exr", np.tile(((np.array(tilt) + 1) / 2).astype(np.float32), (2, 2, 1)))
    shape = square({"type": "matte", "normalmap": {"file": "n.exr"}})[0]
    shape |= {"edge0": [0, 1, 0], "edge1": [-1, 0, 0]}  # dp/du = y, normal = z, bitangent = z x y = -x
    normal = tilt[0] * np.array([0, 1, 0]) + tilt[1] * np.array([-1, 0, 0]) + tilt[2] * np.array([0, 0, 1])
    built = build([shape])
    for wi in ([0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]):
        got = reflected(mi, built, at=(-0.5, 0.5), wi=wi)
        up_again = np.dot(np.array(wi) * [1, 1, -1], normal)  # what is sent below the surface
        expected = max(np.dot(wi, normal), 0.0) + max(up_again, 0.0)
        # the map is stored in 16 bits
        assert np.allclose(got, 0.5 / math.pi * expected, atol=2e-3)


def test_texture_values_out_of_the_parameter_s_range_are_an_error(mi, build):
    save(mi, build.folder / "r.exr", np.full((2, 2, 1), 1.5, np.float32))
    texture = {"type": "imageTex", "file": "r.exr"}
    with pytest.raises(InputError, match=r"alpha is >= 0 and <= 1"):
        build(square({"type": "conductor", "roughness": texture}))


def test_bright_albedo_texture_is_a_warning(mi, build):
    save(mi, build.folder / "a.exr", np.full((2, 2, 3), 1.5, np.float32))
    (build.folder / "scene.json").write_text(
        json.dumps(scene_with(square({"type": "matte", "albedo": {"type": "imageTex", "file": "a.exr"}})))
    )
    description = scene.read(build.folder)
    scene.build(description, mi)
    assert any("holds 1.5" in warning for warning in description.warnings)


def test_rendering_the_same_scene_twice_compiles_nothing_new(mi, build):
    import drjit as dr

    def render(albedo: float) -> None:
        light = {"type": "areaLight", "energy": 5, "shape": {"type": "sphere", "center": [0, 3, 0], "radius": 1}}
        built = build(square({"type": "matte", "albedo": albedo}), [light])
        np.array(mi.render(built, integrator=mi.load_dict({"type": "direct"}), spp=1))

    render(0.2)
    dr.kernel_history_clear()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        render(0.7)
        kernels = [kernel for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    assert kernels and all(kernel["cache_hit"] for kernel in kernels)


def test_picture_agrees_with_the_course_framework_s_and_is_not_mirrored(mi, shared):
    def blocks(picture: np.ndarray) -> np.ndarray:
        return picture[:390].reshape(39, 10, 60, 10, 3).mean(axis=(1, 3))

    built = scene.build(scene.read(shared / "scenes" / "lab2-test" / "phong"), mi)
    picture = np.array(mi.render(built, integrator=mi.load_dict({"type": "direct"}), spp=16))[:-1]
    with np.load(shared / "reference" / "lab2" / "phong.npz") as file:
        reference = blocks(file["radiance"].astype(np.float32)[1:])  # the framework's picture sits one row too low
    error = np.abs(blocks(picture) - reference) / np.maximum(reference, 1e-2)
    assert np.median(error) < 0.005
    mirrored = np.abs(blocks(picture[:, ::-1]) - reference) / np.maximum(reference, 1e-2)
    assert np.median(mirrored) > 0.1


def test_two_lamps_that_are_alike_are_two_lamps(build):
    lamp = {
        "type": "areaLight",
        "energy": [5, 5, 5],
        "shape": {"type": "parallelogram", "base": [0, 3, 0], "edge0": [1, 0, 0], "edge1": [0, 0, 1]},
    }
    other = {**lamp, "shape": {**lamp["shape"], "base": [2, 3, 0]}}
    assert len(build([{"type": "sphere", "center": [0, 0, 0], "radius": 1}], [lamp, other]).emitters()) == 2


@pytest.mark.slow
def test_shapes_and_lights_come_in_the_same_order_every_time() -> None:
    """Mitsuba merges meshes, and hands them on in the order of their addresses: with it went that of the lights."""
    material = go.Lambert()
    orders = set()
    kept = []  # so that addresses differ
    for _ in range(8):
        prepared = prepare(Request(Path("ball"), material=material, spp=1, size=(8, 8)))
        kept.append(prepared)
        shapes = prepared.render.scene.shapes()  # type: ignore[attr-defined]
        orders.add(tuple((shape.id(), str(shape.bbox())) for shape in shapes))
    assert len(orders) == 1


def test_a_fault_of_the_machine_within_a_material_keeps_its_kind(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Mitsuba builds the material, whose table needs what is not there, and hands on text alone."""

    def no_table(self: go.KullaConty) -> None:
        raise go.MachineError("no LLVM 17 or newer found", "LLVM", "pip install karellen-llvm-core")

    described = json.loads((scene / "scene.json").read_text())
    metal = {"type": "conductor", "preset": "Au", "roughness": 0.5}
    described["scene"]["shapes"][0]["material"] = {"type": "kulla-conty", "base": metal}
    (scene / "scene.json").write_text(json.dumps(described))
    monkeypatch.setattr(go.KullaConty, "derive", no_table)
    with pytest.raises(go.MachineError, match="no LLVM 17") as raised:
        go.render(scene)
    assert (raised.value.where, raised.value.hint) == ("LLVM", "pip install karellen-llvm-core")


def test_a_sky_with_negative_radiance_is_refused(tmp_path: Path) -> None:
    from gonio.pictures import images

    pixels = np.ones((4, 8, 3), np.float32)
    pixels[2, 5, 1] = -1.0
    images.write(tmp_path / "sky.exr", pixels)
    scene = json.loads((Path(__file__).parents[2] / "examples" / "white-furnace" / "scene.json").read_text())
    scene["scene"]["lights"] = [{"type": "environmentLight", "texture": {"type": "imageTex", "file": "sky.exr"}}]
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    with pytest.raises(go.InputError, match="row 2, column 5 is below 0") as error:
        go.render(tmp_path / "scene.json", spp=1, size=(8, 8))
    assert error.value.where.endswith("lights/0/texture")
