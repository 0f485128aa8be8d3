"""The parameters of a shader: its uniforms and arguments, divided into numbers, colors, flags and integers.

uniform mat3 M;        M_0, M_1, M_2      one color per column
uniform vec4 c[2];     c_0, c_1           four numbers each, c_0_x and so on
uniform ivec2 n;       n_x, n_y
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ...material.kinds import IntegerParameter
from ...spirv import Module
from ...spirv.values import Undefined, Value
from .adapter import Uniform

PLAIN = ("float", "bool", "int", "uint", "vec2", "vec3", "vec4")
INTEGERS = ("int", "uint")
MAX_NUMBERS = 64  # maximum number of values in a uniform that is divided


class Declared(NamedTuple):
    """A parameter of a shader: its name, its shape ("float", "vec3", ...), and the entry in the adapter."""

    name: str
    shape: str
    uniform: Uniform


class Piece(NamedTuple):
    """A part of a uniform or argument that is a parameter, and its value in the source, or None."""

    name: str
    shape: str
    default: Value = None


def pieces(module: Module, name: str, type: int, default: Value = None) -> Iterator[Piece]:
    """The parameters in a uniform or argument of a given type. Textures and more than 64 numbers have none."""
    kind, shape = module.type(type), module.shape(type)
    if shape in PLAIN:
        yield Piece(name, shape, default)
    elif kind.size <= MAX_NUMBERS:
        for place, (part, inside) in enumerate(_parts(module, name, type)):
            given = default[place] if isinstance(default, tuple) else None
            if given is None and kind.kind == "matrix":
                given = tuple(float(row == place) for row in range(module.type(inside).length))
            yield from pieces(module, part, inside, given)


def assembled(module: Module, name: str, type: int, values: Mapping[str, Value], zero: bool) -> Value:
    """The value of a uniform or argument, from the values of its parameters.

    zero  whether parts that are not parameters are 0; otherwise, they are undefined
    """
    kind, shape = module.type(type), module.shape(type)
    if shape in PLAIN and name in values:
        return values[name]
    if shape not in PLAIN and kind.size <= MAX_NUMBERS and (parts := _parts(module, name, type)):
        return tuple(assembled(module, part, inside, values, zero) for part, inside in parts)
    if zero:
        return module.zero(type)
    hint = f"only uniforms and arguments of at most {MAX_NUMBERS} numbers are parameters"
    return module.undefined(type, Undefined(f"'{name}' ({kind.size} numbers, {shape}) is not a parameter", hint, True))


def _parts(module: Module, name: str, type: int) -> list[tuple[str, int]]:
    """The names and types of the parts of a composite."""
    kind = module.type(type)
    if kind.kind == "struct":
        return [(f"{name}_{module.members.get((type, at), at)}", part) for at, part in enumerate(kind.parts)]
    if kind.kind == "vector":
        return [(f"{name}_{letter}", kind.parts[0]) for letter in "xyzw"[: kind.length]]
    if kind.kind in ("matrix", "array"):
        return [(f"{name}_{place}", kind.parts[0]) for place in range(kind.length)]
    return []


def integer(default: Any, doc: str, low: float, high: float) -> Any:
    """Declare an integer parameter, whose value affects the generated code."""
    metadata = {"kind": IntegerParameter, "doc": doc, "low": low, "high": high}
    return dataclasses.field(default=f"{default:g}", metadata=metadata)
