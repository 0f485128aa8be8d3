"""Bytes of pictures: what a library in C++ would be corrupted by never reaches it, and Radiance is read exactly."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.pictures import formats, images
from gonio.render.prepare import prepare
from gonio.render.request import Request


def radiance(width: int, height: int, lines: bytes) -> bytes:
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode() + lines


def line(width: int, *runs: bytes) -> bytes:
    return bytes((2, 2, width >> 8, width & 255)) + b"".join(runs)


GREY = bytes((128 + 9, 7))  # a run of 9


def refused(content: bytes) -> str:
    kind = formats.kind_of(content)
    assert kind is not None
    with pytest.raises(formats.Unreadable) as caught:
        formats.decode(Path("a"), content, kind)
    return str(caught.value)


@pytest.mark.parametrize(
    ("runs", "reason"),
    [
        ([bytes((128 + 100, 7)), *[GREY] * 3], "longer than its scanline"),
        ([bytes((100,)) + b"x" * 100, *[GREY] * 3], "longer than its scanline"),
        ([bytes((0,)), *[GREY] * 4], "empty"),
        ([GREY, GREY], "truncated"),
        ([GREY, GREY, GREY, bytes((9, 1, 2))], "truncated"),
        ([GREY, GREY, GREY, bytes((128 + 9,))], "truncated"),
    ],
)
def test_wrong_runs_of_a_radiance_picture_are_refused(runs: list[bytes], reason: str) -> None:
    assert reason in refused(radiance(9, 1, line(9, *runs)))


def test_a_radiance_picture_whose_lines_run_wild_corrupts_nothing() -> None:
    # the find: 1.1 kB by which Mitsuba's reader writes past its buffer
    assert "longer" in refused(radiance(9, 60, line(9, *[GREY] * 4) * 20 + line(9, *[bytes((255, 7))] * 8) * 40))


@pytest.mark.parametrize("first", [b"-Y 9 +X -0", b"-Y 0x9 +X 9"])
def test_a_radiance_picture_has_one_line_of_sizes(first: bytes) -> None:
    # Mitsuba takes the first of them, and would end the process; another reader the first that it understands
    whole = radiance(9, 1, line(9, *[GREY] * 4))
    formats.check(whole, "RGBE")
    header, _, rest = whole.partition(b"\n\n")
    assert "no line" in refused(header + b"\n\n" + first + b"\n\n\n" + rest)
    assert "no line" in refused(header + b"\n" + first + b"\n\n" + rest)


@pytest.mark.parametrize("width", [3, 8, 9, 300])
def test_radiance_is_read_as_mitsuba_does(tmp_path: Path, width: int) -> None:
    mi = engine.load()
    rng = np.random.default_rng(width)
    pixels = (10.0 ** rng.uniform(-3, 3, (5, width, 3))).astype(np.float32)
    pixels[1] = 0.25  # runs
    pixels[2] = 0.0
    mi.Bitmap(pixels).write(str(tmp_path / "a.hdr"))
    expected = np.array(mi.Bitmap(str(tmp_path / "a.hdr")))
    np.testing.assert_array_equal(images.read(tmp_path / "a.hdr").pixels, expected)


def test_flat_radiance_is_read() -> None:
    content = radiance(2, 1, bytes((128, 64, 32, 129, 255, 0, 0, 128)))
    values, whole = formats.decode(Path("a"), content, "RGBE")
    assert not whole
    np.testing.assert_array_equal(values, [[[1.0, 0.5, 0.25], [255 / 256, 0, 0]]])


def test_headers_that_contradict_their_file_are_refused(tmp_path: Path) -> None:
    png = images.png_bytes(np.zeros((4, 4, 3), np.uint8))
    assert "truncated" in refused(png[:-9])
    at = png.index(b"IDAT") - 4
    assert "truncated" in refused(png[:at] + struct.pack(">I", 2**31 - 1) + png[at + 4 :])
    exr = images.write(tmp_path / "a.exr", np.zeros((4, 4, 3), np.float32), {"scene": "müll"}).read_bytes()
    assert "lacks 'compression'" in refused(exr.replace(b"compression\0", b"compressiom\0"))
    at = exr.index(b"compression\0") + len(b"compression\0compression\0")
    assert "longer than the file" in refused(exr[:at] + struct.pack("<i", 2**30) + exr[at + 4 :])
    at = exr.index(b"pixelAspectRatio\0float\0") + len(b"pixelAspectRatio\0float\0")
    longer = struct.pack("<i", 329) + exr[at + 4 : at + 8] + bytes(325)
    assert "has 329 bytes, float has 4" in refused(exr[:at] + longer + exr[at + 8 :])
    preview = b"preview\0preview\0" + struct.pack("<iII", 8, 1 << 15, 1 << 15)
    assert "not a preview of the stated size" in refused(exr[:8] + preview + exr[8:])
    assert "unknown version" in refused(exr[:4] + b"\x03" + exr[5:])
    assert "XYZ" in refused(radiance(9, 1, b"").replace(b"rgbe", b"xyze"))


def test_an_attribute_that_is_not_utf8_is_no_traceback(tmp_path: Path) -> None:
    path = images.write(tmp_path / "a.exr", np.ones((4, 4, 3), np.float32), {"scene": "müll"})
    path.write_bytes(path.read_bytes().replace("ü".encode(), b"\xff\xfe"))
    assert images.read(path).metadata["scene"] == "m��ll"


def test_a_file_whose_name_is_no_text_is_one_clear_error(tmp_path: Path) -> None:
    path = images.write(tmp_path / "a.exr", np.ones((4, 4, 3), np.float32))
    odd = path.rename(tmp_path / "b\udcff.exr")
    with pytest.raises(InputError, match="not UTF-8"):
        images.read(odd)


def test_a_mitsuba_scene_opens_no_picture_that_would_corrupt_it(tmp_path: Path) -> None:
    (tmp_path / "sky.hdr").write_bytes(radiance(9, 60, line(9, *[bytes((255, 7))] * 8) * 60))
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"><emitter type="envmap"><string name="filename" value="sky.hdr"/></emitter></scene>'
    )
    for allowed in (False, True):
        with pytest.raises(InputError, match="longer than its scanline"):
            prepare(Request(scene, allow_outside=allowed))


def test_radiance_files_are_rounded_not_truncated(tmp_path: Path) -> None:
    picture = np.random.default_rng(1).uniform(0.0, 3.0, (40, 50, 3)).astype(np.float32) ** 4
    picture[:3], picture[3:6, :, 1] = 0.0, 1e-7
    images.write(tmp_path / "a.hdr", picture)
    back = images.read(tmp_path / "a.hdr").pixels
    largest = picture.max(2, keepdims=True)
    assert (np.abs(back - picture) <= largest * 2.0**-8 * 1.001).all() and (back[:3] == 0.0).all()
    assert abs(back.mean() / picture.mean() - 1.0) < 3e-4
    images.write(tmp_path / "b.hdr", back)  # what was read is written unchanged
    np.testing.assert_array_equal(images.read(tmp_path / "b.hdr").pixels, back)
