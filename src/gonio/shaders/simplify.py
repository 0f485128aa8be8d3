"""Simplification of recorded functions for readable shader text.

A recording contains every operation of the Python code. This module merges equal values, folds constants, removes
branches that cannot be taken, and resolves a selection inside another selection by the same mask:
`where(b == 0, 0, a / where(b == 0, 1, b))` becomes a quotient that is selected only where b is not 0.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from ..ops import graph
from ..ops.table import Table
from .folding import Numbers
from .source import module_constant
from .values import COMPARE, ELEMENTWISE, LOGIC, SIZES, Kind, Routine, Static, Value, shape


def routines(
    recorded: graph.Graph, guarded: bool = False, folded: Mapping[graph.Node, Numbers] | None = None
) -> list[Routine]:
    """All functions of a recording, simplified, callees first.

    folded   nodes that are numbers, as determined by `folding.folded`
    guarded  preserve a selection inside another one by the same mask, so that the gradient of the unused branch is
             finite
    """
    known: dict[graph.Function, Routine] = {}
    for function in recorded.functions:
        known[function] = _Simplifier(function, known, guarded, folded or {}).routine
    return list(known.values())


class _Simplifier:
    """Converts a recorded function into a simplified routine."""

    def __init__(
        self,
        function: graph.Function,
        known: dict[graph.Function, Routine],
        guarded: bool,
        folded: Mapping[graph.Node, Numbers],
    ) -> None:
        self.known, self.guarded, self.folded = known, guarded, folded
        self.table: dict[tuple, Value] = {}
        self.count = 0
        self.assumed: dict[tuple, Value] = {}
        self.parts: dict[int, tuple[Value, ...]] = {}  # components of a vector, as composed in Python
        self.routine = Routine(function)
        self.values: dict[graph.Node, Value] = {}
        for node in function.nodes:
            value = self.convert(node)
            if node.name and not value.name and value.op not in ("parameter", "constant"):
                value.name = node.name
            if not value.source:
                value.source = node.source
            self.values[node] = value
        self.routine.single = isinstance(function.result, graph.Node)
        leaves = list(graph._flatten(function.result, "result"))
        self.routine.results = [(path.partition(".")[2], self.values[node]) for path, node in leaves]
        for value in self.routine.values():
            if value.op == "parameter":
                self.routine.used.add(self.routine.parameters.index(value))

    # ------------------------------------------------------------------ construction of values

    def make(self, op: str, type_: Kind, args: tuple = (), static: Static = None, name: str = "") -> Value:
        key = (op, type_ if isinstance(type_, str) else id(type_), tuple(a.order for a in args), _key(static), name)
        value = self.table.get(key)
        if value is None:
            self.count += 1
            value = self.table[key] = Value(op, type_, args, static, self.count)
        return value

    def constant(self, number: Static, type_: str = "float", source: str = "") -> Value:
        """A number, with its name if the line of the source uses one."""
        if isinstance(number, bool | np.bool_):
            return self.make("constant", "bool" if type_ == "float" else type_, (), bool(number))
        name = module_constant(float(number), source)[0] if source else ""
        value = self.make("constant", type_, (), float(number), name)
        value.name, value.source = name, value.source or source
        return value

    def convert(self, node: graph.Node) -> Value:
        if node in self.folded:
            if node.op == "parameter":
                self.routine.parameters.append(self.make("parameter", shape(node.type), (), node.static))
            numbers = tuple(map(self.constant, self.folded[node]))
            return numbers[0] if len(numbers) == 1 else self.vector(numbers)
        args = tuple(
            self.values[a] if isinstance(a, graph.Node) else self.constant(a, source=node.source) for a in node.args
        )
        op = node.op
        if op == "parameter":
            self.routine.parameters.append(self.make("parameter", shape(node.type), (), node.static))
            return self.routine.parameters[-1]
        if op == "constant":
            number = node.static if isinstance(node.static, bool) else float(node.static)
            return self.constant(number, source=node.source)
        if op == "call":
            callee = self.known[node.static]
            if callee.single:  # a function that only returns its argument or a constant needs no call
                result = callee.results[0][1]
                if result.op == "parameter":
                    return args[callee.parameters.index(result)]
                if result.op == "constant":
                    return self.constant(result.static, result.type)
            return self.make("call", callee.results[0][1].type if callee.single else callee, args, callee)
        if op == "element":
            return self.element(args[0], node.static)
        if op in ("lookup", "fetch"):
            return self.texel(op, args, *node.static)
        if op == "component":
            return self.component(args[0], node.static)
        if op == "vector":
            return self.vector(args)
        return self.build(op, args, shape(node.type))

    def element(self, called: Value, place: int) -> Value:
        result = called.static.results[place][1]
        if result.op == "constant":
            return self.constant(result.static, result.type)
        return self.make("element", result.type, (called,), place)

    def texel(self, how: str, args: tuple, table: Table, channel: int) -> Value:
        if table.channels == 1:
            return self.make("texel", "float", args, (table, 0, how))
        if table.channels == 2:
            return self.component(self.make("texel", "vec2", args, (table, 0, how)), channel)
        return self.component(self.make("texel", "vec4", args, (table, channel // 4, how)), channel % 4)

    def component(self, vector: Value, place: int) -> Value:
        if vector.order in self.parts:
            part = self.parts[vector.order][place]
            if part.op in ("component", "parameter", "constant"):
                return part
        if vector.op == "vector":
            pair = len(vector.args) < SIZES[vector.type]
            return self.component(vector.args[0], place) if pair and place < 2 else vector.args[place - pair]
        if vector.op == "constant":
            return self.constant(vector.static)
        if vector.op == "neg" and vector.args[0].op in ("vector", "parameter"):
            return self.build("neg", (self.component(vector.args[0], place),), "float")
        return self.make("component", "float", (vector,), place)

    def vector(self, parts: tuple[Value, ...]) -> Value:
        """A vector of floats; operations common to all components, or to x and y, are written once as vector
        operations."""
        type_ = f"vec{len(parts)}"
        made = self.joined(parts)
        if made is None:
            pair = self.joined(parts[:2]) if len(parts) == 3 else None
            made = self.make("vector", type_, (pair, parts[2]) if pair is not None else parts)
        self.parts.setdefault(made.order, parts)
        return made

    def joined(self, parts: tuple[Value, ...]) -> Value | None:
        """One vector operation that computes these components by the same arithmetic; None if there is none."""
        type_, first = f"vec{len(parts)}", parts[0]
        if all(p.op == "component" and p.args == first.args for p in parts):
            places = "".join("xyzw"[p.static] for p in parts)
            base = first.args[0]
            return base if base.type == type_ and places == "xyz"[: len(parts)] else self.swizzle(base, places)
        if first.op not in ELEMENTWISE or any(p.op != first.op or p.name for p in parts):
            return None
        columns = list(zip(*(p.args for p in parts), strict=True))
        same = [column[0] if all(p is column[0] for p in column) else None for column in columns]
        operands = [same[i] or self.joined(column) for i, column in enumerate(columns)]
        if all(same) or not any(operands):
            return None
        args = tuple(x if x is not None else self.vector(c) for x, c in zip(operands, columns, strict=True))
        return self.build(first.op, args, type_)

    def swizzle(self, vector: Value, places: str) -> Value | None:
        """Several components by their letters, without repetition: `v.xy`."""
        if len(set(places)) < len(places):
            return None
        if places == "xy" and vector.op == "vector" and vector.args[0].type == "vec2":
            return vector.args[0]
        return self.make("swizzle", f"vec{len(places)}", (vector,), places)

    def build(self, op: str, args: tuple, declared: str) -> Value:
        """An operation on values, folded if its arguments allow it."""
        type_ = self.type_of(op, args, declared)
        folded = self.fold(op, args, type_)
        return folded if folded is not None else self.make(op, type_, args)

    def type_of(self, op: str, args: tuple, declared: str) -> str:
        wide = {a.type for a in args} & set(SIZES)
        if op in COMPARE or op in LOGIC or op == "isfinite":
            size = {SIZES[t] for t in wide} | {int(a.type[-1]) for a in args if a.type.startswith("bvec")}
            return f"bvec{size.pop()}" if size else "bool"
        if op == "where" and args[0].type.startswith("bvec"):
            return "vec" + args[0].type[-1]
        if op in ("dot", "mean", "max_component"):
            return "float"
        if op == "vector":
            return declared
        return wide.pop() if wide else ("bool" if op == "where" and args[1].type == "bool" else "float")

    # ------------------------------------------------------------------ folding

    def fold(self, op: str, args: tuple, type_: str) -> Value | None:
        if op == "where":
            mask, a, b = args
            return self.fold_where(mask, a, b, type_)
        if args and all(a.op == "constant" for a in args):
            number = _compute(op, [a.static for a in args])
            if number is not None:
                return self.constant(number, type_)
        if op == "sub" and args[0] is args[1]:
            return self.constant(0.0, type_)
        if op in ("add", "sub", "mul", "div"):
            return self.fold_arithmetic(op, args, type_)
        if op == "neg" and args[0].op == "neg":
            return args[0].args[0]
        if op == "not" and args[0].op == "not":
            return args[0].args[0]
        if op in ("ne", "lt", "gt") and args[0] is args[1]:  # sources do not use this as a NaN test
            return self.constant(False, type_)
        if op in ("and", "or"):
            for a, b in (args, args[::-1]):
                if a.op == "constant":
                    return b if a.static is (op == "and") else self.constant(op == "or", type_)
            if args[0] is args[1]:
                return args[0]
        return None

    def fold_arithmetic(self, op: str, args: tuple, type_: str) -> Value | None:
        a, b = args

        def is_number(x: Value, number: float) -> bool:
            return x.op == "constant" and x.static == number

        def typed(x: Value) -> Value | None:
            """x in the type of the result."""
            if x.type == type_:
                return x
            return self.constant(x.static, type_) if x.op == "constant" else self.make("splat", type_, (x,))

        if op == "mul" and (is_number(a, 0.0) or is_number(b, 0.0)):
            return self.constant(0.0, type_)
        if op == "div" and is_number(a, 0.0):
            return self.constant(0.0, type_)
        if op == "mul" and is_number(a, 1.0):
            return typed(b)
        if op in ("mul", "div") and is_number(b, 1.0):
            return typed(a)
        if op == "mul" and (is_number(a, -1.0) or is_number(b, -1.0)):
            other = b if is_number(a, -1.0) else a
            return self.build("neg", (other,), other.type) if other.type == type_ else None
        if op == "add" and is_number(a, 0.0):
            return typed(b)
        if op in ("add", "sub") and is_number(b, 0.0):
            return typed(a)
        if op == "sub" and is_number(a, 0.0) and b.type == type_:
            return self.build("neg", (b,), type_)
        if op == "add" and b.op == "constant" and b.static < 0.0 and not b.name:
            return self.build("sub", (a, self.constant(-b.static, b.type)), type_)
        if op == "add" and b.op == "neg":
            return self.build("sub", (a, b.args[0]), type_)
        if op == "sub" and b.op == "neg":
            return self.build("add", (a, b.args[0]), type_)
        return None

    def fold_where(self, mask: Value, a: Value, b: Value, type_: str) -> Value | None:
        if mask.op == "constant":
            chosen = a if mask.static else b
            return chosen if chosen.type == type_ else None
        if a is b and a.type == type_:
            return a
        if mask.op == "not":
            return self.build("where", (mask.args[0], b, a), type_)
        if type_ == "bool":
            if a.op == "constant" and a.static:
                return self.build("or", (mask, b), "bool")
            if b.op == "constant" and not b.static:
                return self.build("and", (mask, a), "bool")
            if a.op == "constant" or b.op == "constant":  # m ? false : b, m ? a : true
                other, not_mask = (b if a.op == "constant" else a), self.build("not", (mask,), "bool")
                return self.build("and" if a.op == "constant" else "or", (not_mask, other), "bool")
        shifted = self._equal_up_to_constant(mask, a, b)
        if shifted is not None:
            return shifted
        if self.guarded:
            return None
        a2, b2 = self.assume(a, mask, True), self.assume(b, mask, False)
        if a2 is not a or b2 is not b:
            return self.build("where", (mask, a2, b2), type_)
        return None

    def _equal_up_to_constant(self, mask: Value, a: Value, b: Value) -> Value | None:
        """mask ? x + 1 : x + 2 as x + (mask ? 1 : 2); None for other values."""
        numbers = []
        for value in (a, b):
            if value.op not in ("add", "sub") or value.name or value.args[1].op != "constant":
                return None
            number = value.args[1]
            numbers.append(number if value.op == "add" else self.constant(-number.static, number.type))
        if a.args[0] is not b.args[0] or mask.type != "bool":
            return None
        return self.build("add", (a.args[0], self.build("where", (mask, *numbers), numbers[0].type)), a.type)

    def assume(self, value: Value, mask: Value, holds: bool) -> Value:
        """The value under the assumption that `mask` is true (`holds`) or false."""
        key = (value.order, mask.order, holds)
        result = self.assumed.get(key)
        if result is None:
            result = self.assumed[key] = self._assume(value, mask, holds)
        return result

    def _assume(self, value: Value, mask: Value, holds: bool) -> Value:
        if value is mask and value.type == "bool":
            return self.constant(holds)
        if value.op == "where" and value.args[0] is mask and not value.name:
            chosen = value.args[1 if holds else 2]
            if chosen.type == value.type:
                return self.assume(chosen, mask, holds)
        if value.name or value.op in ("call", "element", "texel", "parameter", "constant"):
            return value  # shared with other lines, so a second copy would cost more than the selection
        args = tuple(self.assume(a, mask, holds) for a in value.args)
        if all(new is old for new, old in zip(args, value.args, strict=True)):
            return value
        if value.op == "component":
            return self.component(args[0], value.static)
        if value.op == "swizzle":
            return self.make("swizzle", value.type, args, value.static)
        return self.build(value.op, args, value.type)


def _key(static: Static) -> object:
    if isinstance(static, float):
        return ("float", struct.pack("d", static))
    if isinstance(static, tuple):
        return tuple(_key(item) for item in static)
    return (type(static).__name__, static if isinstance(static, bool | int | str | None) else id(static))


# operations that are folded if all arguments are numbers
_FOLD = COMPARE | LOGIC | ELEMENTWISE | {"sqrt", "exp", "log", "sin", "cos", "floor"}


def _compute(op: str, numbers: list) -> Static:
    if op not in _FOLD:
        return None
    try:
        with np.errstate(all="raise", under="ignore"):
            return graph.NUMPY[op](*numbers)
    except FloatingPointError:  # not folded: computed by the shader, as in the source
        return None
