"""Shaders as materials: our own shaders against Gonio's materials, adapters, texts, scenes and pickles."""

import json
import pickle
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation, operands, shaders
from gonio.errors import InputError
from gonio.fitting.parameters import free_of
from gonio.scene.materials import described
from gonio.spirv.compiler import compiler
from gonio.spirv.replay import Replayed
from gonio.verify.severity import Grade
from gonio.verify.verdict import Verdict


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


def directions(seed: int, count: int = 200) -> np.ndarray:
    random = np.random.default_rng(seed)
    w = random.normal(size=(count, 3))
    w[:, 2] = np.abs(w[:, 2]) + 0.01
    return w / np.linalg.norm(w, axis=1, keepdims=True)


WO, WI = directions(1), directions(2)

LAMBERT = """#version 300 es
precision highp float;
uniform vec3 albedo;
vec3 brdf(vec3 light, vec3 view) { return albedo / 3.14159265358979; }
"""
BLINN_PHONG = """
cbuffer Parameters { float exponent; };
float3 evalBRDF(float3 N, float3 V, float3 L) {
    float3 H = normalize(L + V);
    return (exponent + 2.0) / 6.283185307 * pow(max(dot(N, H), 0.0), exponent) * max(dot(N, L), 0.0);
}
"""
GGX = """analytic
::begin parameters
float alpha 0.01 1 0.3
bool lit 1
::end parameters
::begin shader
float D(float c) { float t = 1.0 + (alpha * alpha - 1.0) * c * c; return alpha * alpha / (3.14159265358979 * t * t); }
float Lambda(float c) { return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 / (c * c) - 1.0)) - 1.0); }
vec3 BRDF( vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y )
{
    if (dot(N, L) < 0 || !lit) return vec3(0);
    float lambda = 0.0;
    vec3 w[2] = vec3[](L, V);
    for (int i = 0; i < 2; ++i) lambda += Lambda(dot(N, w[i]));
    return vec3(D(dot(N, normalize(L + V))) / (1.0 + lambda) / (4.0 * dot(N, L) * dot(N, V)));
}
::end shader
"""


def written(folder: Path, name: str, text: str) -> str:
    (folder / name).write_text(text)
    return str(folder / name)


def test_lambert_equals_gonios(tmp_path: Path) -> None:
    material = go.Shader(written(tmp_path, "matte.glsl", LAMBERT), albedo=(0.2, 0.5, 0.8))
    expected = go.Lambert(albedo=(0.2, 0.5, 0.8)).eval(WO, WI, precision="float64")
    np.testing.assert_allclose(material.eval(WO, WI, precision="float64"), expected, rtol=1e-6)
    assert material.isotropic
    assert not np.any(material.eval(WO, -WI))


def test_hlsl_with_its_cosine_equals_the_closed_form(tmp_path: Path) -> None:
    file = written(tmp_path, "glossy.hlsl", BLINN_PHONG)
    written(tmp_path, "glossy.hlsl.toml", "cosine = true\n[parameters.exponent]\ndefault = 20\nlow = 0.0\n")
    half = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    expected = 22.0 / (2.0 * np.pi) * half[:, 2] ** 20 * WI[:, 2]
    value = go.Shader(file).eval(WO, WI, precision="float64")
    np.testing.assert_allclose(value[:, 0], expected, rtol=1e-6)


def test_file_of_the_brdf_explorer_equals_gonios_ggx(tmp_path: Path) -> None:
    file = written(tmp_path, "ggx.brdf", GGX)
    expected = go.Conductor(eta=1.0, k=1e9, alpha=0.3).eval(WO, WI, precision="float64")
    np.testing.assert_allclose(go.Shader(file).eval(WO, WI, precision="float64"), expected, rtol=1e-6)
    assert not np.any(go.Shader(file, lit=False).eval(WO, WI))
    assert operands.kind_of(file, operands.MATERIALS, "MODEL") is operands.Kind.TABLE
    material, _ = notation.named(f"{file}(alpha=0.5)")
    assert material.alpha == 0.5
    with pytest.raises(InputError, match=r"2 given|<= 1"):
        notation.named(file, ["alpha=2"])


def test_texture_is_looked_up_between_texel_centers(tmp_path: Path) -> None:
    table = np.random.default_rng(3).random((4, 8, 1))
    np.save(tmp_path / "table.npy", table)
    text = "uniform sampler2D table;\nvec3 BRDF(vec3 L, vec3 V) { return texture(table, vec2(L.z, V.z)).rrr; }\n"
    file = written(tmp_path, "table.glsl", text)
    with pytest.raises(InputError, match="no file"):
        go.Shader(file)
    written(tmp_path, "table.toml", "[textures.table]\nfile = 'table.npy'\n")
    from gonio.ops.table import Table, read_in_numpy

    expected = read_in_numpy(Table("t", table), WO[:, 2], WI[:, 2])[0] * WI[:, 2]
    np.testing.assert_allclose(go.Shader(file).eval(WO, WI, precision="float64")[:, 1], expected, rtol=1e-12)


def test_shader_survives_pickles_json_and_scenes(tmp_path: Path) -> None:
    file = written(tmp_path, "matte.glsl", LAMBERT)
    material = go.Shader(file, albedo=0.25)
    assert pickle.loads(pickle.dumps(material)) == material
    assert notation.from_json(json.loads(json.dumps(notation.as_json(material)))) == material
    part = described(material)
    assert part.instance() == material
    assert pickle.loads(pickle.dumps(part)).instance() == material


def test_a_spectral_picture_of_a_shader_says_why_not(tmp_path: Path, scene: Path) -> None:
    (scene / "matte.glsl").write_text(
        "#version 330\nuniform float albedo;\nvec3 brdf(vec3 L, vec3 V, vec3 N) { return vec3(albedo / 3.14159265); }\n"
    )
    described = json.loads((scene / "scene.json").read_text())
    described["scene"]["shapes"][0]["material"] = {"type": "shader", "file": "matte.glsl", "albedo": 0.5}
    (scene / "scene.json").write_text(json.dumps(described))
    assert np.asarray(go.render(scene)).max() > 0.1
    with pytest.raises(go.InputError, match="supports only red, green and blue") as refused:
        go.render(scene, spectral=True)
    assert refused.value.hint == "render in an RGB variant, such as llvm_ad_rgb"
    assert str(refused.value.where).endswith("/shapes/0/material")


def test_scene_takes_a_shader_from_its_folder_only(tmp_path: Path) -> None:
    from gonio.scene.materials import Material
    from pydantic import TypeAdapter, ValidationError

    folder = tmp_path / "scene"
    folder.mkdir()
    written(tmp_path, "outside.glsl", LAMBERT)
    written(folder, "inside.glsl", LAMBERT)
    adapter = TypeAdapter(Material)
    context = {"folder": folder}
    inside = adapter.validate_python({"type": "shader", "file": "inside.glsl", "albedo": 0.3}, context=context)
    assert inside.instance().albedo == 0.3
    with pytest.raises(ValidationError, match="outside"):
        adapter.validate_python({"type": "shader", "file": "../outside.glsl"}, context=context)
    written(folder, "inside.toml", "[textures.t]\nfile = '../outside.npy'\n")
    with pytest.raises(ValidationError, match="outside"):
        adapter.validate_python({"type": "shader", "file": "inside.glsl"}, context=context)


def test_adopted_shader_reads_as_before(tmp_path: Path) -> None:
    file = written(tmp_path, "matte.glsl", LAMBERT)
    before = go.Shader(file).eval(WO, WI)
    adopted = shaders.adopt(file)
    assert any("albedo" in guess for guess in adopted.guesses)
    written(tmp_path, "matte.glsl.toml", adopted.text)
    np.testing.assert_array_equal(go.Shader(file).eval(WO, WI), before)


BAD = {
    "::begin parameters\nfloat a 0 1\n::end parameters": "declares no parameter",
    "::begin parameters\nfloat a 0 1 x\n::end parameters": "not numbers",
    "::begin parameters\nfloat a 0 nan 1\n::end parameters": "not finite",
    "::begin shader\nvec3 F() { return vec3(0); }\n::end shader": "no function 'BRDF'",
    "::begin shader\nvec3 BRDF(vec3 L) { return vec3(0); }\n::end shader": "5 meanings for the 1",
}


@pytest.mark.parametrize("text", BAD)
def test_broken_file_of_the_brdf_explorer_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=BAD[text]):
        go.Shader(written(tmp_path, "bad.brdf", f"analytic\n{text}\n"))


BAD_ADAPTERS = {
    "functoin = 'f'": "unknown key 'functoin'",
    "cosine = 1": "a bool expected",
    "arguments = ['lihgt']": "unknown meaning",
    "[parameters.a]\ndefault = 1": "no uniform 'a'",
    "[parameters.albedo]\ndefault = 'x'": "wrong type",
    "a = [": "not an adapter",
    "function = 'g'": "no function 'g'",
}


@pytest.mark.parametrize("text", BAD_ADAPTERS)
def test_broken_adapter_is_refused(tmp_path: Path, text: str) -> None:
    file = written(tmp_path, "matte.glsl", LAMBERT)
    written(tmp_path, "matte.glsl.toml", text)
    with pytest.raises(InputError, match=BAD_ADAPTERS[text]):
        go.Shader(file)


def test_compilers_message_has_the_users_line(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        go.Shader(written(tmp_path, "bad.glsl", LAMBERT + "float f() { return missing; }\n"))
    assert error.value.where == "bad.glsl:5"


def test_missing_compiler_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gonio.spirv import compiler as module

    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(module.sys, "path", [])
    monkeypatch.setattr(module.shutil, "which", lambda *args, **options: None)
    module.compiler.cache_clear()
    try:
        with pytest.raises(go.MachineError, match="pip install"):
            go.Shader(written(tmp_path, "matte.glsl", LAMBERT))
    finally:
        module.compiler.cache_clear()


def test_replayed_recording_has_the_bits_of_the_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(tmp_path, "ggx.brdf", GGX)
    replayed = [go.Shader(file, alpha=0.2).eval(WO, WI, precision=p) for p in ("float32", "float64")]
    dark = go.Shader(file, lit=False).eval(WO, WI)
    monkeypatch.setattr(Replayed, "__call__", lambda self, **inputs: self.function(**inputs))
    direct = [go.Shader(file, alpha=0.2).eval(WO, WI, precision=p) for p in ("float32", "float64")]
    np.testing.assert_array_equal(replayed, direct)
    assert not np.any(dark)


SAMPLED = """
struct Drawn { vec3 wi; vec3 weight; float pdf; };
vec3 f(vec3 light, vec3 view) { return vec3(0.25 / 3.14159265358979); }
float density(vec3 light, vec3 view) { return 0.25 / 3.14159265358979; }
Drawn drawn(vec3 view, vec3 u) {
    float z = 1.0 - 2.0 * u.x, r = sqrt(1.0 - z * z), phi = 6.283185307 * u.y;
    return Drawn(vec3(r * cos(phi), r * sin(phi), z), vec3(abs(z)), 0.25 / 3.14159265358979);
}
"""


def test_samples_below_an_opaque_surface_fail(tmp_path: Path) -> None:
    file = written(tmp_path, "sphere.glsl", SAMPLED)
    adapter = "function = 'f'\npdf = 'density'\nsample = 'drawn'\nsample_arguments = ['view', 'u']\n"
    written(tmp_path, "sphere.glsl.toml", adapter)
    material = go.Shader(file)
    drawn = material.sample(WO, np.random.default_rng(1).random((len(WO), 3)))
    below = np.asarray(drawn.wi)[:, 2] < 0.0
    assert 0.3 < below.mean() < 0.7
    np.testing.assert_array_equal(np.asarray(drawn.pdf)[below], 0.0)
    assert not np.any(np.asarray(drawn.weight)[below]) and np.all(np.asarray(drawn.weight)[~below] > 0.0)
    np.testing.assert_allclose(np.asarray(drawn.pdf)[~below], material.pdf(WO, drawn.wi)[~below], rtol=1e-6)


def test_the_page_of_a_shader_names_its_file(tmp_path: Path) -> None:
    shader = tmp_path / "red.wgsl"
    shader.write_text("fn brdf(L: vec3f, V: vec3f, N: vec3f) -> vec3f { return vec3f(0.3, 0.1, 0.1); }\n")
    assert str(go.explain(str(shader))).endswith(f"Source: {shader}")


LOSSY = """
uniform float share;
vec3 brdf(vec3 L, vec3 V) { return vec3((1.0 - share * V.z) / 3.14159265358979); }
float right(float NoV) { return 1.0 - share * NoV; }
float squared(float NoV) { return right(NoV) * right(NoV); }
"""


def test_uniforms_with_initial_values_are_parameters_of_these_defaults(tmp_path: Path) -> None:
    """As in the shaders that MaterialX writes."""
    text = """
uniform float share = 0.25;
uniform vec3 tint = vec3(1.0, 0.5, 0.0);
uniform bool doubled = true;
const float scale = 2.0;
vec3 brdf(vec3 L, vec3 V) { return (doubled ? scale : 1.0) * share * tint; }
"""
    file = written(tmp_path, "initial.glsl", text)
    up = np.array([[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(go.Shader(file).eval(up, up), [[0.5, 0.25, 0.0]], rtol=1e-6)
    np.testing.assert_allclose(go.Shader(file, share=0.4, doubled=False).eval(up, up), [[0.4, 0.2, 0.0]], rtol=1e-6)


def energy_of(file: str) -> Verdict:
    return go.verify(go.Shader(file), law="energy", quick=True).cards[0].verdicts[0]


@pytest.mark.slow
def test_loss_is_judged_where_the_adapter_means_none(tmp_path: Path) -> None:
    range_ = "function = 'brdf'\n[parameters.share]\ndefault = 0.5\nlow = 0.5\nhigh = 0.5\n"
    for name, claim, status in (("silent", "", "pass"), ("lossy", "lossless_tolerance = 0.1\n", "fail")):
        file = written(tmp_path, f"{name}.glsl", LOSSY)
        written(tmp_path, f"{name}.glsl.toml", claim + range_)
        assert energy_of(file).status == status
    assert any(
        "loss in a white furnace: 0.5000 at 0 degrees, more than the declared 0.1" in one for one in energy_of(file).why
    )


@pytest.mark.slow
def test_claim_of_a_shader_that_is_black_at_its_given_values_fails(tmp_path: Path) -> None:
    file = written(tmp_path, "black.glsl", "vec3 brdf(vec3 L, vec3 V, float weight) { return vec3(weight); }")
    adapter = "function = 'brdf'\nlossless_tolerance = 0.1\n[parameters.weight]\ndefault = 0\nlow = 0\nhigh = 0\n"
    written(tmp_path, "black.glsl.toml", adapter)
    verdict = energy_of(file)
    assert verdict.status == "fail" and verdict.grade is Grade.BROKEN
    assert any("loss in a white furnace: 1.0000" in one for one in verdict.why)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "status"), [("right", "pass"), ("squared", "fail")])
def test_albedo_that_a_shader_states_is_judged(tmp_path: Path, name: str, status: str) -> None:
    file = written(tmp_path, "stated.glsl", LOSSY)
    adapter = f"function = 'brdf'\nalbedo = '{name}'\n[parameters.share]\ndefault = 0.5\nlow = 0.0\nhigh = 0.9\n"
    written(tmp_path, "stated.glsl.toml", adapter)
    verdict = energy_of(file)
    assert verdict.status == status
    if status == "fail":
        assert "the stated albedo, squared, is " in verdict.cause
        assert verdict.grade is Grade.BROKEN


def test_claims_of_an_adapter_are_checked(tmp_path: Path) -> None:
    file = written(tmp_path, "stated.glsl", LOSSY)
    claims = (
        ("lossless_tolerance = 2.0", "a share of the light"),
        ("albedo_tolerance = nan", "a share of the light"),
        ("lossless_tolerance = true", "a float expected"),
        ("albedo = 'none'", "no function"),
    )
    for line, message in claims:
        written(tmp_path, "stated.glsl.toml", f"function = 'brdf'\n{line}\n")
        with pytest.raises(InputError, match=message):
            go.Shader(file)


MIXED = """
uniform float metal;
vec3 brdf(vec3 L, vec3 V) { return vec3((1.0 - metal * (1.0 - metal)) / 3.14159265358979); }
"""


@pytest.mark.slow
def test_loss_of_mixed_parameters_is_explained(tmp_path: Path) -> None:
    file = written(tmp_path, "mixed.glsl", MIXED)
    adapter = "function = 'brdf'\nlossless_tolerance = 0.02\n[parameters.metal]\ndefault = 0.5\nlow = 0.0\nhigh = 1.0\n"
    written(tmp_path, "mixed.glsl.toml", adapter)
    assert "0.0000 at metal = 1: are parameters mixed instead of two lobes?" in energy_of(file).cause
    written(tmp_path, "mixed.glsl.toml", adapter.replace("high = 1.0", "high = 0.5"))
    shaders.files.forget()
    assert "the loss depends on metal: 0.0000 at metal = 0 and 0.2500 at metal = 0.5" in energy_of(file).cause


@pytest.mark.slow
def test_energy_of_values_that_are_not_finite_has_the_grade_of_nan(tmp_path: Path) -> None:
    verdict = energy_of(written(tmp_path, "root.glsl", "vec3 brdf(vec3 L, vec3 V) { return vec3(sqrt(L.z - 0.2)); }"))
    assert verdict.status == "fail" and verdict.grade is Grade.NAN
    assert verdict.bias is not None and 0.1 < verdict.bias.average < 0.4


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_powers_of_emitted_text_hold_in_both_precisions(tmp_path: Path, precision: str) -> None:
    """`power` of emitted text reads the exponent of a number from its bits; 32 bits had lost the mantissa."""
    phong = go.model("blinn-phong")(ks=0.5, p=20.0)
    (file := tmp_path / "phong.glsl").write_text(go.emit(phong, "glsl", functions=["eval"]))
    read = go.Shader(file, kd=0.5, ks=0.5, p=20.0)
    w = np.random.default_rng(3).normal(size=(2, 200, 3))
    w[..., 2] = np.abs(w[..., 2])
    wo, wi = w / np.linalg.norm(w, axis=-1, keepdims=True)
    values = [one.eval(wo, wi, precision=precision) for one in (read, phong)]
    np.testing.assert_allclose(*values, rtol=2e-5, atol=1e-7)


def test_a_fit_frees_a_uniform_that_is_1(tmp_path: Path) -> None:
    """A uniform of 1 may be anything; of Gonio's own metals it is a factor on another color, which fits hold."""
    (file := tmp_path / "gloss.glsl").write_text(
        "uniform float gloss;\nvec3 brdf(vec3 L, vec3 V, vec3 N) { return vec3(0.1 + 0.2 * gloss * dot(N, L)); }\n"
    )
    Path(f"{file}.toml").write_text("[parameters.gloss]\ndefault = 1.0\nlow = 0.0\nhigh = 1.0\n")
    assert [one.path for one in free_of(go.Shader(file), {})] == ["gloss"]
    assert "albedo" not in [one.path for one in free_of(go.Conductor(), {})]


def test_quoted_include_is_found_beside_the_shader(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    (folder / "parts").mkdir(parents=True)
    (folder / "named").mkdir()
    written(folder, "half.glsl", '#include "parts/more.glsl"\nfloat half_of(float x) { return more(0.5 * x); }')
    written(folder / "parts", "more.glsl", '#include "least.glsl"\nfloat more(float x) { return x + LEAST; }')
    written(folder / "parts", "least.glsl", "#define LEAST 0.1\n")
    written(folder / "named", "half.glsl", "float half_of(float x) { return 0.0; }")
    text = "#include %s\nvec3 brdf(vec3 L, vec3 V) { return vec3(half_of(0.4)); }"
    file = written(folder, "a.glsl", text % '"half.glsl"')
    for adapter in ("", "includes = ['named']"):
        written(folder, "a.glsl.toml", adapter)
        np.testing.assert_allclose(go.Shader(file).eval(WO, WI, precision="float64")[:, 0], 0.3 * WI[:, 2], rtol=1e-6)
    written(tmp_path, "outside.glsl", "float half_of(float x) { return x; }")
    for name in ('"../outside.glsl"', "<outside>"):
        written(folder, "b.glsl", text % name)
        with pytest.raises(InputError, match=r"outside.* is not in a folder"):
            go.Shader(str(folder / "b.glsl"))


@pytest.mark.parametrize("suffix", ["glsl", "hlsl"])
def test_messages_name_the_included_file(tmp_path: Path, suffix: str) -> None:
    written(tmp_path, f"lib.{suffix}", "float half_of(float x) {\n  discard; return x; }\n")
    types = ("vec3", "vec3(half_of(0.4))") if suffix == "glsl" else ("float3", "half_of(0.4)")
    text = '#include "lib.%s"\nT brdf(T L, T V) { return %s; }'.replace("T", types[0])
    file = written(tmp_path, f"a.{suffix}", text % (suffix, types[1]))
    with pytest.raises(InputError, match="discard") as error:
        go.Shader(file)
    assert error.value.where == f"{tmp_path / f'lib.{suffix}'}:2"
    written(tmp_path, f"lib.{suffix}", "\nfloat half_of(float x) { return missing; }\n")
    with pytest.raises(InputError, match="missing") as error:
        go.Shader(file)
    assert error.value.where == f"{tmp_path / f'lib.{suffix}'}:2"


def test_texel_at_constant_coordinates_meets_values(tmp_path: Path) -> None:
    text = """uniform sampler2D t;
vec3 brdf(vec3 L, vec3 V) { return L.z * (texture(t, vec2(0.75, 0.25)).rgb + texelFetch(t, ivec2(0, 1), 0).rgb); }"""
    np.save(tmp_path / "table.npy", np.arange(4.0).reshape(2, 2, 1) / 30)
    written(tmp_path, "a.glsl.toml", '[textures.t]\nfile = "table.npy"\nfilter = "nearest"\n')
    made = go.Shader(written(tmp_path, "a.glsl", text))
    np.testing.assert_allclose(made.eval(WO, WI, precision="float64")[:, 0], 0.1 * WI[:, 2] ** 2, rtol=1e-6)


@pytest.mark.parametrize(("one", "other"), [("pdf", "sample"), ("sample", "pdf")])
def test_a_density_and_its_samples_are_named_together(tmp_path: Path, one: str, other: str) -> None:
    text = "vec3 BRDF(vec3 L, vec3 V) { return vec3(0.3); } float density(vec3 L, vec3 V) { return 5.0; }"
    (tmp_path / "one.glsl").write_text(text)
    with pytest.raises(go.InputError, match=f"{one} = 'density' without {other}"):
        go.Shader(str(tmp_path / "one.glsl"), adapter={one: "density"}).pdf([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("name", "meaning"),
    [("VoL", "l.v"), ("LdotV", "l.v"), ("HoL", "l.h"), ("HoV", "l.h"), ("LdotN", "n.l")],
)
def test_names_of_cosines_are_known(tmp_path: Path, name: str, meaning: str) -> None:
    (tmp_path / "one.glsl").write_text(f"vec3 BRDF(float NoL, float NoV, float {name}) {{ return vec3({name}); }}")
    model = go.Shader(str(tmp_path / "one.glsl"))
    assert type(model).program.adapter.arguments[2] == meaning  # type: ignore[attr-defined]


TYPED = """vec3 f(vec3 V, vec3 L) {{ return vec3(0.3); }} float d(vec3 V, vec3 L) {{ return 0.3; }}
{} s(vec3 V, {} u) {{ return {}; }}"""


@pytest.mark.parametrize(
    ("code", "arguments", "what", "place"),
    [
        (TYPED.format("float", "vec3", "0.5"), ["view", "u"], "'s' returns float, a direction expected", "sample"),
        (TYPED.format("vec3", "float", "V"), ["view", "u"], "'u' given for an argument of type float", "arguments"),
        (TYPED.format("vec3", "vec3", "V"), ["view", "n.l"], "'n.l' given for an argument of type vec3", "arguments"),
    ],
)
def test_meanings_fit_the_types_of_arguments(
    tmp_path: Path, code: str, arguments: list[str], what: str, place: str
) -> None:
    (tmp_path / "one.glsl").write_text(code)
    adapter = {"function": "f", "arguments": ["view", "light"], "pdf": "d", "pdf_arguments": ["view", "light"]}
    with pytest.raises(go.InputError, match=what) as error:
        go.Shader(str(tmp_path / "one.glsl"), adapter={**adapter, "sample": "s", "sample_arguments": arguments})
    assert error.value.where.endswith(place)
