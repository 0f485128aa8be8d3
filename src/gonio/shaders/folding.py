"""Constant propagation in a recording: values that depend only on a material's own values become numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from ..ops import graph
from ..ops.evaluation import operate

Numbers: TypeAlias = "tuple[float, ...] | tuple[bool, ...]"  # one per component
SMALLEST, LARGEST = 1.2e-38, 3.4e38  # range of normal float32 numbers other than 0


def folded(recorded: graph.Graph, values: Mapping[str, Any]) -> dict[graph.Node, Numbers]:
    """The nodes of all functions that have the same value in every call if the parameters have the given values.

    values  name of a parameter of the entry, such as "self.alpha" -> a number, or a list of components
    """
    known: dict[graph.Node, Any] = {}
    agreed: dict[graph.Function, list[Any]] = {}  # for each callee, the arguments that are equal in all calls so far
    entry = recorded.functions[-1]
    for node in _parameters(entry):
        if node.static in values:
            known[node] = np.reshape(np.asarray(values[node.static], float), (-1, 1) if node.type != "float" else (1,))
    for function in reversed(recorded.functions):  # callers come before callees
        for node, value in zip(_parameters(function), agreed.get(function, ()), strict=False):
            if value is not None:
                known[node] = value
        for node in function.nodes:
            arguments = [known.get(one) if isinstance(one, graph.Node) else one for one in node.args]
            if node.op == "call":
                _agree(agreed, node.static, arguments)
            with np.errstate(all="ignore"):
                value = _value(node, arguments, known)
            if value is not None:
                known[node] = value
    numbers = {node: _numbers(node, value) for node, value in known.items() if not isinstance(value, list)}
    return {node: one for node, one in numbers.items() if one}


def _parameters(function: graph.Function) -> list[graph.Node]:
    return [node for node in function.nodes if node.op == "parameter"]


def _agree(agreed: dict[graph.Function, list[Any]], callee: graph.Function, arguments: list[Any]) -> None:
    """Keep the arguments that are the same in this call and in all earlier calls."""
    pairs = zip(agreed.get(callee, arguments), arguments, strict=True)
    agreed[callee] = [a if a is not None and b is not None and np.array_equal(a, b) else None for a, b in pairs]


def _value(node: graph.Node, arguments: list[Any], known: Mapping[graph.Node, Any]) -> Any:
    """The value of a node whose arguments are known: an array, or a list of the results of a call; else None."""
    if node.op == "parameter":
        return known.get(node)
    if node.op == "constant":
        return node.static
    if any(one is None for one in arguments):
        return None
    if node.op == "call":
        results = graph.results_of(node.static, arguments)
        return results[0] if isinstance(node.static.result, graph.Node) else results
    if node.op == "element":
        return arguments[0][node.static]
    return operate(node.op, node.static, arguments)


def _numbers(node: graph.Node, value: Any) -> Numbers:
    """The components of a value in single precision; empty if one of them cannot be represented."""
    array = np.ravel(np.asarray(value))
    if array.dtype == bool:
        return tuple(map(bool, array))
    sizes = {"float": 1, "vec2": 2, "vec3": 3, "spectrum": 3, "vec4": 4}
    if node.type not in sizes or array.size not in (1, sizes[node.type]) or not np.all(np.isfinite(array)):
        return ()
    if np.any((array != 0.0) & ((np.abs(array) < SMALLEST) | (np.abs(array) > LARGEST))):
        return ()
    return tuple(map(float, np.broadcast_to(array, (sizes[node.type],))))
