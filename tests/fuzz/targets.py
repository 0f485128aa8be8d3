"""The readers: of each its seeds and how to call it. A further one is one more function here.

@target("merl", seeds=lambda: [small_merl()], tokens=[b"MERL"])
def merl(data: bytes, folder: Path) -> object:
    return measured.read(saved(folder / "a.binary", data))
"""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import io
import json
import os
import shlex
import struct
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

from .mutation import png_repaired

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"


@dataclass(frozen=True)
class Target:
    """A reader.

    seeds   inputs that it takes, from which others are made
    read    called with an input and an empty folder; it may raise GonioError
    tokens  what its language is made of, put in now and then
    repair  what makes a spoilt input pass for one again, such as a checksum
    """

    name: str
    seeds: Callable[[], Sequence[bytes]]
    read: Callable[[bytes, Path], object]
    tokens: Sequence[bytes] = ()
    repair: Callable[[bytes], bytes] | None = None


TARGETS: dict[str, Target] = {}


def target(
    name: str,
    seeds: Callable[[], Iterable[bytes]],
    tokens: Sequence[bytes] = (),
    repair: Callable[[bytes], bytes] | None = None,
) -> Callable[[Callable[[bytes, Path], object]], Callable[[bytes, Path], object]]:
    """Declare a reader: the function is called with an input and an empty folder."""

    def declare(read: Callable[[bytes, Path], object]) -> Callable[[bytes, Path], object]:
        TARGETS[name] = Target(name, functools.cache(lambda: tuple(seeds())), read, tokens, repair)
        return read

    return declare


def saved(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


# ---------------------------------------------------------------------- scenes


def _scene(shape: dict[str, object], **more: object) -> bytes:
    scene = {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 2},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 1, 4], "up": [0, 1, 0], "lookAt": [0, 0, 0]},
            "verticalFov": 45,
            "film": {"size": [6, 4]},
        },
        "integrator": {"type": "path", "maxDepth": 3},
        "scene": {
            "shapes": [shape],
            "lights": [
                {"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]},
                {"type": "environmentLight", "radiance": [0.3, 0.3, 0.3]},
            ],
        },
        **more,
    }
    return json.dumps(scene).encode()


def scenes() -> list[bytes]:
    phong = {"type": "phong", "kd": [0.2, 0.2, 0.2], "ks": [0.5, 0.5, 0.5], "p": 8}
    gold = {"type": "gonio-conductor", "preset": "Au", "alpha": [0.1, 0.4]}
    mixed = {"type": "gonio-mix", "a": {"type": "gonio-lambert"}, "b": gold, "weight": 0.3}
    turned = {"rotate": {"axis": [0, 1, 0], "angle": 30}, "scale": [1, 2, 1], "translate": [0, 1, 0]}
    return [
        _scene({"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": phong}),
        _scene({"type": "cube", "material": gold}),
        _scene({"type": "disk", "radius": 1, "material": mixed}),
        _scene({"type": "cone", "radius": 1, "height": 2, "transform": turned, "material": {"type": "matte"}}),
        (EXAMPLES / "phong" / "scene.json").read_bytes(),
    ]


@target("scene-json", scenes, [b'"type"', b'"material"', b"null", b"[[", b"1e400", b"gonio-mix"])
def scene_json(data: bytes, folder: Path) -> object:
    from gonio import scene
    from gonio.bridge import engine

    return scene.build(scene.read(saved(folder / "scene.json", data)), engine.load("cpu"))


def calibrations() -> list[bytes]:
    ball = {"radius": 50, "center": [0, 0, 500]}
    lamp = {"position": [100, 0, 100], "intensity": [1.6e5, 1.6e5, 1.6e5]}
    shot = {"file": "a.npz", "seconds": 0.1, "light": "a"}
    raw = {"camera": {"size": [4, 4], "focal": 20}, "ball": ball, "lights": {"a": lamp}, "photographs": [shot]}
    flat = {"base": [-9, -9, 400], "edge0": [18, 0, 0], "edge1": [0, 18, 0]}
    series = {"exposures": [{"file": "a.npz", "seconds": 0.1}], "light": "a", "sample": "flat"}
    more = {
        "flat": flat,
        "photographs": [series],
        "response": [[0, 0], [0.5, 0.2], [1, 1]],
        "uncertainty": {"light": 1},
    }
    return [json.dumps(raw).encode(), json.dumps(raw | more).encode()]


@target("calibration", calibrations, [b'"center"', b"null", b"[[", b"1e400", b'"outline"', b"-0.0"])
def calibration_json(data: bytes, folder: Path) -> object:
    import numpy as np
    from gonio.instruments.capture.run import capture
    from gonio.pictures import images

    if not (folder / "a.npz").exists():
        images.write(folder / "a.npz", np.full((4, 4, 3), 0.1, np.float32))
    saved(folder / "calibration.json", data)
    return capture(folder)


XML = b"""<scene version="3.0.0"><default name="spp" value="2"/>
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><float name="fov" value="45"/>
<transform name="to_world"><lookat origin="0,1,4" target="0,0,0" up="0,1,0"/></transform>
<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
<film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="1,1,1"/></emitter>
%s</scene>"""
SHAPES = (
    b'<shape type="sphere"><point name="center" x="0" y="0" z="0"/><bsdf type="gonio_conductor" id="b">'
    b'<string name="preset" value="Au"/><float name="alpha" value="0.2"/></bsdf></shape>',
    b'<shape type="rectangle"><bsdf type="roughplastic"><spectrum name="diffuse_reflectance" value="400:.1,700:.5"/>'
    b'</bsdf><emitter type="gonio_area"><rgb name="radiance" value="1,2,3"/></emitter></shape>',
    b'<shape type="cube"><bsdf type="twosided"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/>'
    b"</bsdf></bsdf></shape>",
)


def _load_xml(path: Path) -> object:
    from gonio.bridge import adapter, engine
    from gonio.scene import mitsuba_scene
    from gonio.transport.lights import lights

    mi = engine.load("cpu")
    mi.set_log_level(mi.LogLevel.Error)
    adapter.register(mi)
    lights.register(mi)
    return mitsuba_scene.load(mi, path, mitsuba_scene.read(path, {}))


@target("scene-xml", lambda: [XML % shape for shape in SHAPES], [b"<!--", b"<bsdf>", b'"$spp"', b"&amp;", b"<include"])
def scene_xml(data: bytes, folder: Path) -> object:
    return _load_xml(saved(folder / "scene.xml", data))


# ---------------------------------------------------------------------- meshes

OBJ = b"""# square
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1
f 1/1/1 2/2/1 3/3/1 4/1/1\nf -4 -3 -2\n"""
PLY = b"""ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z
property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\nelement face 2
property list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1
3 0 1 2\n4 0 1 2 3\n"""


def plies() -> list[bytes]:
    header = b"ply\nformat %s 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += b"element face 1\nproperty list uchar %s vertex_indices\nend_header\n"
    found = [PLY]
    for name, order in ((b"binary_little_endian", "<"), (b"binary_big_endian", ">")):
        corners = struct.pack(order + "9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
        found += [
            header % (name, b"int") + corners + struct.pack(order + "B3i", 3, 0, 1, 2),
            header % (name, b"short") + corners + struct.pack(order + "B4h", 4, 0, 1, 2, 0),
        ]
    return found


@target("obj", lambda: [OBJ], [b"f 1 2 3\n", b"v 1 2\n", b"//", b"-0"])
def obj(data: bytes, folder: Path) -> object:
    from gonio.scene import meshes

    return meshes.read_mesh(saved(folder / "a.obj", data), "here")


@target("ply", plies, [b"property float x\n", b"property list uchar int i\n", b"element face 9\n", b"double"])
def ply(data: bytes, folder: Path) -> object:
    from gonio.scene import meshes

    return meshes.read_mesh(saved(folder / "a.ply", data), "here")


# Files that a Mitsuba scene names: Mitsuba itself reads them
NAMED = XML % b'<shape type="%s"><string name="filename" value="a.%s"/></shape>'


@target("xml-obj", lambda: [OBJ], [b"f 1 2 3\n", b"f 1/2/3 4/5/6 7/8/9\n"])
def xml_obj(data: bytes, folder: Path) -> object:
    saved(folder / "a.obj", data)
    return _load_xml(saved(folder / "scene.xml", NAMED % (b"obj", b"obj")))


@target("xml-ply", plies, [b"property float x\n", b"property list uchar int i\n", b"element face 9\n", b"double"])
def xml_ply(data: bytes, folder: Path) -> object:
    saved(folder / "a.ply", data)
    return _load_xml(saved(folder / "scene.xml", NAMED % (b"ply", b"ply")))


def _serialized() -> list[bytes]:
    """Mitsuba's own mesh format: a head, zlib of flags, name, counts and arrays, and where each mesh begins."""
    found = []
    for flags, real in ((0x1000, "<f4"), (0x2000 | 0x1 | 0x2, "<f8")):
        vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], real)
        arrays = [vertices, *([np.tile([0, 0, 1], (3, 1)).astype(real), vertices[:, :2]] if flags & 1 else [])]
        body = struct.pack("<I", flags) + b"a\0" + struct.pack("<QQ", 3, 1)
        body += b"".join(array.tobytes() for array in arrays) + np.arange(3, dtype="<u4").tobytes()
        mesh = struct.pack("<HH", 0x041C, 4) + zlib.compress(body)
        found.append(mesh + struct.pack("<QI", 0, 1))
    return found


@target("xml-serialized", _serialized, [struct.pack("<HH", 0x041C, 3), struct.pack("<QI", 0, 1), b"\xff" * 8])
def xml_serialized(data: bytes, folder: Path) -> object:
    saved(folder / "a.serialized", data)
    return _load_xml(saved(folder / "scene.xml", NAMED % (b"serialized", b"serialized")))


SPECTRUM = XML % (
    b'<shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="a.spd"/></bsdf></shape>'
)


@target("xml-spd", lambda: [b"# green\n400 .1\n500 .2\n700 .4\n"], [b"1e999", b"nan", b" ", b"\n", b"-1"])
def xml_spd(data: bytes, folder: Path) -> object:
    saved(folder / "a.spd", data)
    return _load_xml(saved(folder / "scene.xml", SPECTRUM))


VOLUME = XML % (
    b'<medium type="heterogeneous" name="m"><volume type="gridvolume" name="albedo">'
    b'<string name="filename" value="a.vol"/></volume></medium>'
)


def _volumes() -> list[bytes]:
    head = struct.pack("<3sBiiiii6f", b"VOL", 3, 1, 3, 2, 2, 1, 0, 0, 0, 1, 1, 1)
    return [head + np.full(12, 0.5, "<f4").tobytes()]


@target("xml-vol", _volumes, [b"VOL\3", struct.pack("<i", 1 << 30), struct.pack("<i", -1)])
def xml_vol(data: bytes, folder: Path) -> object:
    saved(folder / "a.vol", data)
    return _load_xml(saved(folder / "scene.xml", VOLUME))


# ---------------------------------------------------------------------- pictures


def _bmp(values: np.ndarray) -> bytes:
    height, width, channels = values.shape
    table = bytes(k for grey in range(256) for k in (grey, grey, grey, 0)) if channels == 1 else b""
    start = 54 + len(table)
    head = struct.pack("<2sIHHI", b"BM", start + values.size, 0, 0, start)
    sizes = struct.pack("<IiiHHIIiiII", 40, width, height, 1, 8 * channels, 0, values.size, 0, 0, 0, 0)
    return head + sizes + table + values[::-1].tobytes()


def _tga(values: np.ndarray) -> bytes:
    height, width, channels = values.shape
    kind = 3 if channels == 1 else 2
    return struct.pack("<BBBHHBHHHHBB", 0, 0, kind, 0, 0, 0, 0, 0, width, height, 8 * channels, 32) + values.tobytes()


CHANNELS = {"hdr": (3,), "ppm": (3,), "pfm": (1, 3), "jpg": (1, 3), "bmp": (1, 3)}  # that a format has


@functools.cache
def _pictures(*kinds: str) -> tuple[bytes, ...]:
    """Small pictures of these formats, of several depths and channels."""
    import tempfile

    from gonio.bridge import engine
    from gonio.bridge.faults.exr_threads import file_threads
    from gonio.pictures import images

    mi, rng, found = engine.load("cpu"), np.random.default_rng(3), []
    with tempfile.TemporaryDirectory() as name, file_threads():
        path = Path(name)
        for kind in kinds:
            for channels, mode in ((3, "RGB"), (1, "Y"), (4, "RGBA")):
                if channels not in {"hdr": (3,), "ppm": (3,), "pfm": (1, 3), "jpg": (1, 3), "bmp": (1, 3)}.get(
                    kind, (1, 3, 4)
                ):
                    continue
                whole = kind in ("png", "jpg", "bmp", "tga", "ppm")
                pixels = rng.random((9, 16, channels)).astype(np.float32)
                pixels[3:5] = 0.5
                values = (pixels * 255).astype(np.uint8) if whole else pixels
                if kind in ("bmp", "tga"):  # which Mitsuba reads and does not write
                    found.append((_bmp if kind == "bmp" else _tga)(values))
                    continue
                mi.Bitmap(values, getattr(mi.Bitmap.PixelFormat, mode)).write(str(path / f"a.{kind}"))
                found.append((path / f"a.{kind}").read_bytes())
            if kind in ("exr", "png", "hdr"):
                pixels = rng.random((5, 9, 3)).astype(np.float32)
                images.write(path / f"b.{kind}", pixels, {"scene": "é", "spp": 4, "time": 1.5})
                found.append((path / f"b.{kind}").read_bytes())
            if kind == "exr":
                mi.Bitmap(rng.random((40, 40, 3)).astype(np.float16)).write(str(path / "c.exr"))
                found.append((path / "c.exr").read_bytes())
    return tuple(found)


def _picture(kind: str, tokens: Sequence[bytes] = (), repair: Callable[[bytes], bytes] | None = None) -> None:
    @target(kind, lambda: _pictures(kind), tokens, repair)
    def read(data: bytes, folder: Path) -> object:
        from gonio.errors import GonioError
        from gonio.pictures import images
        from gonio.scene import textures

        path = saved(folder / f"a.{kind}", data)
        with contextlib.suppress(GonioError):
            textures.load_image(path, "here", srgb=True)
        return images.read(path) if path.suffix in images.SUFFIXES else None


_picture("png", [b"tEXt", b"iTXtgonio.spp\0\0\0\0\0", b"tRNS", b"PLTE", b"iCCP", b"gAMA"], png_repaired)
_picture("jpg", [b"\xff\xd8", b"\xff\xc0", b"\xff\xc4", b"\xff\xdb", b"\xff\xda", b"\xff\xe1"])
_picture("exr", [b"dataWindow\0box2i\0", b"channels\0chlist\0", b"tiles\0tiledesc\0", b"string\0", b"compression\0"])
_picture("hdr", [b"\n\n", b"-Y 9 +X 9\n", b"\x02\x02\0\x11", b"FORMAT=32-bit_rle_rgbe\n", b"\x81", b"\x80", b"\xff"])

TEXTURE = XML % (
    b'<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
    b'<string name="filename" value="a.%s"/></texture></bsdf></shape>'
)


def _xml_picture(kind: str, tokens: Sequence[bytes] = (), repair: Callable[[bytes], bytes] | None = None) -> None:
    @target(f"xml-{kind}", lambda: _pictures(kind), tokens, repair)
    def read(data: bytes, folder: Path) -> object:
        saved(folder / f"a.{kind}", data)
        return _load_xml(saved(folder / "scene.xml", TEXTURE % kind.encode()))


for _kind in ("exr", "hdr", "jpg", "bmp", "tga", "pfm", "ppm"):
    _xml_picture(_kind)
_xml_picture("png", (), png_repaired)


@functools.cache
def _archives() -> tuple[bytes, ...]:
    found = []
    for save in (np.savez, np.savez_compressed):
        stream = io.BytesIO()
        save(stream, radiance=np.ones((4, 5, 3), np.float32), metadata=np.array('{"spp": 4}'))
        found.append(stream.getvalue())
    return tuple(found)


@target("npz", _archives, [b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06", b"'|O'", b"(4, 5, 3)", b"(1000000000,)"])
def npz(data: bytes, folder: Path) -> object:
    from gonio.pictures import images

    return images.read(saved(folder / "a.npz", data))


# ---------------------------------------------------------------------- measured materials

SMALL = (5, 4)  # cells of MERL files here: those of the format, 35 MB each, would be read at three a second


@contextlib.contextmanager
def _small_merl() -> Iterator[None]:
    from gonio.measure.formats import merl, networks

    kept = merl.CELLS, networks.CELLS
    merl.CELLS, networks.CELLS = SMALL, (*SMALL, 6)
    try:
        yield
    finally:
        merl.CELLS, networks.CELLS = kept


# Of each axis of an array, how many entries a seed keeps: files of the usual size hold a million numbers.
KEPT = {
    "rgl": {"theta_i": (3,), "ndf": (2, 4), "sigma": (2, 4), "vndf": (1, 3, 5, 4), "luminance": (1, 3, 4, 4),
            "values": (1, 3, 3, 4, 4)},
    "zemax": {"theta_i": (3,), "azimuth": (5,), "radial": (6,), "values": (3, 5, 6, 3)},
    "cornell": {"directions": (12, 4), "values": (12, 3)},
}  # fmt: skip


@functools.cache
def _measured(name: str) -> tuple[bytes, ...]:
    """Small files of a format, of several kinds of tables where it has them."""
    import gonio as go
    from gonio.measure.formats.base import Format
    from gonio.measure.tables import angles, half_difference

    one, paint = Format.family.get(name), go.Conductor.preset("Cu", alpha=0.4)

    def value(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
        return np.asarray(paint.eval(wo, wi))

    def cut(kind: str, source: object) -> object:
        table = Format.family.get(kind).resampled(source)
        kept = {name: tuple(slice(size) for size in sides) for name, sides in KEPT[kind].items()}
        return type(table).from_arrays({name: a[kept.get(name, ())] for name, a in table.arrays().items()})

    grid, half = angles.sampled(value, 4, 5), half_difference.sampled(value, (4, 3, 6))
    tables = [cut(name, grid)] if name in KEPT else [grid]
    if name == "gonio":
        tables += [half, *(cut(kind, grid) for kind in KEPT)]
    with _small_merl():
        return tuple(one.write(one.resampled(table)) for table in tables)


def _measurement(name: str, tokens: Sequence[bytes] = ()) -> None:
    @target(name, lambda: _measured(name), tokens)
    def read(data: bytes, folder: Path) -> object:
        from gonio.measure import read
        from gonio.measure.formats.base import Format

        path = saved(folder / f"a{Format.family.get(name).suffixes[0]}", data)
        with _small_merl():
            table = read(path)
        wo, wi = np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]]), np.array([[0.0, -0.28, 0.96], [0.8, 0.0, 0.6]])
        scattered = table.name == "samples" and zlib.crc32(data) % 8  # these fit a surface first, which takes .3 s
        return None if scattered else table.rgb(wo, wi), table.flaws, table.range, table.reciprocal


_measurement(
    "merl", [struct.pack("<3i", *SMALL, 180), struct.pack("<3i", *SMALL, 360), struct.pack("<d", float("nan"))]
)
_measurement("rgl", [b"tensor_file\0", b"\x0a", struct.pack("<Q", 1 << 60), b"theta_i", b"vndf", b"luminance"])
_measurement("cornell", [b"1e999", b"nan", b"-1", b" "])
_measurement("astm", [b"VARS theta_i,phi_i,theta_s,phi_s,BRDF\n", b"1e999", b"nan", b",", b"\n"])
_measurement("zemax", [b"AngleOfIncidence", b"DataBegin", b"DataEnd", b"TIS ", b"1e999", b"nan", b"180"])
_measurement("gonio", [b"manifest", b"values", b"'|O'", b"(1000000000,)", b"PK\x01\x02"])


@functools.cache
def _networks() -> tuple[bytes, ...]:
    from gonio.measure.formats import networks

    rng, stream = np.random.default_rng(2), io.BytesIO()
    shapes = networks.SHAPES
    np.savez(stream, **{f"a/{key}": rng.normal(0, 0.3, shape).astype(np.float32) for key, shape in shapes.items()})
    return (stream.getvalue(),)


@target("networks", _networks, [b"PK\x01\x02", b"(6, 21)", b"'|O'", b"a/b1"])
def trained(data: bytes, folder: Path) -> object:
    from gonio.measure import read

    with _small_merl():
        return read(f"{saved(folder / 'a.npz', data)}:a").range


# ---------------------------------------------------------------------- tables, notation, messages, options


@functools.cache
def _tables() -> tuple[bytes, ...]:
    import gonio as go

    return (go.bake("ggx", lut=["E"], resolution=4).npz(),)


@target("tables", _tables, [b"manifest", b"seal", b"(4, 4)", b"PK\x01\x02"])
def tables(data: bytes, folder: Path) -> object:
    from gonio.energy.tables import baked

    found = baked.load(saved(folder / "tables.npz", data))
    return baked.title(found.manifest), baked.rows(found.manifest)


@target("notation", lambda: [
    b"conductor", b"conductor(alpha=.3,preset=Au)", b"kulla-conty(base=conductor(alpha=.3,preset=Au))",
    b"mix(a=lambert(albedo=.9,.8,.7),b=phong,weight=.2)", b'{"type": "conductor", "alpha": [0.1, 0.4]}',
    b"two-sided(base=oren-nayar(sigma=.4))", b"alum-bronze", b"chrome:low2012/lowsmooth_E2", b"a.binary",
], [b"(", b")", b"=", b",", b"base=", b"alpha=", b"1e999", b"nan", b"preset=", b".py:X"])  # fmt: skip
def material_notation(data: bytes, folder: Path) -> object:
    from gonio.catalog import notation

    return notation.named(data.decode("utf-8", "surrogateescape"))


def _gltfs() -> list[bytes]:
    import gltf_files as files

    return [files.text(files.document()), files.text(files.meshed()), files.glb(*files.pictured())]


def _glb_repaired(data: bytes) -> bytes:
    import gltf_files

    return gltf_files.glb_repaired(data)


@target("gltf", _gltfs, [
    b"-1", b"1e999", b"NaN", b"null", b"[]", b"{}", b"true", b'"uri"', b'"../a"', b'"http://a"', b'"data:;base64,AA"',
    b'"children":[0]', b'"count":9999999999', b"KHR_materials_", b'"source":0', b'"bufferView":0', b"99999999999999",
], _glb_repaired)  # fmt: skip
def gltf(data: bytes, folder: Path) -> object:
    """Every material, as a text names it and as a scene holds it."""
    from gonio.catalog import notation
    from gonio.catalog.documents import Document
    from gonio.scene.reader import read

    path = saved(folder / ("a.glb" if data[:4] == b"glTF" else "a.gltf"), data)
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in Document.family.get("gltf").materials(path)[:8]:
            found.append(notation.named(f"{path}:{name}"))
            material = {"type": "gltf", "file": path.name, "material": name}
            shape = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}
            read(saved(folder / "scene.json", _scene(shape)))
    return found


MTLX = b"""<?xml version="1.0"?>\n<materialx version="1.39">
<open_pbr_surface name="S" type="surfaceshader"><input name="base_color" type="color3" value="0.1, 0.2, 0.3" />
<input name="specular_roughness" type="float" value="0.25" /></open_pbr_surface>
<standard_surface name="T" type="surfaceshader"><input name="coat" type="float" value=".5" /></standard_surface>
<surfacematerial name="M" type="material"><input name="surfaceshader" type="surfaceshader" nodename="S" />
</surfacematerial></materialx>"""

if importlib.util.find_spec("MaterialX"):

    @target("materialx", lambda: [MTLX], [
        b"<!DOCTYPE m [<!ENTITY x 'y'>]>", b"&x;", b'nodename="T"', b'nodegraph="G"', b'interfacename="a"',
        b'<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="a.mtlx"/>',
        b"1e999", b"nan", b"-1", b'type="integer"', b'value=""',
        b"<nodegraph name='G'>", b'inherit="S"', b'version="9"', b'xpos="1"', b"<!--", b"<![CDATA[",
    ])  # fmt: skip
    def materialx(data: bytes, folder: Path) -> object:
        from gonio.catalog.documents import Document

        document, path = Document.family.get("materialx"), saved(folder / "a.mtlx", data)
        return [document.read(path, name) for name in document.materials(path)]


def messages() -> list[bytes]:
    state = {
        "rows": [{"material": "gold", "choices": {"ndf": "ggx"}, "balls": [{"alpha": 0.1}, {"alpha": [0.1, 0.2]}]}],
        "lights": [
            {"type": "directional", "direction": [0, 1, 0], "irradiance": [1, 1, 1]},
            {"type": "area", "center": [0, 2, 0], "u": [1, 0, 0], "v": [0, 0, 1], "radiance": [1, 1, 1]},
            {"type": "environment", "image": {"key": "a"}, "rotation": 0.5},
        ],
        "camera": {"target": [0, 0, 0], "distance": 4, "azimuth": 0.1, "elevation": 0.2, "fov": 30},
    }
    return [
        json.dumps(message).encode()
        for message in (
            {"type": "scene", "id": 1, "width": 16, "height": 16, "state": state, "spp": 4},
            {"type": "ack", "frame": 3},
            {"type": "upload", "key": "a", "width": 2, "height": 2},
            {"type": "choice", "id": 2, "material": "gold", "choices": {"ndf": "beckmann", "flag": True}},
        )
    ]


@target("message", messages, [b'"type":', b"1e400", b"{{", b"\\ud800"])
def message(data: bytes, folder: Path) -> object:
    from gonio.errors import InputError
    from gonio.viewer import messages as protocol

    try:
        found = protocol.parse(data.decode("utf-8", "replace"))
    except InputError as error:
        return protocol.failure(error).encode()  # it is sent
    if isinstance(found, protocol.Upload):
        return protocol.environment(found, np.arange(16, dtype="<f2").tobytes())
    return found


@target("link", lambda: [b"token=abc|127.0.0.1:80|http://127.0.0.1:80", b"token=%61bc&token=x|[::1]:80|null"], [
    b"%", b"%00", b"&", b"token=", b"[", b"]", b"@", b"xn--", b"localhost",
])  # fmt: skip
def link(data: bytes, folder: Path) -> object:
    """The address of the page, and the headers by which the server tells its own page from a stranger's."""
    from gonio.viewer.guards import AccessControl
    from starlette.datastructures import Headers

    query, _, rest = data.partition(b"|")
    host, _, origin = rest.partition(b"|")
    headers = Headers(raw=[(b"host", host), (b"origin", origin)])
    return AccessControl("127.0.0.1", "abc").refusal(headers, query, needs_origin=False)


@target("options", lambda: [
    b"render nowhere --spp 4 --size 640x480 --seed 3 --timeout 1.5 --exposure -1 -o a.png",
    b"study nowhere --vary shapes.0.material.alpha=0.1,0.2 --spp 2",
    b"emit lambert --lang glsl --param albedo=.5", b"compare a.exr b.exr --metric flip --tolerance .1",
    b"convert a.exr -o b.png --exposure auto", b"models conductor --json", b"schema scene", b"verify nothing --quick",
], [b"--", b"-o", b"--size", b"--param", b"=", b"''", b"1e999", b"nan", b"auto"])  # fmt: skip
def options(data: bytes, folder: Path) -> object:
    """The command line, in an empty folder; of verbs that compute or serve, only what names nothing to work on."""
    try:
        words = shlex.split(data.decode("utf-8", "surrogateescape").replace("\0", ""))
    except ValueError:
        return None
    if not words or words[0] not in ("render", "study", "emit", "compare", "convert", "models", "schema", "verify"):
        return None
    named = {"verify": "nothing", "render": "nowhere", "study": "nowhere"}.get(words[0])
    if named is not None and named not in words:
        return None
    os.chdir(folder)
    return command_line(words)


def command_line(words: list[str]) -> int:
    """The exit code of a command; what it prints is dropped, and a traceback is a find."""
    from gonio import scene
    from gonio.cli import app

    with (
        mock.patch.dict(os.environ, {"GONIO_DEBUG": "1"}),
        mock.patch.object(scene, "json_schema", _schema),
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        return app.run(words)


@functools.cache
def _schema() -> dict[str, object]:
    """Made once: it depends on no input and takes more time than all the rest of a command."""
    from gonio.scene.schema import json_schema

    return json_schema()


# ---------------------------------------------------------------------- the harness itself


@target("self-test", lambda: [b"fine", b"divide", b"crash", b"memory"])
def self_test(data: bytes, folder: Path) -> object:
    """A reader that breaks in every way, by which the harness is tested; `make fuzz` leaves it out."""
    import ctypes

    if b"divide" in data:
        return 1 / 0
    if b"crash" in data:
        return ctypes.string_at(0)
    return len(bytearray(300_000_000 + len(data))) if b"memory" in data else None
