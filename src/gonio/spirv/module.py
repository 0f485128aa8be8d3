"""SPIR-V modules: words parsed into types, constants, variables and functions, with every index checked.

Modules are untrusted. Sizes are bounded, and a type may refer only to earlier types, so that no type is infinite.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from ..errors import InputError
from .opcodes import NAMES, REFUSED, TYPES
from .values import UNDEFINED, Undefined, Value, refuse, wrapped

SOURCE = "gonio-shader.frag"  # the file that the compiler reads; in messages, it is replaced by the user's file
MAGIC = 0x07230203
UNIFORM = 0  # storage class of a uniform outside blocks, UniformConstant
BUFFERS = (2, 9, 12)  # storage classes of blocks: uniform, push constants, storage
UNIFORMS = (UNIFORM, *BUFFERS)
_DEBUG = "NonSemantic.Shader.DebugInfo.100"
MAX_BYTES = 1 << 26
MAX_BOUND = 1 << 22  # number of ids, which is SPIR-V's own limit
MAX_LEAVES = 1 << 16  # number of scalars in one value


class Type(NamedTuple):
    """A type: kind is "float", "int", "uint", "bool", "vector", "matrix", "array", "struct", "pointer", "image", ...

    parts   the contained types; one for vectors, matrices and arrays
    length  number of components, columns or items; for a struct, number of leaves
    size    number of scalars in a value
    """

    kind: str
    parts: tuple[int, ...] = ()
    length: int = 1
    size: int = 1


class Instruction(NamedTuple):
    """One instruction: its name, result type and id (0 if it has none), operands, and source line."""

    name: str
    type: int
    result: int
    operands: tuple[int, ...]
    line: int
    file: str = ""


@dataclass
class Block:
    """A block: instructions, the last of which ends the block."""

    label: int
    instructions: list[Instruction] = field(default_factory=list)


@dataclass
class Function:
    """A function: its result type, its parameters as (id, type), and its blocks in the order of the module."""

    id: int
    type: int
    parameters: list[tuple[int, int]] = field(default_factory=list)
    blocks: dict[int, Block] = field(default_factory=dict)

    @cached_property
    def types(self) -> dict[int, int]:
        """The types of the function's values, by id; available once the function has been read."""
        every = [one for block in self.blocks.values() for one in block.instructions]
        return {**dict(self.parameters), **{one.result: one.type for one in every}}


@dataclass
class Module:
    """A module, with its contents by id.

    names      id -> name; for members, (struct type, index) -> name
    variables  id -> instruction, for variables outside functions
    constants  id -> value
    sets       id of an instruction set -> name
    refused    id of a function that a front end could not translate -> the error
    defaults   name of a uniform -> its initial value in the text, if any
    costs      id of a function -> number of instructions of a call, including callees; known after the first call
    images     id of an image type that is not supported -> its description
    entered    whether entry points are among the functions
    """

    types: dict[int, Type] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    members: dict[tuple[int, int], str] = field(default_factory=dict)
    constants: dict[int, Value] = field(default_factory=dict)
    variables: dict[int, Instruction] = field(default_factory=dict)
    functions: dict[int, Function] = field(default_factory=dict)
    sets: dict[int, str] = field(default_factory=dict)
    strings: dict[int, str] = field(default_factory=dict)
    refused: dict[int, InputError] = field(default_factory=dict)
    defaults: dict[str, Value] = field(default_factory=dict)
    costs: dict[int, int] = field(default_factory=dict)
    images: dict[int, str] = field(default_factory=dict)
    entered: bool = True

    def type(self, id: int) -> Type:
        """The type with an id. Raises InputError if there is none."""
        if id not in self.types:
            raise refuse(f"SPIR-V id {id} is not a type")
        return self.types[id]

    def function(self, name: str) -> list[Function]:
        """The functions with a name, that is, all its overloads."""
        return [one for id, one in self.functions.items() if self.names.get(id, "").partition("(")[0] == name]

    def zero(self, id: int) -> Value:
        """The value of a type in which all scalars are 0."""
        kind = self.type(id)
        if kind.kind in ("float", "int", "uint", "bool"):
            return {"float": 0.0, "int": 0, "uint": 0, "bool": False}[kind.kind]
        if kind.kind == "struct":
            return tuple(self.zero(part) for part in kind.parts)
        if kind.kind in ("vector", "matrix", "array"):
            return (self.zero(kind.parts[0]),) * kind.length
        return UNDEFINED

    def undefined(self, id: int, why: Undefined = UNDEFINED) -> Value:
        """The value of a type in which all scalars are undefined."""
        kind = self.type(id)
        if kind.kind == "struct":
            return tuple(self.undefined(part, why) for part in kind.parts)
        if kind.kind in ("vector", "matrix", "array"):
            return (self.undefined(kind.parts[0], why),) * kind.length
        return why

    def shape(self, id: int) -> str:
        """The GLSL name of a type: "float", "vec3"."""
        kind = self.type(id)
        if kind.kind == "pointer":
            return self.shape(kind.parts[0])
        if kind.kind == "vector":
            prefix = {"float": "", "int": "i", "uint": "u", "bool": "b"}.get(self.type(kind.parts[0]).kind, "?")
            return f"{prefix}vec{kind.length}"
        if kind.kind == "matrix":
            return f"mat{kind.length}"
        return self.names.get(id, kind.kind) if kind.kind == "struct" else kind.kind


def parse(data: bytes, where: str = "SPIR-V") -> Module:
    """The module in the bytes of a .spv. Raises InputError for damaged modules and unsupported types."""
    try:
        return _Parser(data, where).module
    except InputError as error:
        raise InputError(error.what, error.where or where, error.hint or "compile it again") from None
    except (IndexError, KeyError, struct.error, OverflowError, ValueError, RecursionError) as error:
        raise InputError(f"the SPIR-V is damaged: {type(error).__name__} {error}", where, "compile it again") from None


class _Parser:
    """One pass over the words."""

    def __init__(self, data: bytes, where: str) -> None:
        self.module, self.where = Module(), where
        self.line, self.file = 0, where
        self.function: Function | None = None
        self.block: Block | None = None
        for opcode, words in _instructions(data, where):
            self._take(opcode, words)
        if self.function is not None:
            raise InputError("the SPIR-V ends inside a function", where, "compile it again")

    def _take(self, opcode: int, words: tuple[int, ...]) -> None:
        module = self.module
        if opcode in (5, 7):  # OpName, OpString
            target = module.names if opcode == 5 else module.strings
            text = _text(words[1:])
            target[words[0]] = self.where if opcode == 7 and text.endswith(SOURCE) else text
        elif opcode == 6:  # OpMemberName
            module.members[words[0], words[1]] = _text(words[2:])
        elif opcode == 8:  # OpLine
            self.file, self.line = module.strings.get(words[0], self.where), words[1]
        elif opcode == 317:  # OpNoLine
            self.line = 0
        elif opcode == 12 and module.sets.get(words[2]) == _DEBUG:
            self._debug(words[1], words[3], words[4:])
        elif opcode == 11:  # OpExtInstImport
            module.sets[words[0]] = _text(words[1:])
        elif 19 <= opcode <= 39:
            if words[0] in module.types:  # a type that is redefined could contain itself
                raise ValueError(f"two types of id {words[0]}")
            module.types[words[0]] = self._type(opcode, words)
        elif opcode in NAMES:
            self._instruction(NAMES[opcode], words)
        elif opcode in REFUSED and self.block is not None:
            # rejected only if it is executed: a function that is not called may contain any instruction
            self._append(Instruction("refused", 0, 0, (opcode,), self.line, self.file))
        elif self.block is not None and opcode != 0:
            self._append(Instruction("refused", 0, 0, (opcode,), self.line, self.file))

    def _debug(self, result: int, number: int, operands: tuple[int, ...]) -> None:
        """Process source lines from Slang's compiler, which does not use OpLine."""
        if number == 35:  # DebugSource
            file = self.module.strings.get(operands[0], "")
            self.module.strings[result] = self.where if file in ("", "0") else file  # "0" is the text itself
        elif number == 103:  # DebugLine
            line = self.module.constants.get(operands[1], 0)
            self.file, self.line = self.module.strings.get(operands[0], self.where), line if type(line) is int else 0
        elif number == 104:  # DebugNoLine
            self.line = 0

    def _instruction(self, name: str, words: tuple[int, ...]) -> None:
        if name in ("Function", "FunctionParameter", "Label", "FunctionEnd"):
            self._structure(name, words)
            return
        typed = name not in ("Store", "Return", "ReturnValue", "Branch", "BranchConditional", "Switch", "Kill",
                             "Unreachable", "SelectionMerge", "LoopMerge", "CopyMemory")  # fmt: skip
        kind, result, operands = (words[0], words[1], words[2:]) if typed else (0, 0, words)
        one = Instruction(name, kind, result, operands, self.line, self.file)
        if name.startswith(("Constant", "SpecConstant")) or name == "Undef":
            self.module.constants[result] = self._constant(one)
        elif self.block is not None:
            self._append(one)
        elif name == "Variable":
            if self.module.type(kind).kind != "pointer":
                raise ValueError(f"a variable of id {result} whose type is no pointer")
            self.module.variables[result] = one
            if operands[0] == UNIFORM and len(operands) > 1:
                self.module.defaults[self.module.names.get(result, "")] = self.module.constants[operands[1]]

    def _append(self, one: Instruction) -> None:
        assert self.block is not None
        self.block.instructions.append(one)

    def _structure(self, name: str, words: tuple[int, ...]) -> None:
        if name == "Function":
            self.function = self.module.functions[words[1]] = Function(words[1], words[0])
        elif self.function is None:
            raise ValueError("a block outside a function")
        elif name == "FunctionParameter":
            self.function.parameters.append((words[1], words[0]))
        elif name == "Label":
            self.block = self.function.blocks[words[0]] = Block(words[0])
        else:
            self.function = self.block = None

    def _type(self, opcode: int, words: tuple[int, ...]) -> Type:
        kind, known = TYPES.get(opcode, "opaque"), self.module.type
        parts: tuple[int, ...]
        if kind in ("int", "float"):
            name = kind if kind == "float" or words[2] else "uint"
            return Type(name if words[1] == 32 else f"{words[1]}-bit {name}")
        if kind in ("vector", "matrix"):
            parts, count = (words[1],), words[2]
            if not 2 <= count <= 4:
                raise ValueError(f"{count} components")
        elif kind == "array":
            length = self.module.constants.get(words[2])
            if not isinstance(length, int) or length < 1:
                raise refuse("an array whose length is not a constant", where=self._place())
            parts, count = (words[1],), length
        elif kind == "struct":
            parts = words[1:]
            size = sum(known(part).size for part in parts)
            return Type(kind, parts, len(parts), self._bounded(max(size, 1)))
        elif kind == "pointer":
            return Type(kind, (words[2],), words[1]) if words[2] in self.module.types else Type("opaque")
        elif kind == "image":
            return self._image(words)
        else:
            return Type(kind, (words[1],) if kind == "sampled image" else ())
        return Type(kind, parts, count, self._bounded(count * known(parts[0]).size))

    def _image(self, words: tuple[int, ...]) -> Type:
        result, _, dimension, depth, arrayed, samples, *_ = words
        unread = {3: "a cube map", 4: "a rectangle texture", 5: "a texture buffer", 6: "a subpass input"}
        reasons = [unread.get(dimension, ""), "a shadow texture" if depth == 1 else "",
                   "an array of textures" if arrayed else "", "a multisample texture" if samples else ""]  # fmt: skip
        if any(reasons):
            self.module.images[result] = next(filter(None, reasons))
        return Type("image", (), dimension + 1)

    def _bounded(self, size: int) -> int:
        if size > MAX_LEAVES:
            raise refuse(f"an array of {size} numbers", f"at most {MAX_LEAVES}; use a texture", self._place())
        return size

    def _place(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.where

    def _constant(self, one: Instruction) -> Value:
        kind = self.module.type(one.type)
        if one.name in ("ConstantTrue", "SpecConstantTrue"):
            return True
        if one.name in ("ConstantFalse", "SpecConstantFalse"):
            return False
        if one.name == "ConstantNull":
            return self.module.zero(one.type)
        if one.name == "Undef":
            return self.module.undefined(one.type)
        if one.name in ("ConstantComposite", "SpecConstantComposite"):
            return tuple(self.module.constants[part] for part in one.operands)
        if one.name == "SpecConstantOp":
            raise refuse("a specialization constant with an operation", where=self._place())
        if kind.kind == "float":
            return float(struct.unpack("<f", struct.pack("<I", one.operands[0]))[0])
        return wrapped(one.operands[0], kind.kind == "int")


def _instructions(data: bytes, where: str) -> Iterator[tuple[int, tuple[int, ...]]]:
    """The opcode and operands of each instruction, after a check of the header."""
    if len(data) < 20 or len(data) % 4 or len(data) > MAX_BYTES:
        raise InputError(f"{len(data)} bytes, not a SPIR-V module", where, "give the .spv that a compiler wrote")
    order = "<" if struct.unpack("<I", data[:4])[0] == MAGIC else ">"
    words = struct.unpack(f"{order}{len(data) // 4}I", data)
    if words[0] != MAGIC or not 0 < words[3] <= MAX_BOUND:
        raise InputError("not a SPIR-V module by its first bytes", where, "give the .spv that a compiler wrote")
    at = 5
    while at < len(words):
        count, opcode = words[at] >> 16, words[at] & 0xFFFF
        if count == 0 or at + count > len(words):
            raise InputError(f"an instruction of {count} words at word {at} of {len(words)}", where, "compile it again")
        yield opcode, words[at + 1 : at + count]
        at += count


def _text(words: tuple[int, ...]) -> str:
    return struct.pack(f"<{len(words)}I", *words).split(b"\0", 1)[0].decode("utf-8", "replace")
