"""Inputs that a shader's BRDF reads and nobody sets: parameters where they can be, assigned by `main`, or refused."""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.spirv.compiler import compiler

WO, WI = np.array([[0.0, 0.6, 0.8]]), np.array([[0.6, 0.0, 0.8]])
GLSL = "vec3 brdf(vec3 L, vec3 V, vec3 N) { return %s; }"
WGSL = "fn brdf(L: vec3f, V: vec3f, N: vec3f) -> vec3f { return %s; }"


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


def shader(folder: Path, text: str, suffix: str = "glsl", adapter: str = "", **values: object) -> go.BSDF:
    file = folder / f"own.{suffix}"
    file.write_text(text)
    (folder / f"own.{suffix}.toml").write_text(adapter)
    return go.Shader(file, **values)


def value(folder: Path, text: str, suffix: str = "glsl", adapter: str = "", **values: object) -> np.ndarray:
    """f(WO, WI), without the cosine."""
    return shader(folder, text, suffix, adapter, **values).eval(WO, WI, precision="float64")[0] / 0.8


# ------------------------------------------------------------------ parameters


def test_columns_of_a_matrix_are_parameters_with_the_identity_as_default(tmp_path: Path) -> None:
    text = "uniform mat3 M;\n" + GLSL % "M * vec3(0.1, 0.2, 0.3)"
    np.testing.assert_allclose(value(tmp_path, text), [0.1, 0.2, 0.3], rtol=1e-6)
    np.testing.assert_allclose(value(tmp_path, text, M_1=(2.0, 1.0, 0.0)), [0.5, 0.2, 0.3], rtol=1e-6)
    text = "uniform mat2 M = mat2(0.1, 0.2, 0.3, 0.4);\n" + GLSL % "vec3(M[1], M[0].x)"
    np.testing.assert_allclose(value(tmp_path, text), [0.3, 0.4, 0.1], rtol=1e-6)
    np.testing.assert_allclose(value(tmp_path, text, M_1_y=0.7), [0.3, 0.7, 0.1], rtol=1e-6)


ARRAYS = {
    "glsl": "struct S { float a; vec2 b[2]; };\nuniform vec4 c[3];\nuniform B { S s; };\n"
    + GLSL % "vec3(c[1].xy, s.b[1].y)",
    "hlsl": "struct S { float a; float2 b[2]; };\ncbuffer B { float4 c[3]; S s; };\n"
    "float3 brdf(float3 L, float3 V, float3 N) { return float3(c[1].xy, s.b[1].y); }",
    "wgsl": "struct S { a: f32, b: array<vec2f, 2> }\nstruct B { c: array<vec4f, 3>, s: S }\n"
    "@group(0) @binding(0) var<uniform> u: B;\n" + WGSL % "vec3f(u.c[1].xy, u.s.b[1].y)",
}


@pytest.mark.parametrize("suffix", ARRAYS)
def test_items_of_arrays_and_members_of_structs_are_parameters(tmp_path: Path, suffix: str) -> None:
    given = value(tmp_path, ARRAYS[suffix], suffix, c_1_x=0.1, c_1_y=0.2, s_b_1_y=0.3)
    np.testing.assert_allclose(given, [0.1, 0.2, 0.3], rtol=1e-6)


def test_only_matrices_and_arrays_that_are_read_are_parameters(tmp_path: Path) -> None:
    text = "uniform mat4 projection;\nuniform float c[1000];\nuniform float a;\n" + GLSL % "vec3(a)"
    assert list(shader(tmp_path, text).parameters()) == ["a"]


# ------------------------------------------------------------------ `main`

ASSIGNED = {
    "a uniform": "void main() { rough = roughness; }",
    "a branch": "void main() { if (roughness > 0.2) rough = roughness; else rough = 0.0; }",
    "a helper": "void prepare() { rough = roughness; }\nvoid main() { prepare(); }",
    # a varying is in the way, and the call ends what counts
    "before the call": (
        "in vec2 uv; out vec4 color;\nvoid main() { vec2 at = 2.0 * uv; rough = roughness;\n"
        "color = vec4(brdf(vec3(at, 1), vec3(0, 0, 1), vec3(0, 0, 1)), 1); rough = 0.0; }"
    ),
    "after a discard": "float late = 0.0; void main() { if (roughness < 0.2) discard; rough = roughness; }",
    "before a branch": "in vec2 uv;\nvoid main() { rough = roughness; if (uv.x > 0.0) discard; }",
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("what", ASSIGNED)
def test_globals_have_the_values_that_main_assigns(tmp_path: Path, what: str) -> None:
    text = "uniform float roughness; float rough;\n" + GLSL % "vec3(rough)" + ASSIGNED[what]
    np.testing.assert_allclose(value(tmp_path, text, roughness=0.3), 0.3, rtol=1e-6)


def test_hlsls_main_assigns_and_other_functions_are_not_run(tmp_path: Path) -> None:
    text = """static float rough; static float scale = 2.0;
cbuffer B { float roughness; };
void reset() { scale = 7.0; }
float3 brdf(float3 L, float3 V, float3 N) { return scale * rough; }
float4 main(float2 uv : TEXCOORD0) : SV_Target { rough = roughness; return brdf(uv.xyx, uv.xyx, uv.xyx).rgbr; }
"""
    np.testing.assert_allclose(value(tmp_path, text, "hlsl", roughness=0.3), 0.6, rtol=1e-6)


# ------------------------------------------------------------------ refused

REFUSED = {
    "varying 'uv'": ("glsl", "in vec2 uv;\n" + GLSL % "vec3(uv.x)"),
    "built-in 'gl_FragCoord'": ("glsl", "\n" + GLSL % "vec3(gl_FragCoord.x)"),
    "global 'rough'": ("glsl", "float rough;\n" + GLSL % "vec3(rough)"),
    "global 'seen'": ("glsl", "bool seen;\n" + GLSL % "seen ? vec3(0.1) : vec3(0.2)"),
    "variable 'sum'": ("glsl", "vec3 brdf(vec3 L, vec3 V, vec3 N) {\nfloat sum; sum += L.z; return vec3(sum); }"),
    "'c' (1000 numbers": ("glsl", "uniform float c[1000];\n" + GLSL % "vec3(c[2])"),
    "global 'wide'": ("wgsl", "var<private> wide: f32;\n" + WGSL % "vec3f(wide)"),
    "global 'late'": ("wgsl", "var<private> late: f32;\n" + WGSL % "set(L.x)" + "fn set(x: f32) -> vec3f {\n"
                      "if x > 0.5 { late = 0.3; } return vec3f(late); }"),
    "global 'lobe'": ("hlsl", "static float lobe;\nfloat3 brdf(float3 L, float3 V, float3 N) { return lobe; }"),
    "cube map": ("glsl", "uniform samplerCube t;\n" + GLSL % "texture(t, N).rgb"),
    "3 dimensions": ("glsl", "uniform sampler3D t;\n" + GLSL % "texture(t, N).rgb"),
    "an array of textures": ("glsl", "uniform sampler2DArray t;\n" + GLSL % "texture(t, N).rgb"),
    "'t' is an array of": ("glsl", "uniform sampler2D t[2];\n" + GLSL % "texture(t[1], N.xy).rgb"),
    "shadow": ("glsl", "uniform sampler2DShadow t;\n" + GLSL % "vec3(texture(t, N))"),
    "multisample": ("glsl", "uniform sampler2DMS t;\n" + GLSL % "texelFetch(t, ivec2(0), 0).rgb"),
    "a cube map": ("hlsl", "TextureCube t; SamplerState s;\n"
                   "float3 brdf(float3 L, float3 V, float3 N) { return t.Sample(s, N).rgb; }"),
}  # fmt: skip


@pytest.mark.sample(5)
@pytest.mark.parametrize("what", REFUSED)
def test_an_input_without_a_value_is_refused_by_name_and_line(tmp_path: Path, what: str) -> None:
    suffix, text = REFUSED[what]
    np.save(tmp_path / "table.npy", np.ones((2, 2, 3)))
    adapter = '[textures.t]\nfile = "table.npy"\n' if " t;" in text or " t[" in text else ""
    with pytest.raises(InputError) as error:
        shader(tmp_path, text, suffix, adapter)
    assert what in error.value.what, error.value.what
    assert error.value.where == ("own.wgsl:3" if "late" in what else f"own.{suffix}:2")
    assert error.value.hint


def test_main_that_reads_a_varying_is_refused_only_where_the_brdf_depends_on_it(tmp_path: Path) -> None:
    head = "uniform float roughness; in vec2 uv;\nfloat rough, other;\n"
    main = "void main() {\nother = uv.x; rough = roughness; }"
    np.testing.assert_allclose(value(tmp_path, head + GLSL % "vec3(rough)" + main, roughness=0.3), 0.3, rtol=1e-6)
    with pytest.raises(InputError, match="varying 'uv'") as error:
        value(tmp_path, head + GLSL % "vec3(other)" + main)
    assert error.value.where == "own.glsl:4"
    main = "void main() { if (uv.x > 0.0) { rough = 0.1; } else rough = 0.2; }"
    with pytest.raises(InputError, match="varying 'uv'"):
        value(tmp_path, head + GLSL % "vec3(rough)" + main)


def test_what_the_brdf_does_not_depend_on_may_be_unset(tmp_path: Path) -> None:
    text = """in vec2 uv; float rough; uniform bool mapped;
vec3 brdf(vec3 L, vec3 V, vec3 N) {
    vec3 color; color.x = 0.1; vec3 debug = vec3(uv, rough);
    if (mapped) color = debug;
    float part;
    if (L.z > 0.0) part = 0.2;
    return vec3(color.x, part, 0.3);
}"""
    np.testing.assert_allclose(value(tmp_path, text), [0.1, 0.2, 0.3], rtol=1e-6)
    with pytest.raises(InputError, match="varying 'uv'"):
        value(tmp_path, text, mapped=True)


def test_an_adapter_may_state_that_what_nothing_sets_is_0(tmp_path: Path) -> None:
    text = "in vec2 uv; float rough;\n" + GLSL % "vec3(0.1 + uv.x + rough)"
    np.testing.assert_allclose(value(tmp_path, text, adapter="unset_is_zero = true\n"), 0.1, rtol=1e-6)
