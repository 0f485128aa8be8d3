"""More readers: checkpoints whose sums are right, scenes of several files, names of files, and the environment."""

from __future__ import annotations

import contextlib
import functools
import os
import struct
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

from .targets import SHAPES, XML, _load_xml, command_line, saved, scenes, target

# ---------------------------------------------------------------------- checkpoints

_MAGIC = b"gonio kept 1\n"


@functools.cache
def _checkpoints() -> tuple[bytes, ...]:
    """Those of two small renders, whose scene lies beside them."""
    import gonio as go

    found = []
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            Path("scene.json").write_bytes(scenes()[0])
            for options in ({}, {"denoise": True, "seed": 3}):
                go.render("scene.json", spp=2, output="a.exr", checkpoint="a.checkpoint", timeout=60.0, **options)
                found.append(Path("a.checkpoint").read_bytes())
                Path("a.checkpoint").unlink()
        finally:
            os.chdir(before)
    return tuple(found)


def _with_right_sum(data: bytes) -> bytes:
    """The length of the header and the checksum of what follows are made right."""
    start = len(_MAGIC) + 8
    if len(data) < start + 4:
        return data
    end = data.find(b"]]]}", start) + 4
    length = struct.pack("<Q", end - start) if end > 3 else data[len(_MAGIC) : start]
    body = _MAGIC + length + data[start:-4]
    return body + struct.pack("<I", zlib.crc32(body))


@target("checkpoint", _checkpoints, [
    b"null", b"true", b"-1", b"1e400", b"[]", b"{}", b'"../a.exr"', b'"/dev/null"', b"99999999999", b'"uint8"',
    b'"mitsuba"', b'"request"', b"NaN",
], _with_right_sum)  # fmt: skip
def checkpoint(data: bytes, folder: Path) -> object:
    """The request of a checkpoint, its scene, and its sums."""
    from gonio.render import checkpoints
    from gonio.render.prepare import prepare
    from gonio.render.request import Request

    os.chdir(folder)
    saved(folder / "scene.json", scenes()[0])
    path = saved(folder / "a.checkpoint", data)
    request, _ = checkpoints.asked_again(path, Request(Path()), allow_code=False)
    prepared = prepare(request)
    checkpoints.restore(prepared.render, checkpoints.load(path), str(path))
    return prepared.render.image()


# ---------------------------------------------------------------------- scenes of several files

_SEPARATOR = b"\n@@ "  # name of a file, its text; "->" and a path where it is a link


def _folders() -> list[bytes]:
    shape = b'<scene version="3.0.0">%s</scene>' % SHAPES[0]
    square = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    mesh = b'<shape type="obj"><string name="filename" value="%s"/></shape>'
    parts = [
        {b"scene.xml": XML % b'<include filename="sub/more.xml"/>', b"sub/more.xml": shape},
        {b"scene.xml": XML % (b'<path value="sub"/>' + mesh % b"a.obj"), b"sub/a.obj": square},
        {b"scene.xml": XML % (mesh % b"link.obj"), b"link.obj": b"->../outside/a.obj"},
        {b"scene.xml": XML % (b'<path value="sub"/>' + mesh % b"a.obj"), b"sub": b"->../outside"},
        {b"scene.xml": XML % b'<shape type="evil"/>', b"plugins/evil.so": b"no library"},
        {b"scene.xml": XML % b'<default name="f" value="sub/a.xml"/><include filename="$f"/>', b"sub/a.xml": shape},
        {b"scene.xml": XML % b'<alias id="b" as="c"/><shape type="cube"><ref id="c"/></shape>', b"a": b"->scene.xml"},
    ]
    return [b"".join(_SEPARATOR + name + b"\n" + text for name, text in files.items()) for files in parts]


@target("scene-folder", _folders, [
    b'<path value="../outside"/>', b'<path value="."/>', b'<include filename="../outside/a.xml"/>', b"../", b"..",
    b"->", b"\n@@ plugins/sphere.so\nx", b"\n@@ a\n->a", b"$f", b'type="../evil"', b"/etc/hostname", b"\0",
    b'<include filename="scene.xml"/>', b"\n@@ sub/more.xml\n", b"sub/../sub/", b"//",
])  # fmt: skip
def scene_folder(data: bytes, folder: Path) -> object:
    """A Mitsuba scene of several files; nothing outside its folder may be read."""
    root, outside = folder / "scene", folder / "outside"
    root.mkdir()
    outside.mkdir()
    saved(outside / "a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    saved(outside / "a.xml", b'<scene version="3.0.0"/>')
    for part in data.split(_SEPARATOR)[1:]:
        name, _, text = part.partition(b"\n")
        with contextlib.suppress(OSError, ValueError):
            _place(root, os.fsdecode(name), text)
    with _none_opened(outside):
        return _load_xml(root / "scene.xml")


def _place(root: Path, name: str, text: bytes) -> None:
    """Make one file of a scene, nowhere but in its folder."""
    path = Path(os.path.normpath(root / name))
    if not path.is_relative_to(root) or path == root or not path.parent.resolve().is_relative_to(root.resolve()):
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    if text.startswith(b"->"):
        path.symlink_to(os.fsdecode(text[2:].split(b"\n")[0]))
    else:
        path.unlink(missing_ok=True)  # not through a link
        path.write_bytes(text)


@contextlib.contextmanager
def _none_opened(folder: Path) -> Iterator[None]:
    """Fail if a file in the folder was read: the system notes when (not on file systems that are mounted without)."""
    files = list(folder.iterdir())
    for file in files:
        os.utime(file, ns=(0, file.stat().st_mtime_ns))
    yield
    read = [file.name for file in files if file.stat().st_atime_ns != 0]
    if read:
        raise AssertionError(f"read outside the scene's folder: {read}")


# ---------------------------------------------------------------------- names of files

_NAMED = (
    "info {}", "convert a.npz {}", "convert {} b.png", "compare {} a.npz", "emit {} -o {}", "emit lambert -o {}",
    "schema scene -o {}", "models {}", "explain {}", "new material velvet -o {}", "render {}", "resume {}",
)  # fmt: skip


_FIRST = b"a.exr"


@target("file-name", lambda: [
    _FIRST, b"caf\xe9.npz", b"a b.json", b"-.png", b"a:B.py", b"a.json:2", b"x" * 255, b"a\nb.exr",
    b"\xf0\x9f\x98\x80.hdr",
], [b".exr", b".npz", b".json", b".xml", b":", b"~", b"*", b"[", b"{", b"%s",
    b"\x1b[31m", b"\xff", b" ", b"\n", b"=",
])  # fmt: skip
def file_name(data: bytes, folder: Path) -> object:
    """Files of any name, read and written by verbs; `/` would lead elsewhere."""
    import numpy as np
    from gonio.pictures import images

    os.chdir(folder)
    images.write(folder / "a.npz", np.full((2, 2, 3), 0.1, np.float32))
    name = os.fsdecode(data.replace(b"/", b"_").replace(b"\0", b""))
    with contextlib.suppress(OSError):
        Path(name).write_bytes(b"{}")
    commands = (_NAMED[zlib.crc32(data) % len(_NAMED)],) if data != _FIRST else _NAMED  # imports count for no input
    return [command_line([part.format(name) for part in command.split()]) for command in commands]


# ---------------------------------------------------------------------- the environment

_VARIABLES = (
    b"LANG", b"LC_ALL", b"PATH", b"HOME", b"GONIO_CACHE", b"XDG_CACHE_HOME", b"GONIO_PLUGINS", b"GONIO_FAST",
    b"COLUMNS", b"LINES", b"TERM", b"NO_COLOR", b"FORCE_COLOR", b"PYTHONIOENCODING", b"TMPDIR", b"DRJIT_CACHE_DIR",
)  # fmt: skip
_ASKED = (
    "models", "explain ggx", "schema scene", "render scene.json --spp 0",
    "info a.json",
)  # fmt: skip


_USUAL = b"LANG=C\nLC_ALL=\nCOLUMNS=20"


@target("environment", lambda: [
    _USUAL, b"HOME=nowhere\nGONIO_CACHE=cache", b"PATH=\nTERM=dumb\nNO_COLOR=1",
    b"GONIO_PLUGINS=a:b\nGONIO_FAST=0", b"XDG_CACHE_HOME=x\nTMPDIR=t\nLANG=de_DE.UTF-8",
], [*_VARIABLES, b"=", b"\n", b"-1", b"0", b"1e9", b"\xff", b":", b"~", b"%", b"\x1b["])  # fmt: skip
def environment(data: bytes, folder: Path) -> object:
    """Verbs in an environment of any values, which lead to no other folder."""
    import numpy as np
    from gonio.energy import cache

    os.chdir(folder)
    saved(folder / "scene.json", scenes()[0])
    values = {}
    for line in data.replace(b"\0", b"").split(b"\n"):
        name, _, value = line.partition(b"=")
        if name in _VARIABLES:
            values[os.fsdecode(name)] = os.fsdecode(value.replace(b"/", b"").replace(b"..", b"").replace(b"~", b"_"))
    with mock.patch.dict(os.environ, values):
        cache.remember(("environment",), lambda: np.ones(2))
        first = data == _USUAL  # imports count for no input
        return [
            command_line(_ASKED[(zlib.crc32(data) + at) % len(_ASKED)].split())
            for at in range(len(_ASKED) if first else 1)
        ]
