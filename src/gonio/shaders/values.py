"""Simplified recordings: the values, structs and routines of a shader."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

from ..errors import GonioError
from ..ops import graph

SIZES = {"vec2": 2, "vec3": 3, "vec4": 4}
COMPARE = {"lt", "le", "gt", "ge", "eq", "ne"}
LOGIC = {"and", "or", "not"}
MIN_ARRAY = 4  # smallest length of an array; fewer numbers are easier to read as separate names
ELEMENTWISE = {"add", "sub", "mul", "div", "neg", "abs", "minimum", "maximum"}

Kind: TypeAlias = Any  # type of a value: a name, or a `Record`
Static: TypeAlias = Any  # static part of a value: a number, a name, a routine, a table


class Value:
    """A value that a function computes.

    op      operation, as in a recording, or "constant", "parameter", "swizzle", "texel" (up to four channels of a
            table)
    type    "float", "bool", "vec2", "vec3", "vec4", "bvec3", or the result of a call: a `Record`
    args    Values
    static  data of the operation: the constant, the parameter's path, the callee, the component or the letters of
            several components, or (table, group of channels)
    name    name of the Python variable, if known
    source  the line that wrote the value, "file:line"
    """

    __slots__ = ("args", "name", "op", "order", "source", "static", "type")

    def __init__(self, op: str, type: Kind, args: tuple, static: Static, order: int) -> None:
        self.op, self.type, self.args, self.static, self.order = op, type, args, static, order
        self.name, self.source = "", ""

    def __repr__(self) -> str:
        return f"#{self.order}:{self.op}"


class Record:
    """The type of several values returned together: a struct of the shader.

    docs    field -> description with unit and range
    arrays  whether numbered fields may be written as an array; False for a struct that a program fills
    """

    def __init__(
        self,
        name: str,
        fields: list[tuple[str, str]],
        doc: str = "",
        docs: dict[str, str] | None = None,
        arrays: bool = False,
    ) -> None:
        self.name, self.fields, self.doc, self.docs, self.arrays = name, fields, doc, docs or {}, arrays

    @property
    def key(self) -> tuple:
        return tuple(self.fields)


class Member(NamedTuple):
    """A member of a struct or an argument of a function: a field, or `length` fields X_0, X_1, ... as an array X.

    first   index of its first field
    length  length of the array; 0 for a single field
    """

    name: str
    type: Kind
    first: int
    length: int = 0


def members(fields: Sequence[tuple[str, Kind]], arrays: bool) -> list[Member]:
    """The members for (name, type) fields; with `arrays`, a run X_0, X_1, ... of one type is one member."""
    names = {name for name, _ in fields}
    result: list[Member] = []
    index = 0
    while index < len(fields):
        name, type_ = fields[index]
        stem = name.removesuffix("_0")
        count = 0
        if arrays and stem != name and stem not in names and isinstance(type_, str):
            rest = itertools.islice(fields, index, None)
            run = itertools.takewhile(lambda one: one[1] == (f"{stem}_{one[0]}", type_), enumerate(rest))  # noqa: B023
            count = sum(1 for _ in run)
            others = sum(bool(re.fullmatch(rf"{re.escape(stem)}_\d+", other)) for other in names)
            count = count if count == others and count >= MIN_ARRAY else 0
        result.append(Member(stem if count else name, type_, index, count))
        index += count or 1
    return result


class Routine:
    """A function of the shader.

    parameters  Values of op "parameter", with `static` the path ("self.base.alpha")
    results     a list of (path, Value); `single` if the result is one Value
    used        indices of the parameters on which the results depend
    record      the struct type, if there are several results
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
        """All values on which the results depend, in order of computation."""
        values: dict[int, Value] = {}
        pending = [value for _, value in self.results]
        while pending:
            value = pending.pop()
            if value.order not in values:
                values[value.order] = value
                pending.extend(needed(value))
        return [values[order] for order in sorted(values)]


def needed(value: Value) -> list[Value]:
    """The arguments on which a value depends; for a call, those that the callee uses."""
    if value.op == "call":
        return [value.args[i] for i in sorted(value.static.used)]
    return list(value.args)


def stem_of(routine: Routine) -> str:
    """A routine's name without the number that distinguishes copies of one function."""
    stem, _, count = routine.name.rpartition("_")
    return stem if stem and count.isdigit() else routine.name


def shape(type_: str) -> str:
    """The shader type for a type in a recording; a spectrum has three channels."""
    return "vec3" if type_ == "spectrum" else type_


def check_single(number: float, location: str) -> None:
    """Raise GonioError, which names `location`, if a constant of the source cannot be represented in float32."""
    size = abs(number)
    if math.isnan(number) or size > 3.4028234e38 or 0.0 < size < 1.17549435e-38:
        raise GonioError(f"the constant {number!r} is not a float32 number", location, "shaders compute in float32")
