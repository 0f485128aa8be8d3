"""Calls of a shader's functions, recorded as calls: emitted text preserves the functions and their names, and a
function that is called many times is recorded once.

The arguments and results of a recorded function are values only. Pointers among its arguments, and the globals to which
it refers, are therefore passed as values, and those that it changes are returned as values.
"""

from __future__ import annotations

import inspect
import keyword
import re
from collections.abc import Callable, Sequence
from types import CodeType
from typing import Any

from ..ops import graph
from .composites import Cell, Pointer
from .module import Function, Module
from .reach import blocks_of
from .values import Value, leaves

Run = Callable[[Function, Sequence[Value], Value], Value]


def globals_of(module: Module, function: Function, known: dict[int, frozenset[int]]) -> frozenset[int]:
    """The ids of the globals to which a function and its callees may refer; `known` caches them by function."""
    if function.id not in known:
        every = [one for block in blocks_of(module, [function.id]) for one in block.instructions]
        known[function.id] = frozenset(id for one in every for id in one.operands if id in module.variables)
    return known[function.id]


class Recorded:
    """A function of the shader in the form that the recorder needs: with a name, a signature and values as arguments.

    run    executes the function on the machine of this call
    cells  the globals to which it may refer, by id
    """

    def __init__(self, module: Module, function: Function, run: Run, cells: dict[int, Cell]) -> None:
        self.module, self.function, self.run, self.cells = module, function, run, cells
        title = module.names.get(function.id, "").partition("(")[0]
        self.__name__ = re.sub(r"\W", "_", title).strip("_") or "function"
        self.__qualname__ = self.__name__
        self.__doc__ = f"The function {title} of the shader." if title else "A function of the shader."
        ids = [*(id for id, _ in function.parameters), *cells]
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        self.__signature__ = inspect.Signature([inspect.Parameter(name, kind) for name in _names(module, ids)])

    @property
    def __code__(self) -> CodeType:
        return self.__call__.__func__.__code__  # type: ignore[attr-defined, no-any-return]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Recorded) and self.module is other.module and self.function is other.function

    def __hash__(self) -> int:
        return hash((id(self.module), self.function.id))

    def __call__(self, **given: Value) -> dict[str, Any]:
        """The result, together with the values of changed pointers and globals, if there are any."""
        values = [_unpacked(value) for value in given.values()]
        pointers: dict[int, Pointer] = {}
        arguments: list[Value] = []
        for place, (value, (_, type)) in enumerate(zip(values, self.function.parameters, strict=False)):
            if self.module.type(type).kind == "pointer":
                pointers[place] = value = Pointer(Cell(value))
            arguments.append(value)
        before = {id: cell.value for id, cell in self.cells.items()}
        inner = dict(zip(self.cells, values[len(self.function.parameters) :], strict=True))
        for id, value in inner.items():
            self.cells[id].value = value
        try:
            result = self.run(self.function, arguments, True)
            changed = {id: cell.value for id, cell in self.cells.items() if cell.value is not inner[id]}
        finally:
            for id, value in before.items():
                self.cells[id].value = value
        stored = {place: one.cell.value for place, one in pointers.items() if one.cell.value is not values[place]}
        result = _packed(result)
        return result if not stored and not changed else {"result": result, "pointers": stored, "globals": changed}


def recorded(one: Recorded, arguments: Sequence[Value], mask: Value) -> Value:
    """The result of a recorded call; under a mask, pointers and globals are set to their new values."""
    given = [argument.load() if isinstance(argument, Pointer) else argument for argument in arguments]
    held = [cell.value for cell in one.cells.values()]
    results = graph.call(one, tuple(_packed(value) for value in (*given, *held)), {}, constants=True)
    if not isinstance(results, dict):
        return _unpacked(results)
    for place, value in results["pointers"].items():
        arguments[place].store(value, mask)
    for id, value in results["globals"].items():
        Pointer(one.cells[id]).store(value, mask)
    return _unpacked(results["result"])


class _Plain(tuple[float]):
    """A plain number as an argument. It remains a plain number, because it may be the bound of a loop."""


_VECTORS = {2: ("vec2", "xy"), 3: ("vec3", "xyz")}


def _packed(value: Value) -> Value:
    """A value in the form required by the recorder, which supports vectors of two and three numbers."""
    if type(value) is float:
        return _Plain((value,))
    if not isinstance(value, tuple) or len(value) not in _VECTORS:
        return value
    kinds = {part.type if isinstance(part, graph.Node) else type(part) for part in value}
    return graph.emit("vector", _VECTORS[len(value)][0], *value) if "float" in kinds <= {"float", float} else value


def _unpacked(value: Value) -> Value:
    if isinstance(value, _Plain):
        return value[0]
    for kind, parts in _VECTORS.values():
        if getattr(value, "type", "") == kind:
            return tuple(getattr(value, part) for part in parts)
    return value


def _names(module: Module, ids: Sequence[int]) -> list[str]:
    """Distinct names for the arguments."""
    names: list[str] = []
    for place, id in enumerate(ids):
        name = re.sub(r"\W", "_", module.names.get(id, "")).strip("_")
        if not name or name[0].isdigit() or keyword.iskeyword(name) or name == "self":
            name = f"given{place}"
        names.append(graph.first_free(name, names))
    return names


def named(value: Value, name: str) -> None:
    """Assign a variable's name in the shader to its numbers, if they are recorded and have no name."""
    every = list(leaves(value))
    if name in ("", "param"):  # "param" is glslang's own name for arguments
        return
    for place, leaf in enumerate(every):
        if isinstance(leaf, graph.Node) and leaf.depth > 0:
            part = "" if len(every) == 1 else f"_{'xyzw'[place]}" if len(every) <= 4 else f"_{place}"
            leaf.name, leaf.depth = f"{name}{part}", 0


def is_recordable(arguments: Sequence[Value]) -> bool:
    """Whether a call can be recorded: an argument is not constant, and no variable is passed twice."""
    cells = [argument.cell for argument in arguments if isinstance(argument, Pointer)]
    if len({id(cell) for cell in cells}) < len(cells):
        return False
    given = [argument.load() if isinstance(argument, Pointer) else argument for argument in arguments]
    return any(isinstance(leaf, graph.Node) for value in given for leaf in leaves(value))
