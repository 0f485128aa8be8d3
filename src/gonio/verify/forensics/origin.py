"""The operation in which a NaN or an infinity originates.

The recorded material is evaluated again for one pair of directions, and the result is traced back to the first
operation whose arguments are all finite.

    origin.of(material, wo, wi)     "0 / 0 in V_Kelemen (my.glsl:31)"
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import GonioError
from ...material import BSDF, tree
from ...ops import evaluation, graph

Number = Any  # a NumPy value for one pair: (1,), or (3, 1) for vectors and colors


def of(material: BSDF, wo: NDArray[np.float64], wi: NDArray[np.float64]) -> str:
    """A description of the operation after which `eval` is not finite for a pair, in the first precision in which this
    happens; "" if it cannot be found."""
    try:
        recording = material.record("eval")
    except GonioError:
        return ""
    for kind in (np.float64, np.float32):
        given = _inputs(material, wo, wi, kind)
        if any(name not in given for name in recording.entry.parameters):
            return ""  # parameters that are derived differently, such as tables of averages
        with np.errstate(all="ignore"):
            called = _Called(recording.entry, [given[name] for name in recording.entry.parameters])
        for _, node in graph.flatten(recording.entry.result, "", graph.Node):
            if not _finite(called.value(node)):
                words = called.origin(node)
                return words + (" in float32" if words and kind is np.float32 else "")
    return ""


_SIZES = {"spectrum": 3, "alpha": 2}


def _inputs(material: BSDF, wo: NDArray[np.float64], wi: NDArray[np.float64], kind: type) -> dict[str, Number]:
    given: dict[str, Number] = {"wo": wo[:, None].astype(kind), "wi": wi[:, None].astype(kind)}
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric:
            value: Number = np.asarray(leaf.value, kind)
            if (size := _SIZES.get(leaf.parameter.kind)) is not None:
                value = np.broadcast_to(value, (size,))
            given[f"self.{leaf.path}"] = value[:, None] if value.ndim else value[None]
    return given


def _finite(value: Number) -> bool:
    return bool(np.all(np.isfinite(value)))


class _Called:
    """A call of a recorded function: the values of its nodes, and the calls inside it."""

    def __init__(self, function: graph.Function, arguments: list[Number], outside: Callable[[int], str] | None = None):
        self.function, self.outside = function, outside
        self.values: list[Number] = []
        self.inner: dict[int, _Called] = {}
        self.places: dict[int, int] = {}  # index of a parameter's node -> position in the arguments
        for node in function.nodes:
            given = [self.value(one) for one in node.args]
            if node.op == "parameter":
                self.places[node.index] = len(self.places)
                self.values.append(arguments[self.places[node.index]])
            elif node.op == "constant":
                # a plain number, which takes the precision of the others
                self.values.append(node.static if isinstance(node.static, bool) else float(node.static))
            elif node.op == "call":
                one = self.inner[node.index] = _Called(node.static, given, self._argument(node))
                results = one.results()
                self.values.append(results[0] if isinstance(node.static.result, graph.Node) else results)
            elif node.op == "element":
                self.values.append(given[0][node.static])
            elif node.op == "vector":
                self.values.append(np.stack(np.broadcast_arrays(*[np.atleast_1d(one) for one in given])))
            else:
                self.values.append(evaluation.operate(node.op, node.static, given))

    def value(self, one: object) -> Number:
        return self.values[one.index] if isinstance(one, graph.Node) else one

    def results(self) -> list[Number]:
        return [self.value(node) for node in self._result_nodes()]

    def _result_nodes(self) -> list[graph.Node]:
        return [node for _, node in graph.flatten(self.function.result, "", graph.Node)]

    def _argument(self, call: graph.Node) -> Callable[[int], str]:
        return lambda place: self.origin(call.args[place])

    def origin(self, node: graph.Node) -> str:
        """A description of the operation in which the non-finite value of a node originates."""
        if node.op == "parameter":
            return self.outside(self.places[node.index]) if self.outside else ""
        if node.op in ("call", "element"):
            call, place = (node, 0) if node.op == "call" else (node.args[0], node.static)
            inner = self.inner[call.index]
            return inner.origin(inner._result_nodes()[place])
        chosen = node.args
        if node.op == "where":
            chosen = (node.args[1] if np.all(self.value(node.args[0])) else node.args[2],)
        for one in chosen:
            if isinstance(one, graph.Node) and not _finite(self.value(one)):
                return self.origin(one)
        words = "a power of a negative number" if _is_power(node) else _words(node.op, [*map(self.value, node.args)])
        if not words:
            return ""
        file, _, line = node.source.rpartition(":")
        return f"{words} in `{self.function.name}` ({Path(file).name}:{line})"


def _is_power(node: graph.Node) -> bool:
    """Whether a node is the root that represents a shader's power of a negative number: the root of x if x < 0, else
    of 0."""
    base = node.args[0] if node.op == "sqrt" else None
    if not isinstance(base, graph.Node) or base.op != "where" or _constant(base.args[2]) != 0.0:
        return False
    below = base.args[0]
    return isinstance(below, graph.Node) and below.op == "lt" and below.args[0] is base.args[1]


def _constant(one: object) -> object:
    return one.static if isinstance(one, graph.Node) and one.op == "constant" else one


def _words(op: str, given: list[Number]) -> str:
    """A description of an operation on given finite arguments."""
    if op == "div":
        if np.all(given[1] != 0.0):
            return "an overflow of a quotient"
        return "0 / 0" if np.any((given[0] == 0.0) & (given[1] == 0.0)) else "a division by 0"
    if op == "sqrt":
        return "the square root of a negative number"
    if op == "log":
        return "the logarithm of 0" if np.any(given[0] == 0.0) else "the logarithm of a negative number"
    if op == "pow":
        return "a power of a negative number"
    if op in ("exp", "mul", "add", "sub", "scaled"):
        return "an overflow"
    return ""


__all__ = ["of"]
