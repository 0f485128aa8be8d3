"""Simplified recordings: the values, structs and routines of a shader."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from ..errors import GonioError
from ..ops import graph

SIZES = {"vec2": 2, "vec3": 3, "vec4": 4}
COMPARE = {"lt", "le", "gt", "ge", "eq", "ne"}
LOGIC = {"and", "or", "not"}
ELEMENTWISE = {"add", "sub", "mul", "div", "neg", "abs", "minimum", "maximum"}

Kind: TypeAlias = Any  # type of a value: a name, or a `Record`
Static: TypeAlias = Any  # static part of a value: a number, a name, a routine, a table


class Value:
    """A value that a function computes.

    op      as in a recording, or "constant", "parameter", "swizzle", "texel" (up to four channels of a table)
    type    "float", "bool", "vec2", "vec3", "vec4", "bvec3", or the result of a call: a `Record`
    args    Values
    static  the constant, the parameter's path, the callee, the component or the letters of several, (table, group of
            channels)
    name    name of the Python variable, if known; `source` is the line that wrote it
    """

    __slots__ = ("args", "name", "op", "order", "source", "static", "type")

    def __init__(self, op: str, type: Kind, args: tuple, static: Static, order: int) -> None:
        self.op, self.type, self.args, self.static, self.order = op, type, args, static, order
        self.name, self.source = "", ""

    def __repr__(self) -> str:
        return f"#{self.order}:{self.op}"


class Record:
    """The type of several values returned together: a struct of the shader.

    docs  field -> description with unit and range
    """

    def __init__(
        self, name: str, fields: list[tuple[str, str]], doc: str = "", docs: dict[str, str] | None = None
    ) -> None:
        self.name, self.fields, self.doc, self.docs = name, fields, doc, docs or {}

    @property
    def key(self) -> tuple:
        return tuple(self.fields)


class Routine:
    """A function of the shader.

    parameters  Values of op "parameter", with `static` the path ("self.base.alpha")
    results     a list of (path, Value); `single` if the result is one Value
    used        indices of the parameters that the results depend on
    record      the type of several results
    """

    def __init__(self, function: graph.Function) -> None:
        self.name, self.doc, self.source = function.name, function.doc, function.source
        self.parameters: list[Value] = []
        self.results: list[tuple[str, Value]] = []
        self.single = False
        self.used: set[int] = set()
        self.record: Record | None = None

    @property
    def type(self) -> Kind:
        return self.results[0][1].type if self.single else self.record

    def values(self) -> list[Value]:
        """All values that the results depend on, in order of computation."""
        values: dict[int, Value] = {}
        pending = [value for _, value in self.results]
        while pending:
            value = pending.pop()
            if value.order not in values:
                values[value.order] = value
                pending.extend(needed(value))
        return [values[order] for order in sorted(values)]


def needed(value: Value) -> list[Value]:
    """The arguments that a value depends on: for a call, those that the callee uses."""
    if value.op == "call":
        return [value.args[i] for i in sorted(value.static.used)]
    return list(value.args)


def stem_of(routine: Routine) -> str:
    """A routine's name without the number that distinguishes copies."""
    stem, _, count = routine.name.rpartition("_")
    return stem if stem and count.isdigit() else routine.name


def shape(type_: str) -> str:
    """The type of a recording in a shader, where a spectrum has three channels."""
    return "vec3" if type_ == "spectrum" else type_


def check_single(number: float, location: str) -> None:
    """Raise GonioError if a constant of the source cannot be represented in float32."""
    size = abs(number)
    if math.isnan(number) or size > 3.4028234e38 or 0.0 < size < 1.17549435e-38:
        raise GonioError(f"the constant {number!r} is not a float32", location, "shader code computes in 32 bits")
