"""Construction of a module: types and constants by id, and blocks of instructions, with constants folded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ..machine import Machine
from ..module import MAX_LEAVES, Block, Function, Instruction, Module
from ..module import Type as ModuleType
from ..values import Value as Number
from ..values import leaves, refuse
from .types import ABSTRACT_FLOAT, ABSTRACT_INT, BOOL, FLOAT, INT, UINT, Type, common, concrete

MAX_CONSTANTS = 1 << 20  # total number of numbers in the constants of a module
STANDARD = 1  # the id of the instruction set GLSL.std.450


class Value(NamedTuple):
    """A value: its id in the module, and its type."""

    id: int
    type: Type


class Emitter:
    """A module under construction, and the function that is being written.

    where, line  file and line of the text, for instructions and errors
    structs      name of a struct -> names and types of its members
    """

    def __init__(self) -> None:
        self.module = Module(sets={STANDARD: "GLSL.std.450"}, entered=False)
        self.where, self.line = "", 0
        self.structs: dict[str, tuple[tuple[str, ...], tuple[Type, ...]]] = {}
        self.function: Function | None = None
        self.block: Block | None = None
        self.variables: list[Instruction] = []  # variables of the function
        self._last, self._leaves = STANDARD, 0
        self._ids: dict[Type, int] = {}
        self._constants: dict[tuple[Type, str], int] = {}
        self._abstract: dict[int, Type] = {}  # constants of abstract type
        self._machine = Machine(self.module)

    def fresh(self) -> int:
        """An unused id."""
        self._last += 1
        return self._last

    def error(self, what: str, hint: str = "") -> InputError:
        """The error at the current line."""
        return refuse(what, hint, f"{self.where}:{self.line}")

    # ------------------------------------------------------------------ types and constants

    def type_id(self, type: Type) -> int:
        """The id of a type in the module. Raises InputError if it has more numbers than a value may have."""
        if type not in self._ids:
            parts = self.structs[type.name][1] if type.kind == "struct" else type.parts
            ids = tuple(self.type_id(part) for part in parts)
            kind = {"abstract float": "float", "abstract int": "int", "texture": "image"}.get(type.kind, type.kind)
            sizes = [self.module.types[id].size for id in ids]
            size = sum(sizes) if kind == "struct" else sizes[0] * type.length if sizes and kind != "pointer" else 1
            if size > MAX_LEAVES:
                raise self.error(f"an array of {size} numbers", f"at most {MAX_LEAVES}; use a texture")
            id = self._ids[type] = self.fresh()
            length = len(ids) if kind == "struct" else type.length
            self.module.types[id] = ModuleType(kind, ids, length, max(size, 1))
            if kind == "struct":
                self.module.names[id] = type.name
                for place, name in enumerate(self.structs[type.name][0]):
                    self.module.members[id, place] = name
        return self._ids[type]

    def constant(self, number: Number, type: Type) -> Value:
        """A constant. Numbers of type f32 are rounded to single precision, as in the shader."""
        with np.errstate(all="ignore"):
            number = self._rounded(number, type)
        if not isinstance(number, tuple):
            key = type, repr(number)
            if key not in self._constants:
                self._constants[key] = self._constant_id(number, type)
            return Value(self._constants[key], type)
        return Value(self._constant_id(number, type), type)

    def _constant_id(self, number: Number, type: Type) -> int:
        self.type_id(type)
        self._leaves += len(leaves(number))
        if self._leaves > MAX_CONSTANTS:
            raise self.error(f"constants of more than {MAX_CONSTANTS} numbers", "use a texture")
        id = self.fresh()
        self.module.constants[id] = number
        if concrete(type) != type:
            self._abstract[id] = type
        return id

    def _rounded(self, number: Number, type: Type) -> Number:
        if isinstance(number, tuple):
            parts = self.structs[type.name][1] if type.kind == "struct" else (type.parts[0],) * len(number)
            return tuple(self._rounded(one, part) for one, part in zip(number, parts, strict=True))
        if type.kind == "float":
            return float(np.float32(number))
        if type.kind in ("int", "uint"):
            value = int(number) & 0xFFFFFFFF
            return value - (1 << 32) if type.kind == "int" and value >= 1 << 31 else value
        return int(number) if type.kind == "abstract int" else number

    def zero(self, type: Type) -> Value:
        """The value of a type in which all numbers are 0."""
        return self.constant(self.module.zero(self.type_id(type)), type)

    def known(self, value: Value) -> Number | None:
        """The number of a constant; None for other values."""
        return self.module.constants.get(value.id)

    # ------------------------------------------------------------------ instructions

    def emit(self, name: str, type: Type, *operands: int, literals: int = 0) -> Value:
        """The value of an instruction, folded if all operands are constants.

        literals  how many of the last operands are literal numbers, not ids
        """
        first, last = 2 * (name == "ExtInst"), len(operands) - literals
        if all(id in self.module.constants for id in operands[first:last]):
            one = Instruction(name, self.type_id(type), self.fresh(), operands, self.line, self.where)
            return self.constant(self._machine.folded(one), type)
        with_concrete_type = [self._with_concrete_type(id) for id in operands[first:last]]
        return self.always(name, concrete(type), *operands[:first], *with_concrete_type, *operands[last:])

    def _with_concrete_type(self, id: int) -> int:
        """An operand converted to a concrete type."""
        return self.with_concrete_type(Value(id, self._abstract[id])).id if id in self._abstract else id

    def standard(self, number: int, type: Type, *operands: int) -> Value:
        """The value of a function of GLSL.std.450."""
        return self.emit("ExtInst", type, STANDARD, number, *operands)

    def always(self, name: str, type: Type, *operands: int) -> Value:
        """The value of an instruction, never folded."""
        one = Instruction(name, self.type_id(type), self.fresh(), operands, self.line, self.where)
        self._append(one)
        return Value(one.result, type)

    def do(self, name: str, *operands: int) -> None:
        """Append an instruction without a value."""
        self._append(Instruction(name, 0, 0, operands, self.line, self.where))

    def _append(self, one: Instruction) -> None:
        if self.block is None:
            raise self.error("not a constant expression", "outside functions, numbers must be constants")
        self.block.instructions.append(one)

    def variable(self, type: Type) -> Value:
        """A pointer to a new variable of the function."""
        pointer = Type("pointer", (type,), 7)
        one = Instruction("Variable", self.type_id(pointer), self.fresh(), (7,), self.line, self.where)
        self.variables.append(one)
        return Value(one.result, pointer)

    def start(self, label: int) -> None:
        """Begin a block."""
        assert self.function is not None
        self.block = self.function.blocks[label] = Block(label)

    # ------------------------------------------------------------------ conversions

    def converted(self, value: Value, type: Type, what: str = "a value") -> Value:
        """A value of a required type: literals are converted to the type, other values must have it."""
        if value.type == type:
            return value
        number = self.known(value)
        if number is not None and _fits(value.type, type):
            return self.constant(_as(number, type), type)
        raise self.error(f"{what} of type {value.type} where {type} is expected", f"convert it: {type}(...)")

    def with_concrete_type(self, value: Value) -> Value:
        """A value converted to a concrete type."""
        return self.converted(value, concrete(value.type))

    def together(self, values: Sequence[Value], what: str, floats: bool = False) -> list[Value]:
        """Values converted to a common scalar type. Raises InputError if there is none."""
        scalar = values[0].type.scalar
        for value in values:
            joined = common(scalar, value.type.scalar) if value.type.numbers else None
            if joined is None:
                types = ", ".join(str(one.type) for one in values)
                raise self.error(f"{what} of {types}", "convert them to one type")
            scalar = joined
        if floats and scalar == ABSTRACT_INT:
            scalar = ABSTRACT_FLOAT
        if floats and scalar not in (FLOAT, ABSTRACT_FLOAT):
            raise self.error(f"{what} of {scalar}", "convert it: f32(...)")
        return [self.converted(value, value.type.of(scalar)) for value in values]

    def cast(self, value: Value, scalar: Type) -> Value:
        """f32(x), i32(x), u32(x) and bool(x), applied to each component."""
        source, target = value.type.scalar, value.type.of(scalar)
        if source == scalar:
            return value
        if common(source, scalar) == scalar:
            return self.converted(value, target)
        if source in (ABSTRACT_FLOAT, ABSTRACT_INT):
            value = self.with_concrete_type(value)
            return self.cast(value, scalar)
        if scalar == BOOL:
            name = "FUnordNotEqual" if source == FLOAT else "INotEqual"
            return self.emit(name, target, value.id, self.zero(value.type).id)
        if source == BOOL:
            one, zero = (self.constant(_filled(value.type, number), target) for number in (1, 0))
            return self.emit("Select", target, value.id, one.id, zero.id)
        if scalar == FLOAT:
            return self.emit("ConvertIToF", target, value.id)
        if source == FLOAT:
            return self.emit("ConvertFToI", target, value.id)
        return self.emit("CopyObject", target, value.id)  # integers that are not constant are floats without bits


def _filled(type: Type, number: Any) -> Number:
    return (number,) * type.length if type.kind == "vector" else number


def _fits(source: Type, target: Type) -> bool:
    """Whether a literal's type may be converted to another."""
    if (source.kind, source.length) == (target.kind, target.length) and source.kind in ("vector", "matrix", "array"):
        return source.parts == target.parts or _fits(source.parts[0], target.parts[0])
    return source in (ABSTRACT_FLOAT, ABSTRACT_INT) and common(source, target) == target


def _as(number: Number, type: Type) -> Number:
    if isinstance(number, tuple):
        return tuple(_as(one, type.parts[0]) for one in number)
    return float(number) if type in (FLOAT, ABSTRACT_FLOAT) else int(number) if type in (INT, UINT) else number
