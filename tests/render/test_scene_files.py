"""Meshes and images that a scene names: read exactly, or refused with one error; never a crash."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from gonio import scene
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.scene import meshes, textures
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

QUAD_OBJ = """# a unit square, facing +z
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl ignored
f 1/1/1 2/2/1 3/3/1 4/4/1
"""

PLY_HEADER = """ply
format {order} 1.0
comment made by hand
element vertex 4
property float x
property float y
property float z
property float s
property float t
element face 1
property list uchar int vertex_indices
end_header
"""
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def quad_ply(order: str, faces: bytes | None = None) -> bytes:
    header = PLY_HEADER.format(order=order).encode()
    if order == "ascii":
        rows = "".join(f"{x} {y} {z} {x} {y}\n" for x, y, z in CORNERS)
        return header + rows.encode() + b"4 0 1 2 3\n"
    sign = "<" if "little" in order else ">"
    rows = b"".join(struct.pack(sign + "5f", x, y, z, x, y) for x, y, z in CORNERS)
    return header + rows + (faces if faces is not None else struct.pack(sign + "B4i", 4, 0, 1, 2, 3))


def test_only_a_reflection_reverses_the_faces() -> None:
    corner = meshes.Triangles(np.eye(3), np.array([[0, 1, 2]]))
    for scale, faces in (((0.5, 0.5, 0.5), [0, 1, 2]), ((2.0, 2.0, 2.0), [0, 1, 2]), ((-0.5, 1.0, 1.0), [2, 1, 0])):
        assert corner.transformed(np.diag([*scale, 1.0])).faces.tolist() == [faces]


def read(folder: Path, name: str, content: str | bytes) -> meshes.Triangles:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return meshes.read_mesh(path, "scene.json#/scene/shapes/0/file")


@pytest.mark.parametrize(
    "name, content",
    [
        ("a.obj", QUAD_OBJ),
        ("a.obj", QUAD_OBJ.replace("\n", "\r\n")),
        ("a.obj", QUAD_OBJ.replace("f 1/1/1 2/2/1 3/3/1 4/4/1", "f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1")),
        ("a.ply", quad_ply("ascii")),
        ("a.ply", quad_ply("binary_little_endian")),
        ("a.ply", quad_ply("binary_big_endian")),
    ],
)
def test_square_reads_from_every_format(tmp_path, name, content):
    mesh = read(tmp_path, name, content)
    corners = mesh.vertices[mesh.faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0) / 2
    assert np.allclose(area, [0, 0, 1])
    assert mesh.uv is not None and np.allclose(mesh.uv, mesh.vertices[:, :2])


def test_binary_triangles_read_by_the_short_way(tmp_path):
    data = quad_ply("binary_little_endian", struct.pack("<B3i", 3, 0, 1, 2))
    assert read(tmp_path, "a.ply", data).faces.tolist() == [[0, 1, 2]]


def test_obj_without_normals_is_faceted_and_partial_ones_do_not_count(tmp_path):
    assert read(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").normals is None
    mixed = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 3\n"
    assert read(tmp_path, "a.obj", mixed).normals is None


def test_zero_normals_are_taken_from_the_faces(tmp_path):
    mesh = read(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n")
    assert mesh.normals is not None and np.allclose(mesh.normals, [0, 0, 1])


@pytest.mark.parametrize(
    "name, content, what",
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj:4: the face names vertex 4, 3 are given"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "names vertex 0"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", "names vertex -4"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", "names texture coordinate 1, 0 are given"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "'x' is not a face vertex"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "a face of 2 vertices"),
        ("a.obj", "v 0 0\nf 1 1 1\n", "3 numbers expected"),
        ("a.obj", "v 0 0 abc\n", "not a number"),
        ("a.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("a.obj", "v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("a.obj", "", "no faces"),
        ("a.obj", b"\x00\xff\xfe" * 100, "no faces"),
        ("a.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "degenerate"),
        ("a.ply", b"solid\n", "no PLY header"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n1\n",
            "'vertex' entries",
        ),
        (
            "a.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999\nproperty float x\nend_header\n1\n",
            "'vertex'",
        ),
        ("a.ply", quad_ply("binary_little_endian", struct.pack("<B4i", 4, 0, 1, 2, 7)), "names vertex 7"),
        ("a.ply", quad_ply("binary_little_endian", struct.pack("<B4i", 4, 0, 1, 2, -1)), "names vertex -1"),
        ("a.ply", quad_ply("binary_little_endian", struct.pack("<B2i", 200, 0, 1)), "'face' entries"),
        ("a.ply", quad_ply("ascii").replace(b"4 0 1 2 3", b"4 0 1"), "'face' entries"),
        ("a.ply", quad_ply("ascii").replace(b"float x", b"quad x"), "unknown property"),
        ("a.stl", b"solid\n", "not a known kind of mesh"),
    ],
    ids=range(23),
)
def test_bad_mesh_is_one_error(tmp_path, name, content, what):
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, content)
    assert what in caught.value.what and caught.value.hint
    assert caught.value.where == "scene.json#/scene/shapes/0/file"


@settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data(), st.sampled_from(["a.obj", "a.ply", "b.ply"]))
def test_damaged_mesh_reads_or_is_refused_but_nothing_else(tmp_path, data, name):
    content = {"a.obj": QUAD_OBJ.encode(), "a.ply": quad_ply("ascii"), "b.ply": quad_ply("binary_big_endian")}[name]
    damaged = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    damaged = damaged[: data.draw(st.integers(1, len(damaged)))]
    try:
        mesh = read(tmp_path, name, bytes(damaged))
    except InputError:
        return
    assert np.isfinite(mesh.vertices).all() and mesh.faces.max() < len(mesh.vertices)


def test_mesh_in_a_scene_is_placed_and_lit(tmp_path):
    mi = engine.load()
    (tmp_path / "quad.obj").write_text(QUAD_OBJ)
    shape = {"type": "triangle", "file": "quad.obj", "transform": {"translate": [0, 0, 5], "scale": [2, 2, -1]}}
    data = {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 1},
        "camera": {
            "transform": {"position": [0, 1, 4], "up": [0, 1, 0], "lookAt": [0, 0, 0]},
            "verticalFov": 45,
            "film": {"size": [6, 4]},
        },
        "integrator": {"type": "direct"},
        "scene": {"shapes": [], "lights": [{"type": "areaLight", "energy": 3, "shape": shape}]},
    }
    (tmp_path / "scene.json").write_text(json.dumps(data))
    built = scene.build(scene.read(tmp_path), mi)
    si = built.ray_intersect(mi.Ray3f(mi.Point3f(0.5, 1.5, 0), mi.Vector3f(0, 0, 1)))
    assert np.allclose(np.array(si.uv)[:, 0], [0.25, 0.75], atol=1e-5)
    assert np.allclose(np.array(si.sh_frame.n)[:, 0], [0, 0, -1])  # mirrored in z, its front with it
    assert np.allclose(np.array(si.n)[:, 0], [0, 0, -1])
    assert np.allclose(np.array(si.emitter(built).eval(si)), 3)


def ply(vertex: str, body: str) -> str:
    faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    return f"ply\nformat ascii 1.0\nelement vertex 3\n{vertex}{faces}{body}"


XYZ = "property float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("vertex", "body", "reason"),
    [
        (XYZ + "property float x\n", "0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n", "'x' is given twice"),
        (XYZ, f"0 0 0\n1 0 0\n0 1 0\n3 0 1 {10**30}\n", "a vertex index that is out of range"),
        (XYZ.replace("float x", "list uchar int x"), "1 0 0 0\n2 0 1 0 0\n1 1 0 0\n3 0 1 2\n", "no vertices with x"),
    ],
)
def test_a_ply_that_contradicts_itself_is_one_clear_error(tmp_path, vertex, body, reason):
    (tmp_path / "a.ply").write_text(ply(vertex, body))
    with pytest.raises(InputError, match=reason):
        meshes.read_mesh(tmp_path / "a.ply", "here")


# ---------------------------------------------------------------------- images


def images(mi, folder: Path) -> dict[str, bytes]:
    """One small image of each kind, as bytes."""
    rng = np.random.default_rng(3)
    found = {}
    for suffix in ("png", "jpg"):
        mi.Bitmap(rng.integers(0, 255, (9, 7, 3)).astype(np.uint8)).write(str(folder / f"a.{suffix}"))
        found[suffix] = (folder / f"a.{suffix}").read_bytes()
    for suffix in ("exr", "hdr"):
        mi.Bitmap(rng.random((9, 7, 3)).astype(np.float32)).write(str(folder / f"a.{suffix}"))
        found[suffix] = (folder / f"a.{suffix}").read_bytes()
    return found


def test_every_kind_of_image_reads_whatever_its_suffix(tmp_path):
    mi = engine.load()
    for suffix, content in images(mi, tmp_path).items():
        (tmp_path / "renamed.dat").write_bytes(content)
        for name in (f"a.{suffix}", "renamed.dat"):
            values = textures.load_image(tmp_path / name, "here")
            assert values.shape == (9, 7, 3) and values.dtype == np.float32 and 0 <= values.min() <= values.max() <= 1


def test_grey_and_alpha_images(tmp_path):
    mi = engine.load()
    for channels, expected in ((1, 1), (2, 1), (3, 3), (4, 3)):
        pixels = np.full((2, 3, channels), 51, np.uint8)
        kind = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[channels]
        mi.Bitmap(pixels, getattr(mi.Bitmap.PixelFormat, kind)).write(str(tmp_path / "a.png"))
        values = textures.load_image(tmp_path / "a.png", "here")
        assert values.shape == (2, 3, expected) and np.allclose(values, 0.2)


@pytest.mark.parametrize("content", [b"x", b"hello world" * 10, b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"#?RADIANCE\n"])
def test_bytes_that_are_no_image(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(InputError, match=r"not a readable image|cannot be decoded"):
        textures.load_image(tmp_path / "a.png", "here")


def test_image_that_claims_more_pixels_than_it_can_hold(tmp_path):
    mi = engine.load()
    content = bytearray(images(mi, tmp_path)["png"])
    content[16:24] = struct.pack(">II", 60000, 60000)
    (tmp_path / "bomb.png").write_bytes(content)
    with pytest.raises(InputError, match="claims 60000 x 60000 pixels"):
        textures.load_image(tmp_path / "bomb.png", "here")


def test_image_with_nan(tmp_path):
    mi = engine.load()
    pixels = np.ones((3, 3, 3), np.float32)
    pixels[1, 2, 0] = np.nan
    mi.Bitmap(pixels).write(str(tmp_path / "a.exr"))
    with pytest.raises(InputError, match="not finite at row 1, column 2"):
        textures.load_image(tmp_path / "a.exr", "here")


@pytest.mark.parametrize("suffix", ["png", "jpg", "exr", "hdr"])
def test_damaged_image_reads_or_is_refused_but_nothing_else(tmp_path, suffix):
    mi = engine.load()
    content = images(mi, tmp_path)[suffix]
    rng = np.random.default_rng(5)
    for _ in range(60):
        damaged = bytearray(content)
        for _ in range(rng.integers(1, 4)):
            damaged[rng.integers(len(damaged))] = rng.integers(256)
        if rng.random() < 0.5:
            damaged = damaged[: rng.integers(1, len(damaged))]
        (tmp_path / "damaged").write_bytes(damaged)
        try:
            values = textures.load_image(tmp_path / "damaged", "here")
        except InputError as error:
            assert error.hint
            continue
        assert np.isfinite(values).all()
