"""Tables in the forms that engines load: what independent readers find is what the shader was written with."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.shaders import Bundle, Placement, bundle
from gonio.shaders.ktx2 import ktx2
from gonio.shaders.openexr import openexr
from numpy.typing import NDArray
from variants import GLASS, GOLD

PARSER = Path(__file__).parents[2] / "web/node_modules/three/examples/jsm/libs/ktx-parse.module.js"
READ = """
import {{ readFileSync }} from "node:fs";
import {{ read }} from "{parser}";
const k = read(new Uint8Array(readFileSync(process.argv[2])));
const text = (value) => (typeof value === "string" ? value : new TextDecoder().decode(value));
console.log(JSON.stringify({{
    format: k.vkFormat, typeSize: k.typeSize, size: [k.pixelWidth, k.pixelHeight, k.pixelDepth],
    orientation: text(k.keyValue.KTXorientation), descriptor: k.dataFormatDescriptor[0],
    data: Buffer.from(k.levels[0].levelData).toString("hex"), levels: k.levels.length,
}}));
"""
# VkFormat -> (type, channels), as the Vulkan specification numbers them
VULKAN = {100: ("<f4", 1), 103: ("<f4", 2), 109: ("<f4", 4), 76: ("<f2", 1), 83: ("<f2", 2), 97: ("<f2", 4)}


def numbers(*shape: int) -> NDArray[np.float32]:
    return np.random.default_rng(3).normal(size=shape).astype(np.float32)


def parsed(data: bytes) -> NDArray[Any]:
    """The texels of a KTX 2.0 file, read by the specification: header, index, levels, descriptor, values."""
    assert data[:12] == bytes([0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A])
    format_, size, width, height, depth, layers, faces, levels, compression = struct.unpack_from("<9I", data, 12)
    assert (layers, faces, levels, compression) == (0, 1, 1, 0)
    type_, channels = VULKAN[format_]
    assert size == np.dtype(type_).itemsize
    dfd, dfd_length, kvd, kvd_length, sgd, sgd_length = struct.unpack_from("<4I2Q", data, 48)
    offset, length, uncompressed = struct.unpack_from("<3Q", data, 80)
    texel = size * channels
    assert dfd == 104 and dfd % 4 == kvd % 4 == 0 and (sgd, sgd_length) == (0, 0)
    assert kvd == dfd + dfd_length and offset % np.lcm(texel, 4) == 0 and kvd + kvd_length <= offset
    assert length == uncompressed == len(data) - offset == texel * width * height * max(depth, 1)
    total, vendor, version, block = struct.unpack_from("<2I2H", data, dfd)
    assert (total, vendor, version, block) == (dfd_length, 0, 2, 24 + 16 * channels)
    assert list(data[dfd + 12 : dfd + 28]) == [1, 0, 1, 0, 0, 0, 0, 0, texel, 0, 0, 0, 0, 0, 0, 0]
    for place, name in enumerate([0, 1, 2, 15][:channels]):  # R, G, B, A; float and signed; from -1 to 1
        sample = struct.unpack_from("<H2BI2f", data, dfd + 28 + 16 * place)
        assert sample == (8 * size * place, 8 * size - 1, 0xC0 | name, 0, -1.0, 1.0)
    assert b"KTXorientation\0" + (b"rdi\0" if depth else b"rd\0") in data[kvd : kvd + kvd_length]
    shape = [depth] * bool(depth) + [height, width, channels]
    return np.frombuffer(data, type_, offset=offset).reshape(shape)


def test_ktx2_is_as_specified() -> None:
    for shape in [(3, 5, 1), (1, 7, 2), (3, 5, 4), (2, 3, 5, 1), (4, 3, 2, 4)]:
        for texels in (numbers(*shape), numbers(*shape).astype(np.float16)):
            read = parsed(ktx2(texels))
            assert read.dtype == texels.dtype and np.array_equal(read, texels)


def test_ktx2_is_read_by_the_parser_of_three_js(tmp_path: Path) -> None:
    if not PARSER.exists() or shutil.which("node") is None:
        pytest.skip("NOT TRIED in three.js: `npm ci` in web/ installs it")
    (tmp_path / "read.mjs").write_text(READ.format(parser=PARSER.resolve().as_uri()))
    for texels, format_ in ((numbers(4, 3, 2, 4), 109), (numbers(3, 5, 1).astype(np.float16), 76)):
        (tmp_path / "a.ktx2").write_bytes(ktx2(texels))
        command = ["node", "read.mjs", "a.ktx2"]
        read = json.loads(subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout)
        depth, height, width, channels = (1, *texels.shape)[-4:]
        assert (read["format"], read["typeSize"], read["levels"]) == (format_, texels.itemsize, 1)
        assert read["size"] == [width, height, depth if texels.ndim == 4 else 0]
        assert read["orientation"].rstrip("\0") == ("rdi" if texels.ndim == 4 else "rd")
        assert bytes.fromhex(read["data"]) == texels.tobytes()
        descriptor = read["descriptor"]
        assert descriptor["colorModel"] == 1 and descriptor["transferFunction"] == 1
        assert len(descriptor["samples"]) == channels
        assert [s["bitLength"] + 1 for s in descriptor["samples"]] == [8 * texels.itemsize] * channels


def test_openexr_is_read_by_mitsuba(tmp_path: Path) -> None:
    import mitsuba as mi

    for texels in (numbers(3, 5, 4), numbers(3, 5, 1).astype(np.float16)):
        (tmp_path / "a.exr").write_bytes(openexr(texels))
        picture = np.array(mi.Bitmap(str(tmp_path / "a.exr")))
        assert picture.dtype == texels.dtype and np.array_equal(picture.reshape(texels.shape), texels)


def of(made: Bundle, folder: Path, form: str) -> dict[str, NDArray[Any]]:
    """The tables of a written bundle as the manifest's files hold them."""
    import mitsuba as mi

    made.write(folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    read = {}
    for texture in manifest["textures"]:
        path = folder / texture["file"]
        assert texture["file_format"] == form and f"They are in {path.name}," in made.text
        shape = (*reversed(texture["size"]), texture["channels"])
        read[texture["uniform"]] = (
            parsed(path.read_bytes()) if form == "ktx2" else np.array(mi.Bitmap(str(path))).reshape(shape)
        )
    return read


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["exr", "ktx2"])
def test_tables_of_a_bundle_are_in_the_files_that_its_manifest_names(form: str, tmp_path: Path) -> None:
    materials = [go.KullaConty(GOLD), go.KullaConty(GLASS)]  # with tables of two and of three axes
    made = bundle(materials, "hlsl", placement=Placement(tables=form))
    read = of(made, tmp_path, form)
    assert {len(table.shape) for table in read.values()} == {3, 4}
    assert all(np.array_equal(read[name], table) for name, table in made.tables.items())


def test_forms_that_do_not_exist_or_do_not_fit_are_refused() -> None:
    for lang, form, text in (
        ("glsl", "ktx", "unknown format 'ktx'"),
        ("osl", "ktx2", "OSL reads tables in its own format"),
        ("numpy", "ktx2", "a table format given, but a numpy file is self-contained"),
    ):
        with pytest.raises(go.InputError, match=text):
            go.emit(go.KullaConty(GOLD), lang, tables=form)
