"""Shaders that ask for more work than a BSDF needs are rejected soon, by the name of a function."""

import time
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.spirv import Machine, translated, work


def _chain(levels: int) -> str:
    calls = (
        f"fn level{i}(x: f32) -> f32 {{ return level{i - 1}(x) + level{i - 1}(0.5 * x); }}" for i in range(1, levels)
    )
    last = f"fn brdf(L: vec3f, V: vec3f) -> f32 {{ return level{levels - 1}(L.z); }}"
    return "\n".join(["fn level0(x: f32) -> f32 { return x; }", *calls, last])


def _run(text: str, *arguments: object) -> object:
    module = translated(text, "a.wgsl", {}, [])
    return Machine(module).call(module.function("f")[0], arguments)


def test_a_tree_of_calls_is_rejected_by_the_name_of_a_function(tmp_path: Path) -> None:
    file = tmp_path / "a.wgsl"
    file.write_text(_chain(40))
    start = time.thread_time()
    with pytest.raises(
        InputError, match=r"more than 250,000 instructions: [\d,]+ in [\d,]+ calls of 'level\d+'"
    ) as caught:
        go.Shader(str(file))
    assert caught.value.where.startswith("a.wgsl:") and "reuse it" in caught.value.hint
    assert time.thread_time() - start < 20.0


def test_a_tree_of_twelve_levels_is_read_soon(tmp_path: Path) -> None:
    """Each function is recorded once, and no names of Python's variables are sought for its values."""
    file = tmp_path / "a.wgsl"
    file.write_text(_chain(12))
    start = time.thread_time()
    graph = go.Shader(str(file)).record("eval")
    assert time.thread_time() - start < 2.5
    up = np.array([0.0, 0.0, 1.0])
    assert graph.evaluate(wo=up, wi=up)[0] == pytest.approx(1.5**11)


@pytest.mark.slow
def test_a_loop_of_4000_rounds_is_read() -> None:
    text = "fn f(x: f32) -> f32 { var s = 0.0; for (var i = 0; i < 4000; i++) { s += x * f32(i); } return s; }"
    assert _run(text, 1.0) == pytest.approx(4000 * 3999 / 2)


def test_seconds_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "SECONDS", 0.0)
    with pytest.raises(InputError, match="over 0 s to run the shader once: 1 in 1 calls of 'f'"):
        _run("fn f(x: f32) -> f32 { return x * x; }", 1.0)


def test_copies_of_large_arrays_count() -> None:
    text = "fn f(x: f32) -> f32 { var a: array<f32, 65536>; for (var i = 0; i < 4096; i++) { a[i] = x; } return a[0]; }"
    with pytest.raises(InputError, match="more than 250,000 instructions"):
        _run(text, 1.0)
