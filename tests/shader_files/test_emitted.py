"""Shaders that `gonio emit` wrote to a folder, read from there by their manifest: the same values, in 64 bits."""

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.cli.app import run
from gonio.errors import GonioError, InputError
from gonio.shaders import Placement, bundle
from gonio.shaders.read_back import recorded, values_of
from gonio.spirv.compiler import compiler

NESTED = {
    "compensated": go.material("kulla-conty(base=conductor,base.alpha=0.35,base.preset=Au)"),
    "nested": go.material("coat(base=oren-nayar)"),
    "mix-of-mixes": go.material("mix(a=lambert,b=mix(a=oren-nayar,b=conductor(alpha=0.3)))"),
    "tables": go.material("turquin(base=conductor(alpha=0.5))"),
    "preset": go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.4),
    "glass": go.material("dielectric(alpha=0.3)"),
    "both-sides": go.material("two-sided(base=conductor(alpha=0.3))"),
}
COUNT = 200


def directions(seed: int, both: bool = False) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(COUNT, 3))
    w[:, 2] = (np.sign(w[:, 2]) if both else 1.0) * (np.abs(w[:, 2]) + 0.01)
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def written(material: go.BSDF, folder: Path, language: str, **more: object) -> str:
    made = bundle(material, language, ("eval", "pdf", "sample"), **more)  # type: ignore[arg-type]
    made.write(folder)
    return str(folder / made.manifest["shader"])


def values(material: go.BSDF, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> dict[str, np.ndarray]:
    drawn = material.sample(wo, u, precision="float64")
    return {
        "eval": material.eval(wo, wi, precision="float64").T,
        "pdf": material.pdf(wo, wi, precision="float64")[None],
        "sample": np.stack([*drawn.wi.T, *drawn.weight.T, drawn.pdf, drawn.delta, drawn.eta]),
    }


def needs_compiler(language: str) -> None:
    if language != "wgsl":
        try:
            compiler()
        except GonioError as error:
            pytest.skip(f"NOT TRIED: {error}")


SLOW = [*(("nested", one) for one in ("wgsl", "glsl", "hlsl")), ("compensated", "glsl"), ("compensated", "hlsl")]
QUICK = [(name, language) for name in NESTED for language in ("wgsl", "glsl", "hlsl") if (name, language) not in SLOW]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "language"), [*QUICK, *(pytest.param(*one, marks=pytest.mark.slow) for one in SLOW)])
def test_folder_read_again_has_the_values_of_its_material(name: str, language: str, tmp_path: Path) -> None:
    needs_compiler(language)
    material = NESTED[name]
    shader = go.Shader(written(material, tmp_path, language, placement=Placement("g_"), constants=True))
    both = material.transmits or name == "both-sides"
    wo, wi, u = directions(1, both), directions(2, both), np.random.default_rng(3).random((COUNT, 3))
    read, plain = values(shader, wo, wi, u), values(material, wo, wi, u)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    shape = {0: (COUNT,), 1: (-1, COUNT)}
    columns = {one["path"]: np.asarray(one["value"], float) for one in manifest["fields"]}
    fields = {path: np.repeat(value, COUNT).reshape(shape[value.ndim]) for path, value in columns.items()}
    given = {"wo": wo.T, "wi": wi.T, "u": u.T}
    with np.errstate(all="ignore"):
        meant = values_of(recorded(material, list(read)), list(read), given, fields)
    for formula, found in read.items():
        rounded = np.stack([np.broadcast_to(one, COUNT) for one in meant[formula]])
        np.testing.assert_allclose(found, rounded, rtol=1e-12, atol=1e-14, err_msg=formula)
        # constants and tables of the text have 32 bits
        np.testing.assert_allclose(found, plain[formula], rtol=3e-5, atol=1e-6, err_msg=formula)
    assert shader.transmits == material.transmits and shader.isotropic == material.isotropic


def test_parameters_have_the_kinds_ranges_and_values_of_the_material(tmp_path: Path) -> None:
    material = NESTED["preset"]
    shader = go.Shader(written(material, tmp_path, "wgsl"))
    assert shader.alpha == (0.3, 0.1) and shader.rotation == 0.4
    assert shader.parameters()["alpha"].high == 1.0
    np.testing.assert_array_equal(shader.eta, material.eta)
    wo, wi = directions(1), directions(2)
    other = go.Shader(written(material, tmp_path, "wgsl"), alpha=0.2, rotation=1.0)
    expected = go.Conductor.preset("Au", alpha=0.2, rotation=1.0).eval(wo, wi, precision="float64")
    np.testing.assert_allclose(other.eval(wo, wi, precision="float64"), expected, rtol=3e-6)


@pytest.mark.slow
def test_value_on_which_tables_depend_is_no_parameter(tmp_path: Path) -> None:
    made = bundle(go.material("coat(base=oren-nayar)"), "wgsl")
    fixed = [one["path"] for one in made.manifest["parameters"] if one["fixed"] and one["field"]]
    made.write(tmp_path)
    shader = go.Shader(str(tmp_path / made.manifest["shader"]))
    assert fixed and not {one.replace(".", "_") for one in fixed} & {*shader.parameters()}


def test_several_materials_are_told_apart_by_the_function(tmp_path: Path) -> None:
    go_module = bundle(["lambert(albedo=0.3)", "conductor(alpha=0.3)"], "wgsl", ("eval", "pdf", "sample"))
    go_module.write(tmp_path)
    file = str(tmp_path / go_module.manifest["shader"])
    told = r"manifest.json: 2 materials, one expected: Lambert_eval, Conductor_eval\n.*--adapter function=Lambert_eval"
    with pytest.raises(InputError, match=told):
        go.Shader(file)
    matte = go.Shader(file, adapter={"function": "Lambert_eval"})
    np.testing.assert_allclose(matte.albedo, 0.3)
    assert list(matte.parameters()) == ["albedo"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"shader": "lambert.wgsl", ', "not a manifest"),
        ('{"shader": "lambert.wgsl"}', "KeyError 'functions'"),
        ('{"shader": "lambert.wgsl", "functions": 3}', "not a manifest of `gonio emit`"),
    ],
)
def test_damaged_manifest_is_refused(text: str, message: str, tmp_path: Path) -> None:
    file = written(go.Lambert(), tmp_path, "wgsl")
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=message):
        go.Shader(file)


def test_manifest_of_another_program_is_left_alone(tmp_path: Path) -> None:
    file = written(go.Lambert(), tmp_path, "wgsl")
    (tmp_path / "manifest.json").write_text('{"name": "a web page"')
    assert list(go.Shader(file).parameters()) == ["albedo"]


def test_file_without_manifest_is_read_by_the_outermost_function(tmp_path: Path) -> None:
    """`-o FILE` writes no manifest: of nested materials the function is taken that no other calls."""
    file = tmp_path / "kc.wgsl"
    file.write_text(bundle(go.material("kulla-conty(base=conductor)"), "wgsl", ("eval", "pdf", "sample")).text)
    shader: object = type(go.Shader(file, adapter={"textures": tables_in(tmp_path)}))
    assert shader.program.adapter.function == "KullaConty_eval"  # type: ignore[attr-defined]
    assert shader.program.adapter.derive == "KullaConty_derive"  # type: ignore[attr-defined]


def tables_in(folder: Path) -> dict[str, object]:
    made = bundle(go.material("kulla-conty(base=conductor)"), "wgsl", ("eval", "pdf", "sample"))
    made.write(folder / "tables")
    return {
        one["uniform"]: {"file": f"tables/{one['file']}", "shape": [*reversed(one["size"]), one["channels"]]}
        for one in made.manifest["textures"]
    }


def test_command_line_judges_an_emitted_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = f"{tmp_path}/kc/"
    assert run(["emit", "kulla-conty", "-p", "base=conductor", "--lang", "wgsl", "--prefix", "g_", "-o", folder]) == 0
    assert run(["check", f"{folder}kulla-conty.wgsl", "kulla-conty(base=conductor)"]) == 0
    assert "right" in capsys.readouterr().out


RESULTS = """uniform vec3 color;
struct Pixel { vec3 diffuse; float k; };
Pixel prepare(vec3 c) { Pixel p; p.diffuse = c * 0.3; p.k = 0.5; return p; }
mat2 both(vec3 a) { return mat2(a.x, a.y, a.z, 1.0 - a.x); }
vec3 BRDF(vec3 L, vec3 V, vec3 N) {
    Pixel p = prepare(color);
    return p.diffuse * p.k * (both(L)[1].y + both(V)[0].x + 2.0);
}
"""


@pytest.mark.parametrize("language", ["glsl", "wgsl", "hlsl", "numpy"])
def test_functions_may_return_vectors_inside_structs_and_matrices(language: str, tmp_path: Path) -> None:
    needs_compiler("glsl")
    (tmp_path / "results.glsl").write_text(RESULTS)
    material = go.Shader(str(tmp_path / "results.glsl"), adapter={"cosine": True})
    wo, wi = directions(1), directions(2)
    expected = material.eval(wo, wi, precision="float64")
    if language == "numpy":
        compile(go.emit(material, "numpy", "eval"), "emitted.py", "exec")
        return
    made = bundle(material, language, ("eval",))
    made.write(tmp_path / "out")
    found = go.Shader(str(tmp_path / "out" / made.manifest["shader"])).eval(wo, wi, precision="float64")
    np.testing.assert_allclose(found, expected, rtol=3e-6)
