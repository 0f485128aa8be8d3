"""Variables, pointers into them, and the instructions that decompose and compose values."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence

import numpy as np

from .. import ops
from .module import MAX_LEAVES, Module
from .values import Undefined, Value, both, leaves, refuse, select, static

MAX_DYNAMIC = 64  # maximum length of an array whose index is not constant, unless all items are constants
MAX_NESTED = 16


class Cell:
    """The value of a variable and its id in the enclosing function. `partial`: whether parts may be undefined."""

    __slots__ = ("id", "partial", "value")

    def __init__(self, value: Value, id: int = 0, partial: bool = True) -> None:
        self.value, self.id, self.partial = value, id, partial


class Pointer:
    """A part of a variable: the indices that lead to it."""

    __slots__ = ("cell", "path")

    def __init__(self, cell: Cell, path: tuple[Value, ...] = ()) -> None:
        self.cell, self.path = cell, path

    def load(self, where: str = "") -> Value:
        """The value; the file and line of this read are attached to undefined parts."""
        value = self.cell.value
        for index in self.path:
            value = at(value, index)
        if not self.cell.partial:
            return value
        result = placed(value, where)
        self.cell.partial = bool(self.path) or result is not value
        return result

    def store(self, value: Value, mask: Value) -> None:
        _size(value)  # a variable that is stored in a part of itself would grow without bound
        self.cell.value = _stored(self.cell.value, self.path, value, mask)


def placed(value: Value, where: str) -> Value:
    """The value, whose undefined scalars state where they are read; the same object if it has none."""
    if isinstance(value, Undefined):
        return value.at(where)
    if not isinstance(value, tuple):
        return value
    parts = tuple(placed(part, where) for part in value)
    return value if all(map(operator.is_, parts, value)) else parts


def _stored(old: Value, path: tuple[Value, ...], value: Value, mask: Value) -> Value:
    if not path:
        return select(mask, value, old)
    if isinstance(old, Undefined) or isinstance(path[0], Undefined):
        raise (old if isinstance(old, Undefined) else path[0]).error()
    if not isinstance(old, tuple):
        raise TypeError("an index into a number")
    index, rest = path[0], path[1:]
    if static(index):
        place = _inside(old, index)
        return (*old[:place], _stored(old[place], rest, value, mask), *old[place + 1 :])
    if len(old) > MAX_DYNAMIC:
        raise refuse(f"a store at a varying index into an array of {len(old)}", f"at most {MAX_DYNAMIC}")
    return tuple(_stored(item, rest, value, both(mask, index == float(place))) for place, item in enumerate(old))


def _inside(value: tuple[Value, ...], index: Value) -> int:
    """An index, clamped to the array as on GPUs with robust buffer access."""
    return min(max(int(index), 0), len(value) - 1)


def at(value: Value, index: Value) -> Value:
    """A part of a composite; if the index is not constant, it selects among all parts."""
    if isinstance(value, Undefined):
        return value
    if isinstance(index, Undefined):
        raise index.error()
    if not isinstance(value, tuple):
        raise TypeError("an index into a number")
    if static(index):
        return value[_inside(value, index)]
    parts = [leaves(part) for part in value]
    if all(static(leaf) for part in parts for leaf in part) and len({len(part) for part in parts}) == 1:
        table = ops.Table("constants", np.array([[float(leaf) for leaf in part] for part in parts]))
        return _shaped(value[0], iter(ops.fetch(table, index)))
    if len(value) > MAX_DYNAMIC:
        raise refuse(f"a varying index into an array of {len(value)}", f"at most {MAX_DYNAMIC}, or constants")
    result = value[-1]
    for place in range(len(value) - 2, -1, -1):
        result = select(index < place + 0.5, value[place], result)
    return result


def _shaped(like: Value, flat: object) -> Value:
    return tuple(_shaped(part, flat) for part in like) if isinstance(like, tuple) else next(flat)  # type: ignore[call-overload]


def scalars(value: Value) -> list[Value]:
    """The scalars of a value."""
    return leaves(value)


def _size(value: Value, depth: int = 0) -> int:
    if not isinstance(value, tuple):
        return 1
    if depth > MAX_NESTED:
        raise ValueError("a composite of composites without end")
    total = 0
    for part in value:
        total += _size(part, depth + 1)
        if total > MAX_LEAVES:
            raise refuse(f"a value of more than {MAX_LEAVES} numbers", "use a texture")
    return total


def _construct(module: Module, type: int, *parts: Value) -> Value:
    kind = module.type(type)
    flat: Sequence[Value] = parts
    if kind.kind == "vector":
        flat = [leaf for part in parts for leaf in leaves(part)]
    expected = len(kind.parts) if kind.kind == "struct" else kind.length
    if kind.kind not in ("vector", "matrix", "array", "struct") or len(flat) != expected:
        raise ValueError(f"{len(flat)} parts of a {kind.kind} of {expected}")
    result = tuple(flat)
    _size(result)
    return result


def _access(module: Module, type: int, base: Value, *path: Value) -> Value:
    if not isinstance(base, Pointer):
        raise TypeError("no pointer")
    return Pointer(base.cell, (*base.path, *path))


def _insert_dynamic(module: Module, type: int, vector: Value, value: Value, index: Value) -> Value:
    return _stored(vector, (index,), value, True)


COMPOSED: dict[str, Callable[..., Value]] = {
    "CompositeConstruct": _construct,
    "AccessChain": _access,
    "VectorExtractDynamic": lambda module, type, vector, index: at(vector, index),
    "VectorInsertDynamic": _insert_dynamic,
}

# number of operands that are ids; literal numbers follow
LITERAL = {"CompositeExtract": 1, "CompositeInsert": 2, "VectorShuffle": 2}


def literal(name: str, values: list[Value], numbers: Sequence[int]) -> Value:
    """The result of an instruction whose last operands are literal numbers."""
    if name == "CompositeExtract":
        value = values[0]
        for number in numbers:
            value = value[number] if isinstance(value, tuple) else _no_part(value)
        return value
    if name == "CompositeInsert":
        _size(values[0])
        return _stored(values[1], tuple(numbers), values[0], True)
    both_vectors = [*leaves(values[0]), *leaves(values[1])]
    return tuple(0.0 if number == 0xFFFFFFFF else both_vectors[number] for number in numbers)


def _no_part(value: Value) -> Value:
    if isinstance(value, Undefined):
        return value
    raise TypeError("a part of a number")
