"""Shader text against closed forms, on symbols in 64 bits, and constructs that are refused, with their lines."""

import types
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.errors import InputError
from gonio.ops.table import Table
from gonio.spirv import Machine, compile_text, parse
from gonio.spirv.compiler import compiler
from gonio.spirv.images import Texture

X = np.linspace(0.05, 0.95, 7)


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


def value(text: str, name: str = "f", language: str = "glsl", x: np.ndarray = X) -> np.ndarray:
    """f(x) of a shader, in 64 bits."""
    module = parse(compile_text(text, "test", language=language), "test")

    def formula(x: ops.Scalar) -> ops.Scalar:
        machine = Machine(module)
        for start in module.function("main"):
            machine.call(start, ())
        return machine.call(module.function(name)[0], [x])

    return np.asarray(ops.record(formula, x="float").evaluate(x=x))


CASES = {
    "float f(float x) { return pow(x, 3.0) + sqrt(x) * exp(-x) / log2(1.0 + x); }": lambda x: (
        x**3 + np.sqrt(x) * np.exp(-x) / np.log2(1 + x)
    ),
    "float f(float x) { return asin(x) + acos(x) * atan(x, 2.0) + tanh(x) + sinh(x) - tan(x); }": lambda x: (
        np.arcsin(x) + np.arccos(x) * np.arctan2(x, 2) + np.tanh(x) + np.sinh(x) - np.tan(x)
    ),
    "float f(float x) { return mix(x, 2.0, smoothstep(0.0, 1.0, x)) + fract(7.0 * x) + mod(-x, 0.3) + step(0.5, x); }": (  # noqa: E501
        lambda x: x + (2 - x) * (3 - 2 * x) * x * x + (7 * x) % 1 + (-x) % 0.3 + (x >= 0.5)
    ),
    # an early return, a loop with a break that depends on values, a nested loop, and a table of constants
    "float f(float x) { if (x > 0.5) return 1.0; float s = 0.0; for (int i = 0; i < 9; ++i) { s += x; if (s > 1.0) break; } return s; }": (  # noqa: E501
        lambda x: np.where(x > 0.5, 1.0, [next((k * v for k in range(1, 10) if k * v > 1), 9 * v) for v in x])
    ),
    "float f(float x) { float s = 0.0; for (int i = 0; i < 3; ++i) for (int j = 0; j < i; ++j) { if (x > 0.3) continue; s += x; } return s; }": (  # noqa: E501
        lambda x: np.where(x > 0.3, 0.0, 3 * x)
    ),
    "const float t[4] = float[](1.0, 3.0, 2.0, 5.0); float f(float x) { return t[int(4.0 * x)]; }": lambda x: np.array(
        [1.0, 3.0, 2.0, 5.0]
    )[(4 * x).astype(int)],
    "float g(inout float y) { y *= 2.0; return y; } float f(float x) { float y = x; if (x > 0.5) g(y); return y; }": (
        lambda x: np.where(x > 0.5, 2 * x, x)
    ),
    "float f(float x) { mat3 m = mat3(2.0, x, 0.0, 0.0, 1.0, x, x, 0.0, 3.0); return determinant(inverse(m)) + (m * vec3(x, 1.0, 2.0)).y; }": (  # noqa: E501
        lambda x: 1 / (6 + x**3) + x * x + 1
    ),
    "float f(float x) { mat3 m = mat3(2.0, x, 1.0, 0.5, 1.0, x, x, 0.3, 3.0); return 1.0 + (inverse(m) * (m * vec3(x, 1.0, 2.0))).x; }": (  # noqa: E501
        lambda x: 1 + x
    ),
    "float scale = 2.0; float f(float x) { switch (int(3.0 * x)) { case 0: return scale; case 1: scale = x; break; default: scale = 5.0; } return scale; }": (  # noqa: E501
        lambda x: np.select([x < 1 / 3, x < 2 / 3], [2.0 + 0 * x, x], 5.0)
    ),
    "struct S { float a; vec2 b; }; float f(float x) { S s = S(x, vec2(1.0, x)); s.b.y += s.a; return dot(s.b, s.b.yx); }": (  # noqa: E501
        lambda x: 4 * x
    ),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("text", CASES)
def test_shader_equals_its_closed_form(text: str) -> None:
    np.testing.assert_allclose(value(text), CASES[text](X), rtol=1e-6)


def test_hlsl_equals_its_closed_form() -> None:
    text = "float f(float x) { float3 v = float3(x, 1, 2); return dot(saturate(2 * v), v) + lerp(x, 1, rsqrt(4.0)); }"
    np.testing.assert_allclose(value(text, language="hlsl"), np.minimum(2 * X, 1) * X + 3 + (X + 1) / 2, rtol=1e-6)


def test_methods_of_hlsl_structs_are_called_by_their_struct_alone() -> None:
    """A method that no object precedes does not compile, and the same name outside a struct is another function."""
    text = """struct Lobe {
    float width;
    void widen(float by) { if (by > 0) { width *= by; } }
    float half_width() { return 0.5 * width; }
};
float half_width(float x) { return 0.25 * x; }
float f(float x) { Lobe lobe; lobe.width = x; lobe.widen(3.0); return lobe.half_width() + half_width(x); }"""
    np.testing.assert_allclose(value(text, language="hlsl"), 1.75 * X, rtol=1e-6)


def test_hlsl_of_2021_selects_by_a_function() -> None:
    text = "float f(float x) { return dot(select(float2(x, 1) > 0.5, float2(x, 2), float2(0, 0)), float2(1, 1)); }"
    np.testing.assert_allclose(value(text, language="hlsl"), np.where(X > 0.5, X, 0.0) + 2.0)


REFUSED = {
    "discard": "float f(float x) {\n if (x > 0.5) discard;\n return x; }",
    "derivative": "float f(float x) {\n return dFdx(x); }",
    "bit": "float f(float x) {\n return float(floatBitsToInt(x) & 255); }",
    "without a known end": "float f(float x) {\n while (x < 9.0) x *= 1.001;\n return x; }",
    "doubles": "float f(float x) {\n return float(double(x) * 2.0lf); }",
    "an array of": "float a[100000000];\nfloat f(float x) { return a[0] + x; }",
    "recursion": "float f(float x) {\n return f(x); }",
    "atomic": "layout(std430, binding = 0) buffer B { int n; };\nfloat f(float x) { return x * atomicAdd(n, 1); }",
    "write to an image": (
        "layout(r32f, binding = 0) uniform image2D i;\nfloat f(float x) { imageStore(i, ivec2(0), vec4(x)); return x; }"
    ),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("what", REFUSED)
def test_construct_without_meaning_is_refused_by_name_and_line(what: str) -> None:
    with pytest.raises(InputError) as error:
        value(REFUSED[what])
    assert what in error.value.what.lower()
    # types and the linker's messages have no line
    assert error.value.where.startswith("test" if what in ("an array of", "recursion") else "test:2")


HEADER = """/* one text for several languages */
#ifndef HEADER_H
#define HEADER_H
#if defined(__cplusplus)
#include "of_cpp.h"
#else
#include "parts/tools.h"
#endif
#include "header.h"
#endif
"""


def test_headers_are_included_once_and_beside_one_another(tmp_path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "header.h").write_text(HEADER)
    (tmp_path / "parts" / "tools.h").write_text('#pragma once\n#include "more.h"\n#include "../header.h"\n')
    (tmp_path / "parts" / "more.h").write_text("float twice(float x) { return 2.0 * x; }\n")
    text = '#include "header.h"\n#include "parts/tools.h"\nfloat f(float x) { return twice(x); }'
    compile_text(text, "x.glsl", folders=[tmp_path])
    with pytest.raises(InputError, match=r"'of_cpp.h' is not in a folder") as error:
        compile_text(f"#define __cplusplus 1\n{text}", "x.glsl", folders=[tmp_path])
    assert error.value.where.endswith("header.h:5")
    (tmp_path / "parts" / "more.h").write_text('#include "../../outside.h"\n')
    (tmp_path.parent / "outside.h").write_text("float twice(float x) { return 2.0 * x; }\n")
    with pytest.raises(InputError, match=r"outside.h' is not in a folder"):
        compile_text(text, "x.glsl", folders=[tmp_path])


def test_header_of_a_branch_that_is_left_out_is_included_again(tmp_path) -> None:
    (tmp_path / "once.h").write_text("#ifndef ONCE\n#define ONCE\nfloat one() { return 1.0; }\n#endif\n")
    text = '#ifdef ABSENT\n#include "once.h"\n#endif\n#include "once.h"\nfloat f() { return one(); }'
    compile_text(text, "x.glsl", folders=[tmp_path])


def test_include_reads_named_folders_only(tmp_path) -> None:
    (tmp_path / "a.glsl").write_text("float twice(float x) { return 2.0 * x; }\n")
    text = '#include "a.glsl"\nfloat f(float x) { return twice(x) + missing; }'
    with pytest.raises(InputError, match="not in a folder"):
        compile_text(text, "test")
    with pytest.raises(InputError) as error:
        compile_text(text, "test", folders=[tmp_path])
    assert error.value.where == "test:2"
    (tmp_path / "a.glsl").write_text('#include "a.glsl"\n#include "a.glsl"\n')
    with pytest.raises(InputError, match="includes"):
        compile_text(text, "test", folders=[tmp_path])


def test_texels_are_fetched_by_integers() -> None:
    text = "uniform sampler2D t;\nfloat f(float x) { return texelFetch(t, ivec2(int(2.0 * x), 1), 0).r; }"
    module = parse(compile_text(text, "test"), "test")
    table = Texture("t", Table("t", np.arange(4.0).reshape(2, 2, 1)))

    def formula(x: ops.Scalar) -> ops.Scalar:
        return Machine(module, {}, {"t": table}).call(module.function("f")[0], [x])

    np.testing.assert_array_equal(ops.record(formula, x="float").evaluate(x=X), np.where(X < 0.5, 2.0, 3.0))


SIGNS = {
    "uintBitsToFloat((floatBitsToUint(x) & 0x7FFFFFFFu) | (floatBitsToUint(y) & 0x80000000u))": np.copysign,
    "uintBitsToFloat(0x3F800000u | (floatBitsToUint(y) & 0x80000000u))": lambda x, y: np.copysign(1.0, y),
    "uintBitsToFloat((0x80000000u & floatBitsToUint(y)) ^ floatBitsToUint(x))": lambda x, y: x * np.copysign(1.0, y),
    "uintBitsToFloat(floatBitsToUint(x) ^ 0x80000000u)": lambda x, y: -x,
    "uintBitsToFloat(floatBitsToUint(x) & 0x7FFFFFFFu)": lambda x, y: np.abs(x),
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("formula", SIGNS)
def test_signs_are_read_and_written_as_bits(tmp_path: Path, formula: str) -> None:
    text = (
        f"vec3 brdf(vec3 light, vec3 view) {{ float x = light.x; float y = view.y; return vec3(2.0 + {formula}); }}\n"
    )
    (tmp_path / "signs.glsl").write_text(text)
    pairs = np.random.default_rng(1).normal(size=(2, 50, 3))
    pairs[..., 2] = np.abs(pairs[..., 2]) + 0.1
    wo, wi = pairs / np.linalg.norm(pairs, axis=-1, keepdims=True)
    values = go.Shader(tmp_path / "signs.glsl").f(wo, wi, precision="float64")[:, 0]
    np.testing.assert_allclose(values, 2.0 + SIGNS[formula](wi[:, 0], wo[:, 1]), rtol=1e-12)


@pytest.mark.slow
def test_powers_of_negative_numbers_are_nan_in_the_emitted_text_too(tmp_path: Path) -> None:
    (tmp_path / "a.glsl").write_text("float brdf(vec3 L, vec3 V) { return 0.1 + pow(L.x, 2.0) + pow(L.x, -0.5); }")
    material = go.Shader(str(tmp_path / "a.glsl"))
    wo = np.array([[0.0, 0.0, 1.0]] * 3)
    wi = np.array([[-0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.6, 0.0, 0.8]])
    file = types.ModuleType("written")
    exec(compile(go.emit(material, "numpy"), "written.py", "exec"), file.__dict__)
    expected = [np.nan, np.inf, 0.8 * (0.1 + 0.36 + 0.6**-0.5)]
    for values in (material.eval(wo, wi, precision="float64"), file.eval(wo, wi)):
        np.testing.assert_allclose(values[:, 0], expected, rtol=1e-7)


@pytest.mark.slow
def test_nested_loops_of_known_length_are_counted_apart() -> None:
    text = "float f(float x) { float s = 0.0; for (int i = 0; i < %d; ++i) for (int j = 0; j < %d; ++j) %s return s; }"
    np.testing.assert_allclose(value(text % (70, 70, "s += x;")), 4900 * X, rtol=1e-12)
    with pytest.raises(InputError, match="a loop of more than 4096 iterations"):
        value(text % (1, 5000, "s += x;"))
    with pytest.raises(InputError, match="more than 250,000 instructions"):
        value(text % (4000, 4000, "s += 1.0;"))
