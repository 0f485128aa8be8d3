"""Modules that lie: thousands of mutations end in an InputError or a value, never in a crash or a hang."""

import time

import numpy as np
import pytest
from gonio.errors import InputError
from gonio.spirv import Machine, compile_text, parse
from gonio.spirv.compiler import compiler

TEXT = """
uniform sampler2D t;
struct S { float a[4]; vec3 b; };
float g(float x) { return x * x; }
vec3 f(vec3 l, vec3 v) {
    S s; s.b = l;
    for (int i = 0; i < 4; ++i) { s.a[i] = g(l.x) * float(i); if (s.a[i] > 2.0) break; }
    mat3 m = mat3(l, v, normalize(l + v));
    switch (int(l.x)) { case 0: s.b.x = 1.0; break; default: s.b *= 2.0; }
    return m * s.b + vec3(s.a[2], pow(l.z, 5.0), clamp(v.z, 0.0, 1.0));
}
"""


def _try(data: bytes) -> bool:
    """Whether a module runs."""
    try:
        module = parse(data)
        for function in module.functions.values():
            arguments = [module.zero(module.type(kind).parts[0] if module.type(kind).kind == "pointer" else kind)
                         for _, kind in function.parameters]  # fmt: skip
            Machine(module).call(function, arguments)
    except InputError:
        return False
    return True


@pytest.mark.parametrize("count", [400, pytest.param(3000, marks=pytest.mark.slow)])
def test_mutated_module_ends_in_an_error_or_a_value(count: int) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    whole = np.frombuffer(compile_text(TEXT, "test"), np.uint32)
    assert _try(whole.tobytes())
    rng = np.random.default_rng(7)
    slowest, ran = 0.0, 0
    for _ in range(count):
        words = whole.copy()
        for _ in range(rng.integers(1, 4)):
            at = rng.integers(5, len(words))
            kind = rng.integers(4)
            words[at] = [rng.integers(1 << 32), rng.integers(200), words[at] ^ (1 << rng.integers(32)),
                         words[rng.integers(5, len(words))]][kind]  # fmt: skip
        data = words.tobytes()[: rng.integers(20, 4 * len(words) + 1) if rng.random() < 0.1 else None]
        start = time.process_time()
        ran += _try(data)
        slowest = max(slowest, time.process_time() - start)
    assert slowest < 5.0
    assert ran > count // 30
