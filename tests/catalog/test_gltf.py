"""glTF: what its materials become, in a text, in a scene, and where a file is damaged or means harm."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.catalog import documents
from gonio.catalog.documents import Document, Notation
from gonio.errors import InputError

from gltf_files import ALL, document, glb, meshed, pictured, text


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "all.gltf"
    path.write_bytes(text(document()))
    return path


def read(file: Path, name: str) -> Notation:
    return documents.read(Document.family.get("gltf"), file, name).notation


def only(tmp_path: Path, material: dict[str, Any]) -> tuple[Notation, tuple[str, ...]]:
    path = tmp_path / "one.gltf"
    path.write_bytes(text(document({"One": material})))
    return documents.read(Document.family.get("gltf"), path)


def test_the_default_material_is_a_rough_white_metal(file: Path) -> None:
    assert read(file, "Plain") == {"type": "metal", "r0": [1.0, 1.0, 1.0], "alpha": 1.0}


def test_glass_has_its_index_absorption_and_abbe_number(file: Path) -> None:
    found = read(file, "Glass")
    assert found["type"] == "dielectric"
    assert found["absorption"] == pytest.approx([np.log(2.0) / 2.0, 0.0, 0.0])
    d, f, c = (float(go.refractive_index(str(found["eta"]), line).eta) for line in (587.6, 486.1, 656.3))
    assert d == pytest.approx(1.6, abs=1e-6)
    assert (d - 1.0) / (f - c) == pytest.approx(20.0 / 0.4, rel=1e-3)


def test_layers_stand_in_the_order_of_the_specification(file: Path) -> None:
    car, oil, cloth = read(file, "Car"), read(file, "Oil"), read(file, "Cloth")
    assert (car["type"], car["base"]["type"], car["base"]["b"]["type"]) == ("coat", "mix", "metal")  # type: ignore
    film = oil["base"]["base"]  # type: ignore[index]
    assert (oil["type"], oil["opacity"], film["type"], film["thickness"]) == ("opacity", 0.5, "film-conductor", 350.0)
    assert film["alpha"] == [pytest.approx(0.09 + 0.91 * 0.25), pytest.approx(0.09)] and film["rotation"] == 1.0
    assert (cloth["type"], cloth["a"]["type"]) == ("sum", "sheen-charlie")  # type: ignore[index]


@pytest.mark.slow
def test_materials_keep_to_their_light_and_a_dielectric_shows_its_colour_under_a_clear_layer(file: Path) -> None:
    """Khronos2021, appendix B: E of the layer, and 1 - E times the base colour, which no bounce darkens."""
    wo, u = np.array([[0.6, 0.0, 0.8]] * 8192), np.random.default_rng(1).random((8192, 3))
    albedo = {}
    for name in ALL:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = go.material(f"{file}:{name}")
        if name not in ("Car", "Cloth", "Oil"):  # of more layers, whose kernels take seconds
            weight = made.sample(wo, u).weight
            albedo[name] = weight.mean(0)
            assert np.isfinite(weight).all() and albedo[name].max() < 1.01, name
    layer = go.Coat(go.Lambert(0.0), alpha=0.16, bounces="white").sample(wo, u).weight.mean(0)
    assert albedo["Red"] == pytest.approx(layer + (1.0 - layer) * np.array([0.8, 0.1, 0.1]), abs=0.015)


def test_what_is_not_carried_is_said(tmp_path: Path) -> None:
    extensions = {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.5}, "ACME_glitter": {}}
    _, notices = only(tmp_path, {"emissiveFactor": [1, 0, 0], "extensions": extensions})
    said = "\n".join(notices)
    assert "areaLight" in said and "diffuse transmission" in said and "ACME_glitter" in said
    with pytest.warns(go.GonioWarning, match="ACME_glitter"):
        go.material(str(tmp_path / "one.gltf"))


def test_an_extension_that_a_file_requires_and_nobody_reads_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_bytes(text(document(extensionsRequired=["KHR_draco_mesh_compression"])))
    with pytest.raises(InputError, match="requires the extension KHR_draco"):
        go.material(f"{tmp_path / 'a.gltf'}:Red")


def test_materials_are_named_by_name_or_number(tmp_path: Path, file: Path) -> None:
    with pytest.raises(InputError, match="it contains 8 materials"):
        go.material(str(file))
    with pytest.raises(InputError, match="no material 'Rd'") as caught:
        go.material(f"{file}:Rd")
    assert "Red" in caught.value.hint
    (tmp_path / "b.gltf").write_bytes(
        text({"asset": {"version": "2.0"}, "materials": [{}, {"name": "A"}, {"name": "A"}]})
    )
    assert Document.family.get("gltf").materials(tmp_path / "b.gltf") == ["0", "1", "2"]


def test_a_parameter_may_be_set_beside_a_file(file: Path) -> None:
    from gonio.catalog import notation

    assert notation.named(f"{file}:Plain(alpha=.25)")[0] == go.Metal(r0=(1.0, 1.0, 1.0), alpha=0.25)


def scene(folder: Path, material: dict[str, Any], depth: int = 6) -> Path:
    """A square that fills the picture, in white light from everywhere."""
    square = {"type": "parallelogram", "base": [-1, -1, 0], "edge0": [2, 0, 0], "edge1": [0, 2, 0]}
    content = {
        "output": {"filename": "a.exr"},
        "sampler": {"type": "independent", "samples": 256, "seed": 1},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 2], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 53,
            "film": {"size": [2, 2]},
        },
        "integrator": {"type": "path", "maxDepth": depth},
        "scene": {
            "shapes": [{**square, "material": material}],
            "lights": [{"type": "environmentLight", "radiance": 1}],
        },
    }
    (folder / "scene.json").write_text(json.dumps(content))
    return folder / "scene.json"


@pytest.mark.slow
def test_a_scene_takes_a_file_with_the_pictures_inside(tmp_path: Path) -> None:
    """Alpha 1 on the left: a metal of roughness .25 and the picture's colour, decoded, times its factor."""
    (tmp_path / "tiles.glb").write_bytes(glb(*pictured()))
    with pytest.warns(go.GonioWarning, match="the clear layer has one roughness"):
        image = go.render(scene(tmp_path, {"type": "gltf", "file": "tiles.glb"}))
    colour = np.array([(188 / 255 + 0.055) / 1.055, (128 / 255 + 0.055) / 1.055]) ** 2.4 * [1.0, 0.5]
    metal = go.Metal(r0=[*colour, 0.0], alpha=(0.5 * 128 / 255) ** 2)
    expected = go.albedo(metal, mu=1.0).value[0]
    assert image[:, 0].mean(0)[:2] == pytest.approx(expected[:2], rel=0.05)
    assert image[:, 1] == pytest.approx(1.0, abs=1e-3)  # a hole


@pytest.mark.parametrize(
    ("material", "says"),
    [
        ({"file": "../all.gltf"}, "lies outside the scene's folder"),
        ({"file": "none.gltf"}, "'none.gltf' does not exist"),
        ({"file": "all.gltf"}, "it contains 8 materials"),
        ({"file": "all.gltf", "material": "Gold"}, "no material 'Gold'"),
        ({"file": "scene.json"}, "not a gltf file by its name"),
        ({"file": "all.gltf", "material": "Red", "alpha": 1}, "unknown key 'alpha'"),
        ({"file": 3}, "expected a string"),
    ],
)
def test_a_scene_says_what_is_wrong_with_it(tmp_path: Path, file: Path, material: dict[str, Any], says: str) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "all.gltf").write_bytes(file.read_bytes())
    with pytest.raises(InputError, match=says):
        go.render(scene(tmp_path / "in", {"type": "gltf", **material}), size=(1, 1), spp=1)


# --------------------------------------------------------------------------- files that are damaged, or mean harm


def with_buffer(**buffer: object) -> bytes:
    content = meshed()
    content["buffers"] = [{"byteLength": 36, **buffer}]
    return text(content)


def with_image(**image: object) -> bytes:
    colour = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    return text(document({"One": colour}, textures=[{"source": 0}], images=[image]))


def changed(change: Callable[[dict[str, Any]], object]) -> bytes:
    content = meshed()
    change(content)
    return text(content)


WHOLE = glb(*pictured())
BAD = {
    "outside": (with_buffer(uri="../secret.bin"), "is outside its folder"),
    "outside, written otherwise": (with_buffer(uri="%2e%2e/secret.bin"), "is outside its folder"),
    "absolute": (with_buffer(uri="/etc/passwd"), "is outside its folder"),
    "of the network": (with_buffer(uri="http://example.org/a.bin"), "is not a file in its folder"),
    "of a drive": (with_buffer(uri="C:/a.bin"), "is not a file in its folder"),
    "missing": (with_buffer(uri="none.bin"), "does not exist"),
    "zero byte": (with_buffer(uri="a\0b"), "not a usable file name"),
    "picture outside": (with_image(uri="../secret.png"), "is outside its folder"),
    "picture of the network": (with_image(uri="//example.org/a.png"), "is not a file in its folder"),
    "picture without data": (with_image(), "/images/0/bufferView"),
    "no base64": (with_buffer(uri="data:;base64,###"), "not valid base64"),
    "a data URI of text": (with_buffer(uri="data:application/octet-stream,AAAA"), "without ';base64,'"),
    "a data URI without data": (with_buffer(uri="data:;base64"), "without ';base64,'"),
    "a buffer that lies": (with_buffer(uri="data:;base64,AAAA"), "a buffer of 36 bytes, but there are 3"),
    "cut off": (WHOLE[:-40], "but it has"),
    "a head alone": (WHOLE[:12], "not a glTF file"),
    "a chunk that lies": (WHOLE[:12] + b"\xff\xff\xff\x7f" + WHOLE[16:], "a chunk of 2147483647 bytes"),
    "version 1": (WHOLE[:4] + b"\1" + WHOLE[5:], "version 1 of .glb"),
    "a view that lies": (
        changed(lambda d: d["bufferViews"][0].update(byteLength=37)),
        "ends at byte 37 of a buffer of 36",
    ),
    "a huge count": (changed(lambda d: d["accessors"][0].update(count=10**12)), "10000000000.. entries end"),
    "a node of itself": (changed(lambda d: d["nodes"][1].update(children=[0])), "is its own ancestor"),
    "two parents": (changed(lambda d: d["nodes"].append({"children": [1]})), "two parents"),
    "an index too far": (changed(lambda d: d["bufferViews"][0].update(buffer=7)), "there is no buffers 7"),
    "a text for a number": (
        changed(lambda d: d["materials"][0].update(pbrMetallicRoughness={"roughnessFactor": "1"})),
        "a number expected",
    ),
    "out of range": (
        changed(lambda d: d["materials"][0].update(pbrMetallicRoughness={"roughnessFactor": 2})),
        "2 is out of range",
    ),
    "a list for an object": (changed(lambda d: d["materials"][0].update(extensions=[])), "an object expected"),
    "a colour of two": (
        changed(lambda d: d["materials"][0].update(emissiveFactor=[0, 1])),
        "a list of 3 numbers expected",
    ),
    "no number": (b'{"asset": {"version": "2.0"}, "materials": [{"alphaCutoff": NaN}]}', "NaN is not a JSON number"),
    "deep": (b'{"asset": ' * 100_000, "nested too deep|not valid JSON"),
    "version 3": (b'{"asset": {"version": "3.0"}}', "version 3.0"),
    "no materials": (b'{"asset": {"version": "2.0"}}', "it contains no material"),
    "a list": (b"[]", "an object expected"),
    "nothing": (b"", "not valid JSON"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_one_clear_error(tmp_path: Path, name: str) -> None:
    data, says = BAD[name]
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\0" * 36)
    (tmp_path / "secret.png").write_bytes(b"\0" * 36)
    path = tmp_path / "in" / ("a.glb" if data[:4] == b"glTF" else "a.gltf")
    path.write_bytes(data)
    with pytest.raises(InputError, match=says):
        go.material(str(path))


def test_a_link_does_not_lead_outside(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\0" * 36)
    (tmp_path / "in" / "link.bin").symlink_to(tmp_path / "secret.bin")
    (tmp_path / "in" / "a.gltf").write_bytes(with_buffer(uri="link.bin"))
    with pytest.raises(InputError, match="is outside its folder"):
        go.material(str(tmp_path / "in" / "a.gltf"))
