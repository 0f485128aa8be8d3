"""A scene file is read exactly, and whatever is wrong with it is one clear error with its place."""

from __future__ import annotations

import copy
import json
import os
import re
from pathlib import Path
from typing import Any

import gonio as go
import pytest
from gonio import scene
from gonio.errors import InputError
from gonio.scene.text import MAX_DEPTH
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

REPOSITORY = Path(__file__).parents[2]

SPHERE = {
    "type": "sphere",
    "center": [0, 0, 0],
    "radius": 1,
    "material": {"type": "conductor", "albedo": [0.8, 0.8, 0.8], "roughness": 0.2, "ndf": "ggx"},
    "transform": {"translate": [0, 1, 0], "rotate": {"axis": [0, 1, 0], "radian": 1}, "scale": [1, 1, 1]},
}
FLOOR = {
    "type": "parallelogram",
    "base": [-1, 0, -1],
    "edge0": [0, 0, 2],
    "edge1": [2, 0, 0],
    "material": {"type": "matte", "albedo": [0.7, 0.7, 0.7]},
}
VALID: dict[str, Any] = {
    "output": {"filename": "a.exr"},
    "sampler": {"type": "independent", "xSamples": 2, "ySamples": 3, "seed": 7},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1, 4], "up": [0, 1, 0], "lookAt": [0, 0, 0]},
        "tNear": 0.1,
        "tFar": 10000,
        "verticalFov": 45,
        "film": {"size": [60, 40]},
    },
    "integrator": {"type": "path", "maxDepth": 5},
    "scene": {
        "shapes": [SPHERE, FLOOR, {"type": "disk", "inner_radius": 0.5, "phi_max": 3}],
        "lights": [
            {"type": "areaLight", "energy": [5, 5, 5], "shape": {"type": "cube"}},
            {"type": "spotLight", "position": [0, 3, 0], "energy": [1, 1, 1]},
            {"type": "environmentLight", "radiance": [0.1, 0.1, 0.1]},
        ],
        "ambient": [0.1, 0.2, 0.3],
    },
}


def write(folder: Path, data: Any) -> Path:
    (folder / "scene.json").write_text(data if isinstance(data, str) else json.dumps(data))
    return folder


def refused(folder: Path, data: Any, **options: Any) -> InputError:
    with pytest.raises(InputError) as caught:
        scene.read(write(folder, data), **options)
    error = caught.value
    assert "scene.json" in error.where or error.where.startswith("path ")
    assert error.what and error.hint, "every message says what is wrong and what to do"
    return error


# ---------------------------------------------------------------------- good input


def test_a_folder_and_its_file_read_alike(tmp_path):
    write(tmp_path, VALID)
    for path in (tmp_path, str(tmp_path), tmp_path / "scene.json"):
        description = scene.read(path)
        assert description.folder == tmp_path and description.path == tmp_path / "scene.json"
        assert description.output.filename == "a.exr"
        assert (description.spp, description.seed, description.sampler.preference) == (6, 7, "default")
        assert (description.integrator.type, description.integrator.max_depth) == ("path", 5)
        assert description.camera.film.size == (60, 40) and description.camera.vertical_fov == 45
        assert description.ambient == (0.1, 0.2, 0.3)
        assert [shape.type for shape in description.shapes] == ["sphere", "parallelogram", "disk"]
        assert len(description.lights) == 3 and description.warnings == []
        assert description.raw == VALID


def test_defaults_are_the_lab_s(tmp_path):
    data = copy.deepcopy(VALID)
    del data["scene"], data["camera"]["tNear"], data["camera"]["tFar"]
    data["scene"] = {}
    description = scene.read(write(tmp_path, data))
    assert (description.camera.t_near, description.camera.t_far) == (1e-4, 1e10)
    assert description.shapes == [] and description.lights == [] and description.ambient is None


def test_a_byte_order_mark_and_whole_floats_are_fine(tmp_path):
    data = copy.deepcopy(VALID)
    data["sampler"]["xSamples"] = 2.0
    (tmp_path / "scene.json").write_bytes(b"\xef\xbb\xbf" + json.dumps(data).encode())
    assert scene.read(tmp_path).spp == 6


def test_samples_and_sampler_types(tmp_path):
    data = copy.deepcopy(VALID)
    data["sampler"] = {"type": "sobol", "samples": 17}
    description = scene.read(write(tmp_path, data))
    assert (description.spp, description.seed, description.sampler.preference) == (17, None, "sobol")


@pytest.mark.long
def test_every_model_is_a_type_and_the_lab_s_names_keep_their_meaning(tmp_path):
    from gonio.material import models

    for name, model in models().items():
        inner = {p.name: {"type": "gonio-conductor"} for p in model.parameters().values() if p.kind == "bsdf"}
        for spelling in (f"gonio-{name}", f"gonio_{name.replace('-', '_')}"):
            data = copy.deepcopy(VALID)
            data["scene"]["shapes"][0]["material"] = {"type": spelling, **inner}
            scene.read(write(tmp_path, data))
    data["scene"]["shapes"][0]["material"] = {
        "type": "two_sided",
        "base": {"type": "mix", "a": {"type": "matte"}, "b": {"type": "blinn-phong", "p": 8}, "weight": 0.1},
    }
    scene.read(write(tmp_path, data))


def test_odd_but_usable_input_is_a_warning_with_its_place(tmp_path):
    data = copy.deepcopy(VALID)
    data["scene"]["shapes"][1]["material"]["albedo"] = [0.5, 1.5, 0.5]
    data["scene"]["shapes"][2]["material"] = {"type": "mirror", "albedo": [0.3, 0.3, 0.3]}
    first, second = scene.read(write(tmp_path, data)).warnings
    assert "#/scene/shapes/1/material/albedo: albedo over 1" in first
    assert "#/scene/shapes/2/material/albedo: ignored" in second


# ---------------------------------------------------------------------- values of the wrong kind

SHAPE, MATERIAL = "/scene/shapes/0", "/scene/shapes/0/material"
WRONG = [
    # where, value, where the error points, what it says, what it hints
    (MATERIAL + "/roughnes", 0.1, None, "unknown key 'roughnes' of 'conductor'", "did you mean 'roughness'"),
    (MATERIAL + "/roughness", "0.2", None, "expected a number.*got the string '0.2'", "without quotes"),
    (MATERIAL + "/roughness", True, None, "expected a number.*got true", "number"),
    (MATERIAL + "/roughness", -0.1, None, "-0.1 is out of range: roughness is >= 0 and <= 1", "width"),
    (MATERIAL + "/roughness", [0.1, -0.1], None, "-0.1 is out of range", "width"),
    (MATERIAL + "/roughness", [0.1, 0.2, 0.3], None, "expected 2 numbers", "along x"),
    (MATERIAL + "/alpha", 0.1, MATERIAL + "/roughness", "both 'alpha' and 'roughness'", "keep one"),
    (MATERIAL + "/ndf", "gggx", None, "expected 'beckmann', 'ggx'", "did you mean 'ggx'"),
    (MATERIAL + "/type", "conducter", None, "unknown type 'conducter'", "did you mean 'conductor'"),
    (MATERIAL + "/type", 5, None, "unknown type '5'", "known"),
    (MATERIAL + "/albedo", [0.8, 0.8], None, r"expected 3 numbers \[r, g, b\], got a list of 2", "r, g, b"),
    (MATERIAL + "/albedo", [0.8, 0.8, "x"], MATERIAL + "/albedo/2", "expected a number, got the string", "number"),
    (MATERIAL + "/albedo", -1, None, "out of range: albedo is >= 0", "albedo"),
    (MATERIAL + "/albedo", {"type": "imgTex", "file": "a"}, MATERIAL + "/albedo/type", "'imageTex'", "imageTex"),
    (MATERIAL + "/preset", "Auu", None, "unknown metal 'Auu'", "did you mean 'Au'"),
    (MATERIAL, {"type": "conductor"}, None, "key 'roughness' is missing", "roughness"),
    (MATERIAL, {"type": "phong"}, None, "key 'p' is missing", "add"),
    (MATERIAL, {"albedo": 1}, None, "key 'type' is missing", "type"),
    (MATERIAL, [], None, "expected an object", "{ }"),
    (MATERIAL, "conductor(alpha=.2)", None, "expected an object", '{"type": "conductor", ...}, with its parameters'),
    (MATERIAL, "lambert", None, "expected an object", '{"type": "lambert"}'),
    (MATERIAL, "frost.py:Frost", None, "expected an object", '{"type": "frost.py:Frost"}, and allow it with --allow'),
    (MATERIAL, "gold.json", None, "expected an object", '{"type": "json", "file": "gold.json"}'),
    (MATERIAL + "/type", "gold.binary", None, "unknown type", '{"type": "measured", "file": "gold.binary"}'),
    (MATERIAL + "/type", "xyz", None, "unknown type", "blinn-phong, bump, coat"),
    (MATERIAL, None, None, "got null", "leave the key out"),
    (
        MATERIAL,
        {"type": "gonio-conductor", "alpha": 0.1, "roughness": 0.1},
        MATERIAL + "/roughness",
        "both",
        "keep one",
    ),
    (MATERIAL, {"type": "two-sided", "base": {"type": "gonio-dielectric"}}, None, "transmits", "two sides"),
    (MATERIAL, {"type": "mix", "a": {"type": "matte"}, "b": {"type": "mate"}}, MATERIAL + "/b/type", "'mate'", "matte"),
    (MATERIAL, {"type": "conductor", "roughness": 0, "preset": "Au", "k": 1}, MATERIAL + "/preset", "both", "keep one"),
    (MATERIAL, {"type": "gonio-phong", "check_sum": True, "kd": 1, "ks": 1}, None, "= 2.0, 1 expected", "check_sum"),
    (SHAPE + "/radius", -1, None, "expected a number > 0, got -1", "> 0"),
    (SHAPE + "/radius", 0, None, "expected a number > 0", "> 0"),
    (SHAPE + "/radius", 1e300, None, "too large", "1e"),
    (
        "/scene/lights/0",
        {"type": "directionalLight", "direction": [0, 0, 0], "energy": 1},
        "/scene/lights/0/direction",
        "direction has length 0",
        "0, -1, 0",
    ),
    (SHAPE + "/type", "spere", None, "unknown type 'spere'", "did you mean 'sphere'"),
    (
        "/scene/lights/0/type",
        "pointLight",
        None,
        "unknown type 'pointLight'",
        "write 'spotLight', which shines equally",
    ),
    (SHAPE + "/center", [0, 0], None, "expected 3 numbers", "x, y, z"),
    (SHAPE + "/transform/scale", [1, 0, 1], None, "flattens", "other than 0"),
    (SHAPE + "/transform/rotate/axis", [0, 0, 0], None, "length 0", "direction"),
    (SHAPE + "/transform/rotate/radians", 1, None, "unknown key 'radians'", "radian"),
    ("/scene/shapes/1/edge1", [0, 0, 4], None, "parallel", "span"),
    ("/scene/shapes/1/edge1", [0, 0, 0], None, "length 0", "span"),
    ("/scene/shapes/2/inner_radius", 1, None, "leaves nothing", "smaller"),
    ("/scene/shapes/2/phi_max", 7, None, "full turn", "2pi"),
    ("/scene/shapes", {}, None, r"expected a list", r"\[ \]"),
    ("/scene/shapes/0", "sphere", None, "expected an object", "{ }"),
    ("/output", "ball.exr", None, "expected an object", '{"filename": "ball.exr"}'),
    ("/integrator", "path", None, "expected an object", '{"type": "path"}'),
    ("/scene/shapes/0/material", "lambert+ggx", None, "expected an object", '{"type": "sum", "a": {...}'),
    ("/scene/acceleration", "bhv", None, "expected 'embree'", "did you mean 'bvh'"),
    ("/scene/lights/0/energy", [-1, 0, 0], "/scene/lights/0/energy/0", "expected a number >= 0", ">= 0"),
    ("/scene/lights/0/energy", "5", None, "got the string '5'", "without quotes"),
    ("/scene/lights/1", {"type": "environmentLight", "radiance": 1}, "/scene/lights", "more than one", "keep one"),
    ("/scene/lights/2/texture", [1, 1, 1], "/scene/lights/2", "both 'texture' and 'radiance'", "give one"),
    ("/ambient", [1, 1, 1], None, "both 'ambient' and 'scene.ambient'", "keep one"),
    ("/camera/verticalFov", 180, None, "expected a number < 180", "< 180"),
    ("/camera/verticalFov", 0, None, "expected a number > 0", "> 0"),
    ("/camera/transform/up", [0, -1, -4], None, "parallel to the view", "tilt"),
    ("/camera/transform/up", [0, 0, 0], None, "length 0", "direction"),
    ("/camera/transform/lookAt", [0, 1, 4], None, "same point", "move"),
    ("/camera/tFar", 0.01, None, "not beyond tNear", "widen"),
    ("/camera/film/size", [0, 40], None, "no pixels", "1x1"),
    ("/camera/film/size", [10**6, 10**6], None, "GiB", "smaller"),
    ("/camera/film/size", [40], None, "expected 2 numbers", "width"),
    ("/camera/film/size", [40.5, 40], "/camera/film/size/0", "whole number", "number"),
    ("/camera/film/size", ["40", 40], "/camera/film/size/0", "whole number", "without quotes"),
    ("/camera", {"type": "pinhole"}, None, "key 'transform' is missing", "add"),
    ("/sampler/xSamples", 0, None, "expected a number >= 1, got 0", ">= 1"),
    ("/sampler/samples", 4, None, "both 'samples'", "keep one"),
    ("/sampler/seed", -1, None, "expected a number >= 0", ">= 0"),
    ("/sampler/type", "sobl", None, "unknown sampler 'sobl'", "did you mean 'sobol'"),
    ("/integrator", {"type": "path"}, None, "key 'maxDepth' is missing", "maxDepth"),
    ("/integrator", {"type": "whited"}, "/integrator/type", "unknown type 'whited'", "did you mean 'whitted'"),
    ("/integrator/maxDepth", 0, None, "expected a number >= 1", ">= 1"),
    ("/output/filename", "a.jpeg", None, "not a known kind of picture", "exr"),
    ("/output/filename", "../a.exr", None, "outside the folder", "plain file name"),
    ("/output/filename", "/tmp/a.exr", None, "outside the folder", "plain file name"),
    ("/outputs", {}, None, "unknown key 'outputs' of scene description", "did you mean 'output'"),
]


def put(data: Any, where: str, value: Any) -> None:
    *steps, last = where[1:].split("/")
    for step in steps:
        data = data[int(step) if isinstance(data, list) else step]
    data[int(last) if isinstance(data, list) else last] = value


@pytest.mark.parametrize("where, value, points, what, hint", WRONG, ids=lambda x: str(x)[:40])
def test_wrong_value_is_one_error_with_pointer_expectation_and_hint(tmp_path, where, value, points, what, hint):
    data = copy.deepcopy(VALID)
    put(data, where, value)
    error = refused(tmp_path, data)
    assert error.where == f"{tmp_path / 'scene.json'}#{points or where}"
    assert re.search(what, error.what), error.what
    assert re.search(hint, error.hint), error.hint
    assert error.code == 2


def test_several_errors_are_told_at_once_but_not_all_of_many(tmp_path):
    data = copy.deepcopy(VALID)
    data["scene"]["shapes"] = [copy.deepcopy(SPHERE) | {"radius": -1} for _ in range(9)]
    error = refused(tmp_path, data)
    assert error.where.endswith("#/scene/shapes/0/radius")
    assert "also" in error.what and "#/scene/shapes/1/radius" in error.what and "and 5 more" in error.what


# ---------------------------------------------------------------------- text that is no scene


@pytest.mark.parametrize(
    "text, where, what",
    [
        ("", "", "empty"),
        ("  \n", "", "empty"),
        ("[]", "#", "expected an object"),
        ("3", "#", "expected an object"),
        ('{"a": 1,}', ":1:9", "not valid JSON"),
        ('{"a": 1 // c\n}', ":1:9", "not valid JSON"),
        ("{'a': 1}", ":1:2", "not valid JSON"),
        ('{"output": {"filename": "a.exr", "filename": "b.exr"}}', "#/output/filename", "given twice"),
        ('{"output": NaN}', "#/output", "NaN"),
        ('{"output": [1, -Infinity]}', "#/output/1", "-Infinity"),
        ('{"output": 1e999}', "#/output", "too large"),
        ('{"output": ' + "9" * 400 + "}", "#/output", "too large"),
        ('{"output": ' + "9" * 5000 + "}", "", "number"),
        ("[" * 10_000 + "]" * 10_000, ":1", f"more than {MAX_DEPTH} levels"),
        ('{"a":' * 10_000 + "1" + "}" * 10_000, ":1", f"more than {MAX_DEPTH} levels"),
        ("[" * 10_000, ":1", f"more than {MAX_DEPTH} levels"),
        ('{"a": "' + "[" * 10_000 + '"}', "#/a", "unknown key"),
    ],
    ids=range(17),
)
def test_text_that_is_no_scene_is_one_error(tmp_path, text, where, what):
    error = refused(tmp_path, text)
    assert error.where == f"{tmp_path / 'scene.json'}{where}"
    assert what in error.what


def test_bytes_that_are_not_utf8(tmp_path):
    (tmp_path / "scene.json").write_bytes('{"output": "é"}'.encode("latin-1"))
    with pytest.raises(InputError, match="not UTF-8: byte 12 is 0xe9"):
        scene.read(tmp_path)


def test_a_scene_file_is_bounded(tmp_path):
    with open(tmp_path / "scene.json", "wb") as file:
        file.truncate(100 * 2**20)  # sparse: takes no room
    with pytest.raises(InputError, match="limit for a scene is 64 MiB"):
        scene.read(tmp_path)


def test_paths_that_are_no_scene(tmp_path):
    with pytest.raises(InputError, match=r"no scene\.json"):
        scene.read(tmp_path)
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, match=r"other\.json"):
        scene.read(tmp_path)
    with pytest.raises(InputError, match=r"did you mean 'other\.json'"):
        scene.read(tmp_path / "othr.json")
    for path in (tmp_path / "a\0b", tmp_path / ("x" * 5000), Path("/nowhere/at/all.json")):
        with pytest.raises(InputError):
            scene.read(path)


# ---------------------------------------------------------------------- files that a scene names


def with_texture(file: Any) -> dict:
    data = copy.deepcopy(VALID)
    put(data, MATERIAL + "/albedo", {"type": "imageTex", "file": file})
    return data


def test_missing_texture_hints_at_what_lies_there(tmp_path):
    (tmp_path / "wood.png").write_bytes(b"x")
    error = refused(tmp_path, with_texture("woood.png"))
    assert error.where.endswith(f"#{MATERIAL}/albedo/file")
    assert "'woood.png' does not exist" in error.what and error.hint == "did you mean 'wood.png'?"


def test_files_outside_the_folder_are_refused_unless_allowed(tmp_path):
    outside, inside = tmp_path / "out", tmp_path / "in"
    outside.mkdir()
    inside.mkdir()
    (outside / "t.png").write_bytes(b"x")
    os.symlink(outside / "t.png", inside / "link.png")
    os.symlink(outside, inside / "sub")
    for file in ("../out/t.png", str(outside / "t.png"), "link.png", "sub/t.png"):
        error = refused(inside, with_texture(file))
        assert "outside the scene's folder" in error.what and "--allow-outside" in error.hint
        scene.read(inside, allow_outside=True)


def test_links_and_dots_within_the_folder_are_fine(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "t.png").write_bytes(b"x")
    os.symlink(tmp_path / "t.png", tmp_path / "sub" / "link.png")
    scene.read(write(tmp_path, with_texture("sub/../sub/link.png")))


def test_files_that_cannot_be_files(tmp_path):
    (tmp_path / "empty.png").touch()
    (tmp_path / "folder.png").mkdir()
    os.mkfifo(tmp_path / "pipe.png")
    os.symlink(tmp_path / "loop.png", tmp_path / "loop.png")
    for file, what in [
        ("empty.png", "0 bytes"),
        ("folder.png", "not a file"),
        ("pipe.png", "not a file"),
        ("loop.png", ""),
        ("", "empty string"),
        ("a\0b", "file name"),
        ("x" * 5000, ""),
        ("\ud800", ""),
    ]:
        assert what in refused(tmp_path, with_texture(file)).what
    assert "device" not in str(refused(tmp_path, with_texture("/dev/zero"), allow_outside=True))


def test_missing_mesh_and_environment(tmp_path):
    data = copy.deepcopy(VALID)
    data["scene"]["shapes"][0] = {"type": "triangle", "file": "bunny.obj"}
    assert refused(tmp_path, data).where.endswith("#/scene/shapes/0/file")
    data = copy.deepcopy(VALID)
    data["scene"]["lights"] = [{"type": "environmentLight", "texture": {"type": "imageTex", "file": "sky.hdr"}}]
    assert refused(tmp_path, data).where.endswith("#/scene/lights/0/texture/file")


# ---------------------------------------------------------------------- overrides


@pytest.mark.parametrize(
    "path", ["/scene/shapes/0/material/roughness", "scene.shapes.0.material.roughness", "shapes.0.material.roughness"]
)
def test_overrides_by_pointer_and_by_dots(tmp_path, path):
    description = scene.read(write(tmp_path, VALID), overrides={path: 0.7})
    assert description.raw["scene"]["shapes"][0]["material"]["roughness"] == 0.7
    assert json.loads((tmp_path / "scene.json").read_text()) == VALID


def test_wildcards_set_all_that_have_the_key_or_else_all_that_know_it(tmp_path):
    write(tmp_path, VALID)
    materials = lambda d: [shape.get("material") for shape in d.raw["scene"]["shapes"]]  # noqa: E731
    first, second, third = materials(scene.read(tmp_path, overrides={"shapes.*.material.albedo": 0.1}))
    assert first["albedo"] == second["albedo"] == 0.1 and third is None
    first, second, _ = materials(scene.read(tmp_path, overrides={"shapes.*.material.roughness": 0.1}))
    assert first["roughness"] == 0.1 and "roughness" not in second
    first, second, _ = materials(scene.read(tmp_path, overrides={"shapes.*.material.masking": "smith-correlated"}))
    assert first["masking"] == "smith-correlated" and "masking" not in second


def test_overrides_are_validated_like_the_file(tmp_path):
    for path, value, what in [
        ("/camera/verticalFov", 200, "expected a number < 180"),
        ("camera.film.sise", [1, 1], "unknown key 'sise'"),
        ("shapes.0.radius", float("nan"), "nan"),
    ]:
        assert what in refused(tmp_path, VALID, overrides={path: value}).what


@pytest.mark.parametrize(
    "path, what, hint",
    [
        ("shapes.7.radius", "no item '7' in a list of 3", "0 to 2"),
        ("shapes.x.radius", "no item 'x'", "0 to 2"),
        ("shape.0.radius", "no key 'shape'", "did you mean 'shapes'"),
        ("/scene/shaps/0", "no key 'shaps'", "did you mean 'shapes'"),
        ("shapes.*.material.roughnes", "nothing there has the key", "did you mean 'roughness'"),
        ("shapes.0.radius.x.y", "nothing", "shorten"),
        ("", "empty path", "write"),
        ("/", "empty path", "write"),
        ("a..b", "empty path", "write"),
    ],
)
def test_override_path_that_leads_nowhere(tmp_path, path, what, hint):
    error = refused(tmp_path, VALID, overrides={path: 1})
    assert what in error.what and hint in error.hint and path in error.where


# ---------------------------------------------------------------------- the schema


@pytest.mark.slow
def test_exported_schema_accepts_what_the_reader_accepts():
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(json.dumps(scene.json_schema()))
    validator = jsonschema.Draft202012Validator(schema)
    validator.check_schema(schema)
    validator.validate(VALID)
    for where, value in [
        (MATERIAL + "/roughnes", 1),
        (MATERIAL + "/roughness", -1),
        (MATERIAL + "/ndf", "gggx"),
        (SHAPE + "/radius", "1"),
        ("/camera/verticalFov", 180),
    ]:
        data = copy.deepcopy(VALID)
        put(data, where, value)
        assert not validator.is_valid(data), where


def test_exported_schema_explains_roughness():
    schema = json.dumps(scene.json_schema())
    assert "alpha = roughness^2" in schema and "The same as alpha in the lab's format" in schema
    assert '"null"' not in schema


# ---------------------------------------------------------------------- anything at all

JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["sphere", "matte", "imageTex", "scene.json", "conductor", "../x", "mix", "path"]),
    st.lists(st.one_of(st.integers(-2, 2), st.floats(), st.text(max_size=2)), max_size=4),
    st.dictionaries(st.sampled_from(["type", "file", "albedo", "radius", "a"]), st.integers(-1, 1), max_size=2),
)


def places(data: Any, steps: tuple = ()) -> list[tuple]:
    found = [steps]
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += places(value, (*steps, key))
    return found


@pytest.mark.long
@settings(
    max_examples=100, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_mutated_scene_reads_or_is_refused_but_nothing_else(tmp_path, data):
    mutated = copy.deepcopy(VALID)
    for _ in range(data.draw(st.integers(1, 3))):
        steps = data.draw(st.sampled_from(places(mutated)[1:]))
        holder: Any = mutated
        for step in steps[:-1]:
            holder = holder[step]
        action = data.draw(st.sampled_from(["replace", "delete", "add"]))
        if action == "replace":
            holder[steps[-1]] = data.draw(JUNK)
        elif action == "delete":
            del holder[steps[-1]]
        elif isinstance(holder, dict):
            holder[data.draw(st.one_of(st.text(max_size=5), st.sampled_from(["type", "material", "alpha"])))] = (
                data.draw(JUNK)
            )
        else:
            holder.append(data.draw(JUNK))
        if len(places(mutated)) == 1:
            break
    try:
        scene.read(write(tmp_path, mutated))
    except InputError as error:
        assert error.what and error.where and error.hint


@settings(
    max_examples=200, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_damaged_text_reads_or_is_refused_but_nothing_else(tmp_path, data):
    text = bytearray(json.dumps(VALID).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        if data.draw(st.booleans()):
            text[at] = data.draw(st.integers(0, 255))
        else:
            del text[at : at + data.draw(st.integers(1, 40))]
        if not text:
            break
    (tmp_path / "scene.json").write_bytes(bytes(text))
    try:
        scene.read(tmp_path)
    except InputError as error:
        assert error.what and error.where and error.hint


# ---------------------------------------------------------------------- the course's own scenes


def test_the_course_s_scenes_read_and_build_unmodified(shared):
    from gonio.bridge import engine

    files = sorted((shared / "scenes").glob("**/scene.json"))
    assert len(files) >= 9
    for file in files:
        description = scene.read(file.parent)
        assert len(scene.build(description, engine.load()).shapes()) >= len(description.shapes)


@pytest.mark.slow
def test_the_project_s_own_examples_read_and_are_small():
    files = sorted((REPOSITORY / "examples").glob("*/scene.json"))
    for file in files:
        assert scene.read(file.parent).warnings == []
    for folder in {file.parent for file in files}:
        sizes = {path.name: path.stat().st_size for path in folder.glob("**/*") if path.is_file()}
        assert sum(sizes.values()) < 4e5, sizes


@pytest.fixture(name="scene_folder")
def folder_of_a_scene(request: pytest.FixtureRequest) -> Path:
    """The fixture `scene`, whose name is the module's here."""
    return request.getfixturevalue("scene")


@pytest.mark.parametrize(
    ("file", "kind"), [("gold.json", "json"), ("a.MTLX", "materialx"), ("b.binary", "measured"), ("c.glsl", "shader")]
)
def test_a_material_of_a_file_without_a_type_is_told_the_one_it_needs(file: str, kind: str, scene_folder: Path) -> None:
    described = json.loads((scene_folder / "scene.json").read_text())
    described["scene"]["shapes"][0]["material"] = {"file": file}
    (scene_folder / "scene.json").write_text(json.dumps(described))
    with pytest.raises(go.InputError, match="key 'type' is missing") as refused:
        go.render(scene_folder)
    assert refused.value.hint == f'add "type": "{kind}"'


def test_each_of_several_errors_comes_with_its_hint(scene_folder: Path) -> None:
    described = json.loads((scene_folder / "scene.json").read_text())
    described["integrator"] = {"type": "pth"}
    described["scene"]["shapes"][0]["material"] = {"type": "conducter"}
    (scene_folder / "scene.json").write_text(json.dumps(described))
    with pytest.raises(go.InputError) as refused:
        go.render(scene_folder)
    told = str(refused.value)
    assert all(f"did you mean '{name}'?" in told for name in ("path", "conductor")), told
