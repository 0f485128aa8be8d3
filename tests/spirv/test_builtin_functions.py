"""Built-in functions have the values that the languages define, also for NaN and on the bits of constants."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.spirv import arithmetic

WO, WI = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, -0.6, 0.8]])  # L.z = 0.8; NAN below is the root of -0.8
NAN = "sqrt(-L.z)"
GLSL = {
    "isnan(1.0 / L.z) ? 1.0 : 2.0": 2.0,
    f"isnan({NAN}) ? 1.0 : 2.0": 1.0,
    f"isinf({NAN}) ? 1.0 : 2.0": 2.0,
    "isinf(1.0 / (L.z - L.z)) ? 1.0 : 2.0": 1.0,
    f"any(isnan(vec3(L.z, {NAN}, 1.0))) ? 1.0 : 2.0": 1.0,
    f"({NAN}) != ({NAN}) ? 1.0 : 2.0": 1.0,
    "L.z != L.z ? 1.0 : 2.0": 2.0,
    "mod(-1.5 * L.z, 1.0)": 0.8,
    "float(bitfieldReverse(3u)) * 2.3283064365386963e-10": 0.75,
    "float(bitCount(-1))": 32.0,
    "float(bitfieldExtract(-256, 4, 8))": -16.0,
    "float(bitfieldExtract(0xABCDu, 4, 8))": 188.0,
    "float(bitfieldInsert(0xFFFFu, 0u, 4, 8))": 61455.0,
    "ldexp(L.z, -2)": 0.2,
}
HLSL = {
    f"isnan({NAN}) ? 1.0 : 2.0": 1.0,
    "fmod(-1.5 * L.z, 1.0)": -0.2,
    "fmod(float2(2.5, -2.5) * 0.8, float2(1.5, 1.5)).y": -0.5,
    "lit(1.0, 0.5, 3.0).z": 0.125,
    "lit(-L.z, 0.5, 3.0).z + lit(-L.z, 0.5, 3.0).y": 0.0,
    "saturate(2.0 * L.z) + saturate(-L.z) + saturate(0.5 * L.z)": 1.4,
    "ldexp(L.z, 1)": 1.6,
}
WGSL = {
    "ldexp(L.z, -2)": 0.2,
    "f32(reverseBits(3u)) * 2.3283064365386963e-10": 0.75,
    "f32(countOneBits(-1))": 32.0,
    "f32(extractBits(-256, 4u, 8u))": -16.0,
    "f32(insertBits(65535u, 0u, 4u, 8u))": 61455.0,
    "modf(-3.2 * L.z).whole": -2.0,
}
TEXTS = {
    "glsl": "vec3 BRDF(vec3 L, vec3 V, vec3 N) {{ return vec3({}); }}",
    "hlsl": "float3 BRDF(float3 L, float3 V, float3 N) {{ return {}; }}",
    "wgsl": "fn BRDF(L: vec3f, V: vec3f, N: vec3f) -> vec3f {{ return vec3f({}); }}",
}


def value(folder: Path, language: str, text: str) -> float:
    file = folder / f"shader.{language}"
    file.write_text(text)
    model = go.Shader(str(file), adapter={"cosine": True})
    return float(model.eval(WO, WI, precision="float64")[0, 0])


@pytest.mark.parametrize(
    ("language", "expression", "expected"),
    [(language, *row) for language, rows in (("glsl", GLSL), ("hlsl", HLSL), ("wgsl", WGSL)) for row in rows.items()],
)
def test_a_function_has_its_value(tmp_path: Path, language: str, expression: str, expected: float) -> None:
    assert value(tmp_path, language, TEXTS[language].format(expression)) == pytest.approx(expected, abs=1e-6)


def test_modf_writes_the_whole_part_to_its_argument(tmp_path: Path) -> None:
    text = "vec3 BRDF(vec3 L, vec3 V, vec3 N) { vec3 whole; vec3 rest = modf(-3.2 * L, whole); return rest - whole; }"
    file = tmp_path / "modf.glsl"
    file.write_text(text)
    got = go.Shader(str(file), adapter={"cosine": True}).eval(WO, WI, precision="float64")[0]
    whole = np.trunc(-3.2 * WI[0])
    np.testing.assert_allclose(got, -3.2 * WI[0] - 2.0 * whole, atol=1e-6)


@pytest.mark.parametrize(
    ("language", "text", "what", "line"),
    [
        ("hlsl", "float3 BRDF(float3 L, float3 V, float3 N) {{\n{m} return m._m00_m11_m22; }}", "_m00_m11_m22", ":2"),
        (
            "hlsl",
            "float3 BRDF(float3 L, float3 V, float3 N) {{\n{m} return (m * m)[0]; }}",
            "a * b of two matrices",
            "",
        ),
        (
            "wgsl",
            "\nfn BRDF(L: vec3f, V: vec3f, N: vec3f) -> vec3f {{ if L.z > 0.5 {{ return L; }} }}",
            "may end",
            ":2",
        ),
        ("glsl", "vec3 BRDF(vec3 L, vec3 V, vec3 N) {{ int e; return vec3(frexp(L.z, e)); }}", "frexp", ":1"),
    ],
)
def test_what_would_have_another_value_is_refused(
    tmp_path: Path, language: str, text: str, what: str, line: str
) -> None:
    m = "float3x3 m = float3x3(1, 2, 3, 4, 5, 6, 7, 8, 9);"
    with pytest.raises(go.InputError, match=what.replace("*", r"\*")) as error:
        value(tmp_path, language, text.format(m=m))
    assert error.value.where.endswith(f"shader.{language}{line}")


@pytest.mark.parametrize(
    "body",
    [
        "if L.z > 0.5 { return L; } else { return V; }",
        "var i = 0; loop { if i > 1 { return L; } i++; }",
        "switch 2 { case 1: { return V; } default: { return L; } }",
        "for (var i = 0; i < 3; i++) { if i == 1 { return L; } } return V;",
    ],
)
def test_a_function_that_returns_on_each_path_is_accepted(tmp_path: Path, body: str) -> None:
    text = f"fn BRDF(L: vec3f, V: vec3f, N: vec3f) -> vec3f {{ {body} }}"
    assert value(tmp_path, "wgsl", text) == pytest.approx(WI[0, 0], abs=1e-6)


def test_vectors_of_unequal_sizes_are_not_added() -> None:
    assert arithmetic.elementwise(arithmetic.add, (1.0, 2.0), 3.0) == (4.0, 5.0)
    with pytest.raises(ValueError, match=r"vectors of \[2, 3\] components"):
        arithmetic.elementwise(arithmetic.add, (1.0, 2.0), (3.0, 4.0, 5.0))
