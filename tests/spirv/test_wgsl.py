"""WGSL text against closed forms, on symbols in 64 bits, and constructs that are refused, with their lines."""

import contextlib
import time
from pathlib import Path

import numpy as np
import pytest
from gonio import ops
from gonio.errors import InputError
from gonio.spirv import Machine
from gonio.spirv.wgsl import translated

X = np.linspace(0.06, 0.97, 7)


def value(text: str, defines: dict[str, str] | None = None, folders: tuple[Path, ...] = ()) -> np.ndarray:
    """f(x) of a shader, in 64 bits."""
    module = translated(text, "test", defines or {}, folders)

    def formula(x: ops.Scalar) -> ops.Scalar:
        return Machine(module).call(module.function("f")[0], [x])

    return np.asarray(ops.record(formula, x="float").evaluate(x=X))


CASES = {
    "return pow(x, 3.0) + sqrt(x) * exp(-x) / log2(1.0 + x);": X**3 + np.sqrt(X) * np.exp(-X) / np.log2(1 + X),
    "return asin(x) + acos(x) * atan2(x, 2) + tanh(x) + sinh(x) - tan(x);": (
        np.arcsin(X) + np.arccos(X) * np.arctan2(X, 2) + np.tanh(X) + np.sinh(X) - np.tan(X)
    ),
    "return mix(x, 2, smoothstep(0, 1, x)) + fract(7 * x) + -x % 0.25 + step(0.5, x) + saturate(3 * x) + modf(9 * x).whole;": (  # noqa: E501
        X
        + (2 - X) * (3 - 2 * X) * X * X
        + (7 * X) % 1
        + np.fmod(-X, 0.25)
        + (X >= 0.5)
        + np.minimum(3 * X, 1)
        + np.floor(9 * X)
    ),
    # an early return, loops with breaks that depend on values, a nested loop, and a table of constants
    "if (x > 0.5) { return 1.0; } var s = 0.0; for (var i = 0; i < 9; i++) { s += x; if s > 1.0 { break; } } return s;": (  # noqa: E501
        np.where(X > 0.5, 1.0, [next((k * v for k in range(1, 10) if k * v > 1), 9 * v) for v in X])
    ),
    "var s = 0.0; for (var i = 0; i < 3; i++) { for (var j = 0u; j < u32(i); j += 1) { if x > 0.3 { continue; } s += x; } } return s;": (  # noqa: E501
        np.where(X > 0.3, 0.0, 3 * X)
    ),
    "var i = 0; var s = 0.0; loop { if i >= 3 || large(x) { break; } s += x; continuing { i += 1; break if i > 7; } } return s;": (  # noqa: E501
        np.where(X > 0.5, 0.0, 3 * X)
    ),
    "var i = 4; var s = 0.0; while i > 0 { i--; s += f32(i) * x; } return s;": 6 * X,
    "return t[i32(4 * x)] + t[1];": np.array([1.0, 3.0, 2.0, 5.0])[(4 * X).astype(int)] + 3.0,
    "var y = x; if (x > 0.5) { _ = doubled(&y); } else if x > 0.25 { y = 7; } else { let p = &y; *p -= 1; } return y;": (  # noqa: E501
        np.select([X > 0.5, X > 0.25], [2 * X, 7.0], X - 1)
    ),
    "switch i32(3.0 * x) { case 0 { return scale; } case 1, 8: { scale = x; } default: { scale = 5.0; } } return scale;": (  # noqa: E501
        np.select([X < 1 / 3, X < 2 / 3], [2.0 + 0 * X, X], 5.0)
    ),
    "var s = S(x, vec2(1, x)); s.b.y += s.a; let q = &s; (*q).b.x += 0.0; return dot(s.b, s.b.yx);": 4 * X,
    "var v = vec4f(x); v.xz = vec2f(2, 3); v[1] *= 2; return v.x + v.g + v.z * v.a;": 2 + 5 * X,
    "let m = mat3x3f(2, x, 0, 0, 1, x, x, 0, 3); return (m * vec3(x, 1, 2)).y + determinant(m) + (transpose(m) * m[0]).x;": (  # noqa: E501
        X * X + 1 + 6 + X**3 + 4 + X * X
    ),
    "return select(x, 1.0, x > 0.5 && !(x < 0.3)) + f32(all(vec2(x) < vec2(0.5, 0.7))) + f32(dot(vec2i(1, 2), vec2i(3)));": (  # noqa: E501
        np.where(X > 0.5, 1.0, X) + (X < 0.5) + 9
    ),
    "return f32(bitcast<i32>(x) >> 23) + f32(0x10u >> 2u) + f32(~0) + f32(5 / 2) + f32(-7 % 3) + SMALL + f32(COUNT);": (
        np.floor(np.log2(X)) + 127 + 4 - 1 + 2 - 1 + np.float32(0.1) + 4
    ),
    "let v: vec3<f32> = vec3<f32>(vec2(1, 2), x); const k = vec3(1, 2, 3); return length(v) * dot(normalize(v), v - vec3f(k));": (  # noqa: E501
        X * (X - 3)
    ),
    "if x < 0.3 { if (x >= 0.2) == (x > 0.1) { return 1; } } return f32(1 << 3 | 1) + f32(x > 0.5 & true);": (
        np.where((X < 0.3) & ((X >= 0.2) == (X > 0.1)), 1.0, 9.0 + (X > 0.5))
    ),
}
AROUND = """
enable f16; /* nested /* comment */ */
alias Real = f32;
struct S { a: Real, @align(16) b: vec2<f32>, }
const COUNT = 2 + 2;
const SMALL: f32 = 0.1;
const t = array<f32, COUNT>(1.0, 3.0, 2.0, 5.0);
const_assert COUNT == 4;
var<private> scale: f32 = 2.0;
fn doubled(y: ptr<function, f32>) -> f32 { *y *= 2.0; return *y; }
fn large(x: f32) -> bool { return x > 0.5; }
@fragment fn main() -> @location(0) vec4f { return vec4f(dpdx(1.0)); }
"""


@pytest.mark.parametrize("body", CASES)
def test_shader_equals_its_closed_form(body: str) -> None:
    np.testing.assert_allclose(value(f"{AROUND}fn f(x: f32) -> f32 {{ {body} }}"), CASES[body], rtol=1e-12)


REFUSED = {
    "discard": "fn f(x: f32) -> f32 {\n if (x > 0.5) { discard; }\n return x; }",
    "derivative": "fn f(x: f32) -> f32 {\n return dpdx(x); }",
    "bit operation": "fn f(x: f32) -> f32 {\n return f32(bitcast<i32>(x) & 255); }",
    "without a known end": "fn f(x: f32) -> f32 { var y = x;\n while y < 9.0 { y *= 1.001; }\n return y; }",
    "16-bit": "fn f(x: f32) -> f32 {\n return f32(f16(x)); }",
    "an array of": "fn f(x: f32) -> f32 {\n var a: array<f32, 100000000>; return a[0] + x; }",
    "recursion": "fn f(x: f32) -> f32 {\n return f(x); }",
    "atomic": "var<storage, read_write> n: atomic<i32>; fn f(x: f32) -> f32 {\n return x * f32(atomicAdd(&n, 1)); }",
    "write to an image": "fn f(x: f32) -> f32 {\n textureStore(i, vec2i(0), vec4f(x)); return x; }",
    "depends on itself": "const a = b + 1;\nconst b = a; fn f(x: f32) -> f32 {\n return x + f32(a); }",
    "f32, i32": "fn f(x: f32) -> f32 { let i: i32 = 2;\n return x * i; }",
    "unknown name": "fn f(x: f32) -> f32 {\n return y; }",
    "unknown function": "fn f(x: f32) -> f32 {\n return sine(x); }",
    "no member": "fn f(x: f32) -> f32 {\n return vec2(x).z; }",
    "the index 4": "fn f(x: f32) -> f32 {\n return array(x, x)[4]; }",
    "nested": f"fn f(x: f32) -> f32 {{\n return {'(' * 1000}x{')' * 1000}; }}",
    "is expected": "fn f(x: f32) -> f32 {\n return x +; }",
    "character": "fn f(x: f32) -> f32 {\n return x $ 2; }",
    "without a length": "fn f(x: f32) -> f32 {\n var a: array<f32>; return x; }",
    "directive": "fn f(x: f32) -> f32 {\n#include <x>\n return x; }",
    "twice": "fn f(x: f32) -> f32 { return x; }\nfn f(x: f32) -> f32 { return x; }",
}


@pytest.mark.parametrize("what", REFUSED)
def test_construct_without_meaning_is_refused_by_name_and_line(what: str) -> None:
    with pytest.raises(InputError) as error:
        value(REFUSED[what])
    assert what in error.value.what.lower()
    # a function is declared on the first line; recursion has none
    assert error.value.where in (("", "test:2") if what == "recursion" else ("test:1", "test:2")), error.value.where


BOMBS = {
    "functions": "\n".join(f"fn g{n}(x: f32) -> f32 {{ return x; }}" for n in range(30_000)),
    "a chain": f"fn f(x: f32) -> f32 {{ return {'x + ' * 5_000} x; }}",
    "constants": "\n".join(f"const a{n} = array<f32, 65536>();" for n in range(3000))
    + f"fn f(x: f32) -> f32 {{ return x{''.join(f' + a{n}[0]' for n in range(3000))}; }}",
    "structs": "struct A0 { a: array<f32, 60000> }"
    + "".join(f"struct A{n + 1} {{ a: A{n}, b: A{n} }}" for n in range(30))
    + "fn f(x: f32) -> f32 { var a: A30; return x; }",
    "references": "".join(f"const a{n} = a{n + 1};" for n in range(5000))
    + "const a5000 = 1.0; fn f(x: f32) -> f32 { return x + a0; }",
    "lists": f"fn f(x: f32) -> f32 {{ var a: {'array<' * 5000}; return x; }}",
    "signs": f"fn f(x: f32) -> f32 {{ return {'-' * 100_000}x; }}",
    "comments": "/*" * 100_000,
}


_LONG = ("functions", "constants", "a chain")


@pytest.mark.parametrize("what", [pytest.param(one, marks=[pytest.mark.slow] * (one in _LONG)) for one in BOMBS])
def test_large_text_ends_in_bounded_time(what: str) -> None:
    start = time.process_time()
    with contextlib.suppress(InputError, IndexError):  # or there is no function `f`
        value(BOMBS[what])
    assert time.process_time() - start < 12.0


def test_bevys_imports_and_conditions_are_followed_in_named_folders_only(tmp_path: Path) -> None:
    (tmp_path / "fresnel.wgsl").write_text(
        "#define_import_path engine::fresnel\n#import engine::fresnel::tools\n#ifdef FAST\nfn schlick(x: f32) -> f32 "
        "{ return 0.0; }\n#else ifdef SQUARE\nfn schlick(x: f32) -> f32 { return x * x * TWO * tools::one(); }\n"
        "#else\nfn schlick(x: f32) -> f32 { return missing; }\n#endif\nconst TWO = 2.0;\n"
        "struct P { a: f32 }\nfn unread() -> f32 { return dpdx(1.0); }"
    )
    (tmp_path / "tools.wgsl").write_text("#define_import_path engine::fresnel::tools\nfn one() -> f32 { return 1.0; }")
    text = (
        "#import engine::{\n    fresnel as F, // the rest\n    fresnel::{TWO, P},\n}\n#if LEVEL >= 2\nconst LEVEL = "
        "#{LEVEL};\n#endif\n// see page.org/a#Section and #{ABSENT}\n"
        "fn f(x: f32) -> f32 { let p = P(x); return F::schlick(p.a) + TWO + f32(LEVEL); }"
    )
    result = value(text, {"SQUARE": "", "LEVEL": "3"}, (tmp_path,))
    np.testing.assert_allclose(result, 2 * X * X + 5)
    with pytest.raises(InputError, match="no file with #define_import_path engine::fresnel"):
        value(text, {"SQUARE": "", "LEVEL": "3"})
    with pytest.raises(InputError, match="unknown name 'missing'") as error:
        value(text, {"LEVEL": "3"}, (tmp_path,))
    assert error.value.where == "fresnel.wgsl:8"
    with pytest.raises(InputError, match="no 'absent'"):
        value("#import engine::fresnel\nfn f(x: f32) -> f32 { return fresnel::absent(x); }", None, (tmp_path,))
