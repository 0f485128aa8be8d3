"""A shader's `main`, which is run in order to obtain the globals that it assigns before it calls the BRDF.

    float rough;
    void main() { rough = max(roughness, 0.04); color = brdf(l, v, n); }

If an instruction cannot run here, such as a read of a varying, only the values that depend on it become undefined. If
`main` cannot continue, as at a branch on a varying, all globals that it might still assign become undefined.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..errors import InputError
from .composites import Pointer
from .flow import targets
from .images import Texture
from .machine import Frame, Machine
from .module import Block, Function, Instruction, Module
from .reach import blocks_of, called, following, written
from .values import Undefined, Value, either


class _Reached(Exception):
    """Raised when the BRDF is about to be called."""


class Entry(Machine):
    """A machine that runs entry points as far as possible.

    until  ids of functions; an entry point ends when it first calls one of them
    """

    def __init__(
        self,
        module: Module,
        globals: Mapping[str, Value],
        textures: Mapping[str, Texture],
        zero: bool,
        until: frozenset[int],
    ) -> None:
        super().__init__(module, globals, textures, zero)
        self.until = until
        self._left: list[int] = []  # the blocks of the entry point that have not been completed

    def start(self, function: Function) -> None:
        """Run an entry point; its arguments, as in HLSL, are undefined or 0."""
        arguments = [self._missing(id, type) for id, type in function.parameters]
        try:
            self.call(function, arguments)
        except _Reached:
            pass
        except InputError as error:
            rest = following(function, self._left)
            self._lose([*rest, *blocks_of(self.module, called(rest))], _firm(error))

    def _missing(self, id: int, type: int) -> Value:
        name = self.module.names.get(id, "")
        why = Undefined(f"the argument '{name}' of `main` has no value", "make it an argument of the BRDF", True)
        kind = self.module.type(type)
        inside = kind.parts[0] if kind.kind == "pointer" else type
        return self.module.zero(inside) if self._zero else self.module.undefined(inside, why)

    def _lose(self, blocks: Iterable[Block], why: Undefined) -> None:
        """Make the globals to which blocks store undefined."""
        for id in written(self.module, blocks):
            cell = self._globals[id].cell
            cell.value = self.module.undefined(self.module.type(self.module.variables[id].type).parts[0], why)
            cell.partial = True

    def _block(self, frame: Frame, block: Block, mask: Value) -> None:
        if len(self._stack) == 1:
            self._left = [block.label, *frame.waiting]
        super()._block(frame, block, mask)

    def _leave(self, frame: Frame, block: Block, one: Instruction, mask: Value) -> bool:
        if one.name == "Kill":  # the BRDF is not called in these lanes
            frame.returned = either(frame.returned, mask)
            return True
        if len(self._stack) == 1 and one.name != "LoopMerge":  # all stores of the block are done
            self._left = [*targets(one), *frame.waiting]
        return super()._leave(frame, block, one, mask)

    def _called(self, frame: Frame, one: Instruction, mask: Value) -> Value:
        if one.operands[0] in self.until:
            raise _Reached
        depth = len(self._stack)
        try:
            return super()._called(frame, one, mask)
        except InputError as error:
            del self._stack[depth:]
            why = _firm(error)
            self._lose(blocks_of(self.module, [one.operands[0]]), why)
            self._lose_arguments(frame, one.operands[1:], why)
            return self.module.undefined(one.type, why)

    def _recorded(self, function: Function, arguments: Sequence[Value], mask: Value) -> Value:
        """Run the call directly instead of recording it, because an instruction that cannot run may end it anywhere."""
        return self._run(function, arguments, mask)

    def _lose_arguments(self, frame: Frame, ids: Sequence[int], why: Undefined) -> None:
        """Make the variables that a call might have set undefined."""
        for id in ids:
            pointer = self._get(frame, id)
            if isinstance(pointer, Pointer) and not isinstance(pointer.cell.value, Texture):
                pointer.cell.value, pointer.cell.partial = _like(pointer.cell.value, why), True

    def _value(self, frame: Frame, one: Instruction) -> Value:
        try:
            return super()._value(frame, one)
        except InputError as error:
            place = error.where or (f"{one.file}:{one.line}" if one.line else "")
            return self.module.undefined(one.type, Undefined(error.what, error.hint, True, place))


def prepared(
    module: Module,
    globals: Mapping[str, Value],
    textures: Mapping[str, Texture],
    zero: bool,
    starts: Sequence[Function],
    until: Iterable[int],
) -> Machine:
    """A machine whose globals have the values that entry points assign; for the arguments, see `Machine` and
    `Entry`."""
    entry, machine = Entry(module, globals, textures, zero, frozenset(until)), Machine(module, globals, textures, zero)
    for start in starts:
        entry.start(start)
    machine._globals, machine._read_only = entry._globals, entry._read_only
    return machine


def _firm(error: InputError) -> Undefined:
    return Undefined(error.what, error.hint, True, error.where)


def _like(value: Value, why: Undefined) -> Value:
    return tuple(_like(part, why) for part in value) if isinstance(value, tuple) else why
