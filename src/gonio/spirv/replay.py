"""Replay of a shader's function on Dr.Jit values: the function is recorded once, and each call repeats the machine's
operations in the same order, without decoding instructions, masks and pointers again.

Replay only saves time: without it, `Program.run` returns the same values.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from .. import ops
from ..ops import graph
from ..ops.structure import flatten, rebuild
from .values import Value, leaves, static, where

_OPERATIONS: dict[str, Callable[..., Value]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge, "eq": operator.eq, "ne": operator.ne,
    "and": operator.and_, "or": operator.or_, "not": operator.invert, "where": where, "sqrt": ops.sqrt,
    "abs": ops.abs, "minimum": ops.minimum, "maximum": ops.maximum, "exp": ops.exp, "log": ops.log, "sin": ops.sin,
    "cos": ops.cos, "atan2": ops.atan2, "floor": ops.floor, "copysign": ops.copysign, "isfinite": ops.isfinite,
}  # fmt: skip
MAX_RECORDED = 16  # recordings of one function for different plain numbers among its arguments

Inputs = Mapping[str, Mapping[str, Value]]


class Replayed:
    """A function of named scalars and tuples of scalars, with one recording for each combination of plain numbers.

    There are separate recordings for single and double precision, which compute a power of two from its exponent
    differently.

    function  a function of mappings from names to values, such as `Program.run`
    """

    def __init__(self, function: Callable[..., Value]) -> None:
        self.function = function
        self._recorded: dict[tuple[object, ...], graph.Function] = {}

    def __call__(self, **inputs: Mapping[str, Value]) -> Value:
        """The function's value. Symbols of a recording are passed on, so that the recording has the shader's
        functions."""
        scalars = list(_scalars(inputs))
        if any(isinstance(scalar, graph.Node) for _, scalar in scalars):
            return self.function(**inputs)
        single = any(ops.is_single(one) for _, one in scalars)
        key = (single, *((name, type(one), one) if static(one) else (name,) for name, one in scalars))
        if key not in self._recorded:
            self._recorded[key] = self._record(inputs, single)
            while len(self._recorded) > MAX_RECORDED:
                self._recorded.pop(next(iter(self._recorded)))
        return _run(self._recorded[key], [scalar for _, scalar in scalars if not static(scalar)])

    def _record(self, inputs: Inputs, single: bool) -> graph.Function:
        def formula(symbols: Mapping[str, Value]) -> Value:
            given = {
                group: {name: _filled(value, f"{group}.{name}", symbols) for name, value in values.items()}
                for group, values in inputs.items()
            }
            return self.function(**given)

        symbols = {name: graph.symbol("float") for name, scalar in _scalars(inputs) if not static(scalar)}
        return ops.record(formula, name="shader", into=graph.Graph(single=single), symbols=symbols).entry


def _scalars(inputs: Inputs) -> Iterator[tuple[str, Value]]:
    """Every scalar with its path."""
    for group, values in inputs.items():
        for name, value in values.items():
            for place, scalar in enumerate(leaves(value)):
                yield f"{group}.{name}.{place}", scalar


def _filled(value: Value, path: str, symbols: Mapping[str, Value]) -> Value:
    """A value in which symbols replace the scalars that are not plain numbers."""
    filled = tuple(symbols.get(f"{path}.{place}", scalar) for place, scalar in enumerate(leaves(value)))
    return filled if isinstance(value, tuple) else filled[0]


def _run(function: graph.Function, arguments: list[Value]) -> Value:
    """The result of a recording, in its original structure."""
    results = iter(_results(function, arguments))
    return rebuild(function.result, lambda _: next(results), graph.Node)


def _results(function: graph.Function, arguments: list[Value]) -> list[Value]:
    """The values of the nodes of a recording's result."""
    values: list[Any] = []
    remaining, read = iter(arguments), dict[tuple[object, ...], Any]()

    def get(value: Value) -> Value:
        return values[value.index] if isinstance(value, graph.Node) else value

    for node in function.nodes:
        given = [get(one) for one in node.args]
        if node.op == "parameter":
            values.append(next(remaining))
        elif node.op == "constant":
            values.append(node.static)
        elif node.op == "call":
            results = _results(node.static, given)
            values.append(results[0] if isinstance(node.static.result, graph.Node) else results)
        elif node.op == "vector":
            values.append(given)
        elif node.op in ("component", "element"):
            values.append(given[0][node.static])
        elif node.op in ("lookup", "fetch"):
            table, channel = node.static
            key = node.op, id(table), *[one.index if isinstance(one, graph.Node) else one for one in node.args]
            if key not in read:
                read[key] = (ops.lookup if node.op == "lookup" else ops.fetch)(table, *given)
            values.append(read[key][channel])
        else:
            values.append(_OPERATIONS[node.op](*given))
    return [get(node) for _, node in flatten(function.result, "", graph.Node)]
