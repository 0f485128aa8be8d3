"""The law that a recorded graph, read by NumPy in float64, is the model as Dr.Jit computes it in float64.

Tolerance 1e-12 of the value (vectors: of their length). Where the value itself is ill-conditioned, the change that
one unit in the last place of the inputs makes, times 8, is allowed instead: two correct programs may differ by it.
"""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.ops import backend

from materials import ALL, COMPENSATED, EACH, SMALL, each
from sphere import random_directions, random_numbers

MATERIALS = {**ALL, **COMPENSATED}
# tables of two widths are long in the making; the shaders' values are compared with them on (tests/shaders)
QUICK = {*EACH, *COMPENSATED} - {"kulla-conty-turned", "kulla-conty-bubble", "turquin-turned"}
COUNT = 3000
WO, WI, U = random_directions(COUNT, 41), random_directions(COUNT, 42), random_numbers(COUNT, 41)


def _fields(material: Any, path: str) -> np.ndarray:
    for name in path.split(".")[1:]:
        material = getattr(material, name)
    return material.numpy()


def _both(material: go.BSDF, method: str, mode: str, wo: np.ndarray, other: np.ndarray) -> tuple[tuple, tuple]:
    """(by the graph in NumPy, by Dr.Jit), each a tuple of arrays with one row a ray."""
    graph = material.record(method, mode)
    bound = material.bind(backend.types("float64"))
    values = {n.replace(".", "_"): _fields(bound, n) for n in graph.entry.parameters if n.startswith("self")}
    recorded = graph.evaluate(wo=wo.T, **{"u" if method == "sample" else "wi": other.T}, **values)
    args = (mode,) if method != "pdf" else ()
    computed = getattr(material, method)(wo, other, *args, precision="float64")
    recorded, computed = (x if isinstance(x, tuple) else (x,) for x in (recorded, computed))
    rows = []
    for r, c in zip(recorded, computed, strict=True):
        r = np.asarray(r)
        r = r if r.ndim == 0 or r.shape[-1] == len(c) or r.ndim > 1 else np.broadcast_to(r, (len(c),))
        rows.append(np.broadcast_to(r.T if r.ndim == 2 else r, c.shape))
    return tuple(rows), tuple(computed)


def _size(x: np.ndarray) -> np.ndarray:
    return np.linalg.norm(x, axis=1) if x.ndim == 2 else np.abs(x)


def _ulp(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.nextafter(x, x + rng.choice([-1.0, 1.0], x.shape))


def _check(name: str, method: str, mode: str = "radiance") -> None:
    material = MATERIALS[name]
    other = U if method == "sample" else WI
    if method != "sample":  # half of the pairs where the lobe is
        other = WI.copy()
        other[::2] = material.sample(WO, U, precision="float64").wi[::2]
    recorded, computed = _both(material, method, mode, WO, other)
    # Dr.Jit takes subnormal numbers for 0
    recorded, computed = ([np.where(np.abs(x) < 1e-290, 0.0, x) for x in y] for y in (recorded, computed))
    doubtful = [_size(r - c) > 1e-12 * _size(c) for r, c in zip(recorded, computed, strict=True)]
    if not any(d.any() for d in doubtful):
        return
    rng = np.random.default_rng(0)
    moved = [np.zeros(COUNT) for _ in computed]
    args = (mode,) if method != "pdf" else ()
    for _ in range(8):
        near = getattr(material, method)(_ulp(WO, rng), np.clip(_ulp(other, rng), -1, 1), *args, precision="float64")
        for i, (n, c) in enumerate(zip(near if isinstance(near, tuple) else (near,), computed, strict=True)):
            moved[i] = np.maximum(moved[i], _size(n * 1.0 - c * 1.0))
    for r, c, change in zip(recorded, computed, moved, strict=True):
        excess = _size(r - c) - np.maximum(1e-12 * _size(c), 8 * change)
        worst = int(np.argmax(excess))
        assert excess[worst] <= 0, (
            f"ray {worst}: {r[worst]} recorded, {c[worst]} computed, moves by {change[worst]:.2g}"
        )


@pytest.mark.sample(6)
@pytest.mark.parametrize("method", ["eval", "pdf", "sample"])
@pytest.mark.parametrize("name", each(MATERIALS, QUICK))
def test_recorded_graph_equals_the_model(name: str, method: str) -> None:
    _check(name, method)


@pytest.mark.sample(1)
@pytest.mark.parametrize("method", ["eval", "sample"])
@pytest.mark.parametrize("name", each([name for name, m in {**SMALL, **COMPENSATED}.items() if m.transmits], QUICK))
def test_recorded_graph_of_importance_equals_the_model(name: str, method: str) -> None:
    _check(name, method, "importance")


def test_graph_keeps_names_docstrings_and_source_lines() -> None:
    graph = go.Conductor().record("eval")
    by_name = {function.name: function for function in graph.functions}
    assert graph.entry.name == "Conductor_eval"
    assert list(graph.entry.parameters)[:2] == ["self.eta", "self.k"] and "wo" in graph.entry.parameters
    d = next(f for n, f in by_name.items() if n.endswith("_density"))
    assert "density of a hemisphere" in d.doc
    path, line = d.source.rsplit(":", 1)
    assert path.endswith("ggx.py") and int(line) > 0
    assert all(node.source.rsplit(":", 1)[0].endswith(".py") for f in graph.functions for node in f.nodes)
    lines = {node.source for f in graph.functions for node in f.nodes if f.name == d.name}
    assert any("ggx.py" in line for line in lines)


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", each([*SMALL, *COMPENSATED], QUICK))
def test_every_recorded_function_is_documented(name: str) -> None:
    for method in ("eval", "pdf", "sample"):
        for function in MATERIALS[name].record(method).functions:
            assert function.doc, function.name


def test_absent_rotation_leaves_no_trace_in_the_graph() -> None:
    assert "self.rotation" not in go.Conductor().record("eval").entry.parameters
    assert "self.rotation" in go.Conductor(rotation=0.3).record("eval").entry.parameters


def test_graph_says_which_value_is_missing() -> None:
    from gonio.ops import RecordingError

    with pytest.raises(RecordingError, match=r"no value for self\.albedo"):
        go.Lambert().record("eval").evaluate(wo=WO.T, wi=WI.T)
