"""Messages that name what a BSDF cannot have, and the limit that ended a compiler."""

from __future__ import annotations

import itertools
import signal
from pathlib import Path

import gonio as go
import pytest
from gonio.errors import InputError
from gonio.spirv.compiler import compiler
from gonio.spirv.messages import ended

BRDF = "vec3 brdf(vec3 L, vec3 V, vec3 N) {\n  %s\n  return vec3(0.1); }"
BUFFER = "layout(std430, binding = 0) buffer Block { float c[4]; };"


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


def _refused(folder: Path, text: str, suffix: str = "glsl") -> InputError:
    file = folder / f"a.{suffix}"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        go.Shader(str(file))
    return refused.value


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("text", "what", "where"),
    [
        (BRDF % "barrier();", "a barrier (barrier)", "a.glsl:2"),
        (BRDF % "groupMemoryBarrier();", "a barrier (groupMemoryBarrier)", "a.glsl:2"),
        (
            "#extension GL_KHR_shader_subgroup_arithmetic : require\n" + BRDF % "float d = subgroupAdd(L.x);",
            "a subgroup operation (subgroup)",
            "a.glsl:3",
        ),
        (
            "float f(float x) { return f(x); }\n" + BRDF % "float d = f(1.0);",
            "recursion: 'f' calls itself",
            "a.glsl",
        ),
        (
            "float g(float x);\nfloat f(float x) { return g(x); } float g(float x) { return f(x); }\n" + BRDF % "f(1);",
            "recursion: 'f' and 'g' call each other",
            "a.glsl",
        ),
        (BRDF % "bareer();", "'bareer' : no matching overloaded function found", "a.glsl:2"),
        (f"{BUFFER}\n" + BRDF % "c[0] = 1.0;", "a write to the buffer 'c'", "a.glsl:3"),
        (f"{BUFFER}\n" + BRDF % "for (int i = 0; i < 2; i++) c[i] += L.x;", "a write to the buffer 'c'", "a.glsl:3"),
        (BRDF % f"float x = {'(' * 9999}1.0{')' * 9999};", "nested too deeply", "a.glsl:2"),
    ],
)  # fmt: skip
def test_what_a_bsdf_cannot_have_is_named(tmp_path: Path, text: str, what: str, where: str) -> None:
    error = _refused(tmp_path, text)
    assert what in error.what and "damaged" not in error.what
    assert error.where == where


def test_a_write_to_a_buffer_of_hlsl(tmp_path: Path) -> None:
    text = "RWStructuredBuffer<float> c;\nfloat3 brdf(float3 L, float3 V, float3 N) {\n  c[0] = 1.0;\n  return L; }"
    error = _refused(tmp_path, text, "hlsl")
    assert (error.what, error.where) == ("a write to the buffer 'c'", "a.hlsl:3")


@pytest.mark.slow
def test_macros_that_explode_meet_the_limit_of_memory(tmp_path: Path) -> None:
    macros = "\n".join(f"#define {a} {' '.join(b * 10)}" for a, b in itertools.pairwise("ABCDEFGHI"))
    error = _refused(tmp_path, f"{macros}\n#define I + 1.0\n" + BRDF % "float x = A;")
    assert "the compiler needs more than 2 GB of memory" in error.what or "the compiler took over" in error.what
    assert "macros" in error.hint


def test_limits_are_named_by_the_end_of_the_compiler() -> None:
    def what(code: int, printed: str = "") -> str:
        return ended(code, printed, 10, 2 << 30, 64 << 20)[0]

    assert what(-signal.SIGXCPU) == "the compiler took over 10 s"
    assert what(-signal.SIGABRT, "what():  std::bad_alloc") == "the compiler needs more than 2 GB of memory"
    assert what(-signal.SIGXFSZ) == "the compiler wrote over 64 MB"
    assert what(-signal.SIGSEGV) == "the compiler crashed (SIGSEGV), without a message"
    assert what(3) == "the compiler ended with code 3, without a message"
