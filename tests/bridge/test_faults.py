"""Canaries: each test fails once a fault of Mitsuba or Dr.Jit is fixed, and its file in `bridge/faults` can go.

Faults that end or hang a process have one of their own. Of `kernel_array_order` no short reproduction is known.
"""

from __future__ import annotations

import contextlib
import importlib
import pkgutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gonio.bridge import engine, faults
from gonio.bridge.faults.black_environment import is_black_environment
from gonio.bridge.faults.interrupted_recording import interruptible
from gonio.bridge.faults.lost_derivatives import own_variable
from gonio.bridge.faults.merged_mesh_bbox import compute_boxes
from gonio.bridge.faults.ray_offset import Offsets
from gonio.bridge.faults.rotated_sphere_normal import with_radial_normal
from gonio.bridge.faults.shadow_ray_gap import shadow_ray_to
from gonio.bridge.faults.textured_area_light import must_sample_by_area
from gonio.bridge.faults.thin_lens_importance import camera_sample

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)

T = mi.ScalarTransform4f


def kernels(work: Callable[[], object]) -> set[str]:
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        return {k["hash"] for k in dr.kernel_history([dr.KernelType.JIT])}


def at(*place: float) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.p, si.n, si.t = mi.Point3f(*place), mi.Normal3f(0, 0, 1), 1.0
    return si


UNSAFE = {"exr_threads", "missing_texture"}  # they hang or end the process


@pytest.mark.parametrize("name", [one.name for one in pkgutil.iter_modules(faults.__path__) if one.name not in UNSAFE])
def test_a_reproduction_runs_as_printed(name: str) -> None:
    doc = importlib.import_module(f"gonio.bridge.faults.{name}").__doc__ or ""
    lines = [line.removeprefix("    ") for line in doc.splitlines() if line.startswith("    ")]
    assert lines or name == "kernel_array_order"
    threads = dr.thread_count()
    try:
        with pytest.raises(RuntimeError) if name == "interrupted_recording" else contextlib.nullcontext():
            exec("\n".join(lines), {"mi": mi, "dr": dr, "np": np})
    finally:
        dr.set_thread_count(threads)  # which some set to 1: Mitsuba's next OpenEXR would hang


def test_a_black_environment_has_no_density() -> None:
    black = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(np.zeros((4, 8, 3), np.float32))})
    ds = dr.zeros(mi.DirectionSample3f, 1)
    ds.d = mi.Vector3f(0, 0, 1)
    assert not np.all(np.isfinite(np.array(black.pdf_direction(at(0, 0, 0), ds))))
    assert is_black_environment(mi, black)


def test_textured_area_lights_are_sampled_wrongly() -> None:
    """On a cube seen from outside the mean of pdf's inverse is not the solid angle that a constant light has."""
    means = []
    for raw in (True, False):
        pixels = mi.Bitmap(np.ones((2, 2, 3), np.float32))
        radiance = {"type": "bitmap", "bitmap": pixels, "raw": True} if raw else {"type": "rgb", "value": 1.0}
        cube = mi.load_dict({"type": "cube", "emitter": {"type": "area", "radiance": radiance}})
        n = 1 << 14
        u = mi.Point2f(*(mi.Float(x) for x in np.random.default_rng(1).random((2, n), np.float32)))
        it = dr.zeros(mi.SurfaceInteraction3f, n)
        it.p = mi.Point3f(3, 2, 2)
        means.append(float(np.mean(np.array(cube.emitter().sample_direction(it, u)[1]))))
        assert must_sample_by_area(mi, cube.emitter()) is raw
    assert means[0] != pytest.approx(means[1], rel=0.03)


def test_a_rotated_sphere_returns_the_normal_of_another() -> None:
    sphere = mi.load_dict({"type": "sphere", "to_world": T().rotate([1, 0, 0], 90)})
    ps = sphere.sample_position(mi.Float(0), mi.Point2f(0.1, 0.2))
    assert abs(float(dr.dot(ps.n, ps.p)[0])) < 0.9
    assert float(dr.dot(with_radial_normal(mi, ps, mi.Vector4f(0, 0, 0, 1)).n, ps.p)[0]) == pytest.approx(1, abs=1e-5)


def test_rays_end_before_the_point_that_they_go_to() -> None:
    si, point = at(0, 0, 0), mi.Point3f(0, 0, 1)
    assert float(si.spawn_ray_to(point).maxt[0]) < 0.9995
    ray = shadow_ray_to(Offsets(mi, mi.load_dict({"type": "scene", "ball": {"type": "sphere"}})), si, point)
    assert float(ray(ray.maxt).z[0]) == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_rays_begin_far_off_the_surfaces_of_a_small_scene(size: float) -> None:
    si, up = at(0.0, 0.0, size), mi.Vector3f(0, 0, 1)
    assert float(si.spawn_ray(up).o.z[0]) - size == pytest.approx((1 + size) * mi.math.RayEpsilon, rel=0.05)
    ball = {"type": "sphere", "to_world": T().scale(size)}
    offsets = Offsets(mi, mi.load_dict({"type": "scene", "ball": ball}))
    for direction, side in ((up, 1.0), (-up, -1.0)):
        away = float(offsets.ray(si, direction).o.z[0]) / size - 1.0
        unit = min(1 / 16, 1 / size)
        assert away == pytest.approx(side * (1 + unit) * mi.math.RayEpsilon, rel=0.05)


def test_the_thin_lens_sends_less_than_nothing_behind_it() -> None:
    film = {"type": "hdrfilm", "width": 8, "height": 8}
    lens = mi.load_dict({"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 4.0, "film": film})
    behind = at(0.1, 0.1, -1.0)
    importances = [
        float(np.min(np.array(sample[1])))
        for sample in (
            lens.sample_direction(behind, mi.Point2f(0.5), mi.Bool(True)),
            camera_sample(lens, behind, mi.Point2f(0.5), mi.Bool(True)),
        )
    ]
    assert importances[0] < 0 and importances[1] == 0


def test_merged_rectangles_have_no_box() -> None:
    material = mi.load_dict({"type": "diffuse"})
    wall = {"type": "rectangle", "bsdf": material}
    merged = mi.load_dict({"type": "merge", "a": wall, "b": {**wall, "to_world": T().translate([3, 0, 0])}})
    merged = merged if isinstance(merged, list) else [merged]
    assert len(merged) == 1 and not merged[0].bbox().valid()
    compute_boxes(merged)
    assert np.allclose(np.array(merged[0].bbox().max).ravel(), [4, 1, 0])


def test_interior_variables_lose_their_derivatives() -> None:
    with dr.resume_grad():
        x = mi.Float(1, 2)
        dr.enable_grad(x)
        interior = x * 2
        copy, behind = own_variable(interior, mi.Bool(True, True)), interior + 1
        dr.set_grad(x, 1)
        dr.enqueue(dr.ADMode.Forward, x)
        dr.traverse(dr.ADMode.Forward, flags=dr.ADFlag.ClearInterior)
        assert np.all(np.array(dr.grad(behind)) == 2) and np.all(np.array(dr.grad(copy)) == 2)
        assert np.all(np.array(dr.grad(interior)) == 0)


def test_an_interrupt_of_a_recording_becomes_another_error() -> None:
    def interrupted(i: Any) -> tuple[Any]:
        raise KeyboardInterrupt

    def record() -> None:
        dr.while_loop((mi.UInt32(0),), lambda i: i < 3, interrupted, mode="symbolic")

    with pytest.raises(RuntimeError):
        record()
    with pytest.raises(KeyboardInterrupt), interruptible():
        record()


def test_another_kernel_is_compiled_for_numpys_memory_where_it_is_not_aligned() -> None:
    def borrowed(offset: int) -> Any:
        raw = np.zeros(4 * 256 + 128, np.uint8)
        start = -raw.ctypes.data % 64 + offset
        return mi.UInt32(raw[start : start + 4 * 256].view(np.uint32))

    aligned, odd = (kernels(lambda offset=offset: dr.eval(borrowed(offset) * 7 + 3)) for offset in (0, 4))
    assert aligned != odd


DENORMAL = """
import drjit as dr, numpy as np
from gonio.bridge import engine, faults
from gonio.bridge.faults.denormal_numbers import denormals_rounded
mi = engine.load()

def product(count=1 << 20):
    small, smaller = dr.opaque(mi.Float, 1e-30, count), dr.opaque(mi.Float, 1e-10)
    return int(np.array(dr.reinterpret_array(mi.UInt32, small * smaller)).max())

dr.set_thread_count(2)
assert product() == 0
dr.set_thread_count(1)
assert product() > 0
with denormals_rounded():
    assert product() == 0
assert product() > 0
"""


@pytest.mark.slow
def test_denormal_numbers_depend_on_the_number_of_threads() -> None:
    """In a process of its own: what other tests load may change how the main thread rounds."""
    done = subprocess.run([sys.executable, "-c", DENORMAL], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def ended(program: str, seconds: float) -> int | None:
    """The exit code of a Python program with Mitsuba as `mi`; None if it does not end in time."""
    text = f"from gonio.bridge import engine\nmi = engine.load()\n{program}"
    try:
        return subprocess.run([sys.executable, "-c", text], capture_output=True, timeout=seconds).returncode
    except subprocess.TimeoutExpired:
        return None


@pytest.mark.slow
def test_asking_for_a_missing_emissive_texture_ends_the_process() -> None:
    assert ended("mi.Properties('x').get_emissive_texture('radiance')", 60) == -signal.SIGSEGV


@pytest.mark.slow
def test_an_exr_picture_is_never_read_by_one_thread(tmp_path: Path) -> None:
    file = tmp_path / "a.exr"
    mi.Bitmap(np.zeros((4, 4, 3), np.float32)).write(str(file))
    read = f"import drjit as dr\ndr.set_thread_count(%d)\nmi.Bitmap({str(file)!r})"
    assert ended(read % 2, 60) == 0
    assert ended(read % 1, 20) is None


MERGED = """\
mesh = lambda k: {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([k % 3, 0, 0])}
kinds = {f"m{k}": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.1 * k}} for k in range(9)}
parts = {f"s{k}": {**mesh(k), "bsdf": {"type": "ref", "id": f"m{k // 3}"}} for k in range(27)}
scene = mi.load_dict({"type": "scene", **kinds, "all": {"type": "merge", **parts}})
print([str(shape.bsdf().id()) for shape in scene.shapes()])
"""


@pytest.mark.slow
def test_merged_meshes_come_in_any_order() -> None:
    program = f"from gonio.bridge import engine\nmi = engine.load()\n{MERGED}"
    orders = {subprocess.check_output([sys.executable, "-c", program]) for _ in range(8)}
    assert len(orders) > 1


def test_no_method_returns_the_frame_of_a_bump_map() -> None:
    bumps = mi.load_dict({"type": "bumpmap", "texture": {"type": "checkerboard"}, "bsdf": {"type": "diffuse"}})
    assert [name for name in dir(bumps) if "frame" in name or "normal" in name] == []


NARROWED = """
import gonio as go, numpy as np
from gonio.bridge.faults import wide_vectors
w = np.random.default_rng(1).normal(size=(2, 1000, 3))
w[..., 2] = abs(w[..., 2])
w /= np.linalg.norm(w, axis=-1, keepdims=True)
wide = wide_vectors.lanes()
with wide_vectors.narrow():
    assert wide_vectors.lanes() == min(wide, wide_vectors.LANES), wide_vectors.lanes()
    narrow = go.Conductor(alpha=0.3).eval(*w, precision="float64")
assert wide_vectors.lanes() == wide
assert np.allclose(narrow, go.Conductor(alpha=0.3).eval(*w, precision="float64"), rtol=1e-12)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the names of libdrjit-core's functions are those on Linux")
def test_no_function_of_python_sets_the_number_of_lanes() -> None:
    assert not [name for name in (*dir(dr), *dir(dr.detail)) if "vector_width" in name or "set_target" in name]
    subprocess.run([sys.executable, "-c", NARROWED], check=True, timeout=60)
