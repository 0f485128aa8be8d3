"""One rule for tables: NumPy, Dr.Jit and the recorded graph read the same."""

from __future__ import annotations

import numpy as np
import pytest
from gonio import ops
from gonio.ops import backend


@pytest.mark.parametrize("shape", [(5,), (4, 7), (3, 4, 5)])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_drjit_numpy_and_the_graph_agree(shape, channels):
    rng = np.random.default_rng(0)
    table = ops.Table("t", rng.random((*shape, channels)))
    at = rng.random((len(shape), 50)) * 1.4 - 0.2  # beyond both edges too
    by_numpy = np.array(ops.lookup(table, *at))
    kind = backend.types("float64")
    by_drjit = np.array([np.array(v) for v in ops.lookup(table, *[kind.float(a) for a in at])])
    np.testing.assert_allclose(by_drjit, by_numpy, rtol=1e-13, atol=1e-15)
    names = "xyz"[: len(shape)]
    functions = {
        "x": lambda x: ops.lookup(table, x),
        "xy": lambda x, y: ops.lookup(table, x, y),
        "xyz": lambda x, y, z: ops.lookup(table, x, y, z),
    }
    graph = ops.record(functions[names], name="read", types=dict.fromkeys(names, "float"))
    np.testing.assert_allclose(np.array(graph.evaluate(**dict(zip(names, at, strict=True)))), by_numpy)


def test_nodes_stand_at_texel_centres_and_edges_are_held():
    table = ops.Table("t", np.array([[1.0], [3.0]]))
    values = ops.lookup(table, np.array([-1.0, 0.0, 0.25, 0.5, 0.75, 1.0, 2.0]))[0]
    np.testing.assert_allclose(values, [1, 1, 1, 2, 3, 3, 3])
    assert ops.lookup(table, ops.inset(np.array(1.0), 2))[0] == 3.0


def test_new_contents_compile_no_kernel():
    dr = backend.drjit()
    kind = backend.types("float32")
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    try:
        for trial in range(3):
            table = ops.Table("t", np.random.default_rng(trial).random((8, 8, 1)))
            at = kind.float([0.1, 0.5]), kind.float([0.2, 0.7])
            dr.kernel_history_clear()
            dr.eval(ops.lookup(table, *at)[0])
            if trial:
                assert all(k["cache_hit"] for k in dr.kernel_history([dr.KernelType.JIT]))
    finally:
        dr.set_flag(dr.JitFlag.KernelHistory, False)


def test_one_texel_is_fetched_alike_by_drjit_numpy_and_the_graph():
    rng = np.random.default_rng(1)
    table = ops.Table("t", rng.random((3, 4, 5, 4)))
    at = np.array([rng.integers(-1, n + 1, 50).astype(float) for n in table.shape])  # beyond both edges too
    held = tuple(np.clip(a, 0, n - 1).astype(int) for a, n in zip(at, table.shape, strict=True))
    by_numpy = np.array(ops.fetch(table, *at))
    np.testing.assert_array_equal(by_numpy, table.values[held].T)
    kind = backend.types("float64")
    by_drjit = np.array([np.array(v) for v in ops.fetch(table, *[kind.float(a) for a in at])])
    np.testing.assert_array_equal(by_drjit, by_numpy)
    graph = ops.record(lambda x, y, z: ops.fetch(table, x, y, z), name="read", types=dict.fromkeys("xyz", "float"))
    np.testing.assert_array_equal(np.array(graph.evaluate(**dict(zip("xyz", at, strict=True)))), by_numpy)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_nan_reads_inside_the_table(precision: str) -> None:
    """Dead rays carry NaN; converted to a whole number it differs by processor: -1 without AVX-512."""
    kind = backend.types(precision)  # type: ignore[arg-type]
    table = ops.Table("t", np.ones((33, 12, 16, 1)))
    nan = kind.float([float("nan")] * 64)
    for read in (ops.fetch, ops.lookup):
        assert len(np.array(read(table, nan, nan, nan)[0])) == 64
