"""WGSL's expressions as instructions: names, members, indices, operators and calls."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple, Protocol

from ...errors import did_you_mean
from ..module import Block
from . import builtins, constructors, operations
from .emitter import Emitter, Value
from .sources import Unit
from .syntax import Call, Chain, Expression, Index, Literal, Member, Name, Unary
from .types import ABSTRACT_FLOAT, ABSTRACT_INT, BOOL, FLOAT, INT, MATRICES, UINT, VECTORS, Type, vector

_LETTERS = {letter: place for letters in ("xyzw", "rgba") for place, letter in enumerate(letters)}


class Place(NamedTuple):
    """A variable or a part of one: a pointer, the type to which it points, and the components of a swizzle."""

    pointer: int
    type: Type
    swizzle: tuple[int, ...] = ()


class Signature(NamedTuple):
    """A function of the shader: its id, and the types of its parameters and result."""

    id: int
    parameters: tuple[Type, ...]
    result: Type


class Names(Protocol):
    """The declarations outside functions."""

    def value(self, unit: Unit, name: str, line: int) -> Value | Place | None: ...

    def signature(self, unit: Unit, name: str, line: int) -> Signature | None: ...

    def type(self, unit: Unit, expression: Expression) -> Type | None: ...


class Expressions:
    """Expressions of one file. `scopes` contains the declarations in a function, innermost last."""

    def __init__(self, emitter: Emitter, names: Names, unit: Unit) -> None:
        self.emitter, self.names, self.unit = emitter, names, unit
        self.scopes: list[dict[str, Value | Place]] = []

    def value(self, node: Expression) -> Value:
        """The value of an expression. Raises InputError, with file and line."""
        self.emitter.line = node.line
        if isinstance(node, Literal):
            return _literal(self.emitter, node.text)
        if isinstance(node, Chain):
            value = self.value(node.first)
            for sign, right, line in node.rest:
                value = self._binary(sign, value, right, line)
            return value
        if isinstance(node, Unary) and node.sign not in "&*":
            inside = self.value(node.inside)
            self.emitter.line = node.line
            return operations.unary(self.emitter, node.sign, inside)
        if isinstance(node, Call):
            return self._call(node)
        if isinstance(node, Unary) and node.sign == "&":
            place = self.place(node.inside)
            if place is None or place.swizzle:
                raise self.emitter.error("'&' of a value that is not a variable", "declare it with var")
            return Value(place.pointer, Type("pointer", (place.type,), 7))
        place = self.place(node)
        if place is not None:
            return self.loaded(place)
        return self._part(node)

    def _part(self, node: Expression) -> Value:
        """The value of a name, or a part of a value."""
        if isinstance(node, Name):
            named = self._named(node)
            assert isinstance(named, Value)
            return named
        if isinstance(node, Member):
            base = self.value(node.base)
            self.emitter.line = node.line
            return self._member(base, node.name)
        if isinstance(node, Index):
            base, index = self.value(node.base), self._index(node)
            number = self.emitter.known(index)
            base = base if number is not None else self.emitter.with_concrete_type(base)
            item = self._item(base.type)
            if number is not None:
                return self.emitter.emit(
                    "CompositeExtract", item, base.id, self._inside(int(number), base.type), literals=1
                )
            return self.emitter.emit("VectorExtractDynamic", item, base.id, index.id)
        raise self.emitter.error("'*' of a value that is not a pointer")

    # ------------------------------------------------------------------ variables

    def place(self, node: Expression) -> Place | None:
        """The variable, or the part of one, to which an expression refers; None for values."""
        self.emitter.line = node.line
        if isinstance(node, Name):
            named = self._named(node)
            return named if isinstance(named, Place) else None
        if isinstance(node, Unary) and node.sign == "*":
            return self._behind(self.value(node.inside))
        if not isinstance(node, Member | Index):
            return None
        base = self.place(node.base)
        if base is not None and base.type.kind == "pointer":
            base = self._behind(self.loaded(base))
        if base is None and isinstance(node.base, Name):
            base = self._behind(self.value(node.base), asked=False)
        if base is None or base.swizzle:
            return None
        if isinstance(node, Index):
            index = self._index(node)
            item = self._item(base.type)
            number = self.emitter.known(index)
            if number is not None:
                self._inside(int(number), base.type)
            return self._step(base, item, index)
        self.emitter.line = node.line
        if base.type.kind == "struct":
            place, type = self._field(base.type, node.name)
            return self._step(base, type, self.emitter.constant(place, INT))
        swizzle = self._swizzle(base.type, node.name)
        if len(swizzle) > 1:
            return Place(base.pointer, base.type, swizzle)
        return self._step(base, base.type.parts[0], self.emitter.constant(swizzle[0], INT))

    def _behind(self, pointer: Value, asked: bool = True) -> Place | None:
        if pointer.type.kind != "pointer":
            if asked:
                raise self.emitter.error(f"'*' of {pointer.type}", "a pointer")
            return None
        return Place(pointer.id, pointer.type.parts[0])

    def _step(self, base: Place, type: Type, index: Value) -> Place:
        pointer = self.emitter.always("AccessChain", Type("pointer", (type,), 7), base.pointer, index.id)
        return Place(pointer.id, type)

    def loaded(self, place: Place) -> Value:
        """The current value of a variable."""
        composite = self.emitter.always("Load", place.type, place.pointer)
        return self._shuffled(composite, place.swizzle) if place.swizzle else composite

    def store(self, place: Place, value: Value) -> None:
        """Assign to a variable, or to the components of a swizzle."""
        if not place.swizzle:
            self.emitter.do("Store", place.pointer, self.emitter.converted(value, place.type).id)
            return
        value = self.emitter.converted(value, vector(place.type.scalar, len(place.swizzle)))
        composite = self.emitter.always("Load", place.type, place.pointer)
        for at, component in enumerate(place.swizzle):
            part = self.emitter.emit("CompositeExtract", place.type.scalar, value.id, at, literals=1)
            composite = self.emitter.emit("CompositeInsert", place.type, part.id, composite.id, component, literals=1)
        self.emitter.do("Store", place.pointer, composite.id)

    # ------------------------------------------------------------------ parts

    def _named(self, node: Name) -> Value | Place:
        for scope in reversed(self.scopes):
            if node.text in scope:
                return scope[node.text]
        named = self.names.value(self.unit, node.text, node.line)
        self.emitter.line = node.line
        if named is None:
            known = [name for scope in self.scopes for name in scope] + list(self.unit.declarations)
            raise self.emitter.error(f"unknown name '{node.text}'", did_you_mean(node.text, known))
        return named

    def _index(self, node: Index) -> Value:
        index = self.emitter.with_concrete_type(self.value(node.index))
        self.emitter.line = node.line
        if index.type not in (INT, UINT):
            raise self.emitter.error(f"an index of type {index.type}", "convert it: i32(...)")
        return index

    def _item(self, type: Type) -> Type:
        if type.kind not in ("vector", "matrix", "array"):
            raise self.emitter.error(f"an index into {type}")
        return type.parts[0]

    def _inside(self, index: int, type: Type) -> int:
        if not 0 <= index < type.length:
            raise self.emitter.error(f"the index {index} into {type}", f"use 0 to {type.length - 1}")
        return index

    def _field(self, type: Type, name: str) -> tuple[int, Type]:
        names, types = self.emitter.structs[type.name]
        if name not in names:
            raise self.emitter.error(f"{type} has no member '{name}'", did_you_mean(name, list(names)))
        return names.index(name), types[names.index(name)]

    def _swizzle(self, type: Type, name: str) -> tuple[int, ...]:
        places = tuple(_LETTERS.get(letter, 4) for letter in name)
        if type.kind != "vector" or not 1 <= len(places) <= 4 or max(places) >= type.length:
            raise self.emitter.error(f"{type} has no member '{name}'")
        return places

    def _member(self, base: Value, name: str) -> Value:
        if base.type.kind == "struct":
            place, type = self._field(base.type, name)
            return self.emitter.emit("CompositeExtract", type, base.id, place, literals=1)
        return self._shuffled(base, self._swizzle(base.type, name))

    def _shuffled(self, base: Value, places: tuple[int, ...]) -> Value:
        scalar = base.type.scalar
        if len(places) == 1:
            return self.emitter.emit("CompositeExtract", scalar, base.id, places[0], literals=1)
        type = vector(scalar, len(places))
        return self.emitter.emit("VectorShuffle", type, base.id, base.id, *places, literals=len(places))

    # ------------------------------------------------------------------ operators and calls

    def _binary(self, sign: str, left: Value, right: Expression, line: int) -> Value:
        if sign in ("&&", "||") and self.emitter.block is not None:
            return self._short(sign, left, right, line)
        value = self.value(right)
        self.emitter.line = line
        return operations.binary(self.emitter, sign, left, value)

    def _short(self, sign: str, left: Value, right: Expression, line: int) -> Value:
        """`&&` or `||`; if the right side calls functions of the shader, it runs only where needed."""
        emitter = self.emitter
        before, label = emitter.block, emitter.fresh()
        assert before is not None and emitter.function is not None
        aside = emitter.block = Block(label)
        value = self.value(right)
        emitter.line = line
        if emitter.block is aside and not any(one.name == "FunctionCall" for one in aside.instructions):
            before.instructions += aside.instructions
            emitter.block = before
            return operations.binary(emitter, sign, left, value)
        if left.type != BOOL or value.type != BOOL:
            raise emitter.error(f"'{sign}' of {left.type}, {value.type}")
        end, after, merge = emitter.block, emitter.fresh(), emitter.variable(BOOL)
        emitter.function.blocks[label] = aside
        emitter.do("Store", merge.id, value.id)
        emitter.do("Branch", after)
        assert end is emitter.block
        emitter.block = before
        emitter.do("Store", merge.id, left.id)
        emitter.do("SelectionMerge", after, 0)
        emitter.do("BranchConditional", left.id, *((label, after) if sign == "&&" else (after, label)))
        emitter.start(after)
        return emitter.always("Load", BOOL, merge.id)

    def _call(self, node: Call) -> Value:
        name = node.function.text
        made: Callable[[list[Value]], Value | None] | None = None
        if name == "bitcast" and len(node.function.arguments) == 1:
            type = self.names.type(self.unit, node.function.arguments[0])
            made = lambda values: builtins.bitcast(self.emitter, _known(type), values[0])  # noqa: E731
        elif (type := self.names.type(self.unit, node.function)) is not None:
            made = lambda values: constructors.constructed(self.emitter, _known(type), values)  # noqa: E731
        elif (signature := self.names.signature(self.unit, name, node.line)) is not None:
            made = lambda values: self._applied(name, signature, values)  # noqa: E731
        elif name in VECTORS or name in MATRICES or name == "array":
            made = lambda values: constructors.inferred(self.emitter, name, values)  # noqa: E731
        else:
            made = lambda values: builtins.called(self.emitter, name, values)  # noqa: E731
            if what := builtins.refused(name):
                self.emitter.line = node.line
                raise self.emitter.error(
                    f"{what} is not supported", "a BSDF is a function of directions and parameters alone"
                )
        values = [self.value(one) for one in node.arguments]
        self.emitter.line = node.line
        result = made(values)
        if result is None:
            raise self.emitter.error(f"unknown function '{name}'", did_you_mean(name, list(self.unit.declarations)))
        return result

    def _applied(self, name: str, signature: Signature, values: list[Value]) -> Value:
        if len(values) != len(signature.parameters):
            raise self.emitter.error(f"'{name}' of {len(values)} values", f"{len(signature.parameters)} expected")
        given = [
            self.emitter.converted(value, type, f"an argument of '{name}'")
            for value, type in zip(values, signature.parameters, strict=True)
        ]
        return self.emitter.always("FunctionCall", signature.result, signature.id, *[value.id for value in given])


def _known(type: Type | None) -> Type:
    assert type is not None
    return type


def _literal(emitter: Emitter, text: str) -> Value:
    if text in ("true", "false"):
        return emitter.constant(text == "true", BOOL)
    hexadecimal = text.lower().startswith("0x")
    suffix = text[-1] if text[-1] in ("iu" if hexadecimal and "p" not in text.lower() else "fhiu") else ""
    digits = text.removesuffix(suffix) if suffix else text
    if suffix == "h":
        raise emitter.error(f"the 16-bit number {text}", "declare 32-bit numbers")
    if len(digits) > 400:
        raise emitter.error(f"a number of {len(digits)} digits")
    if re.search(r"[.pP]" if hexadecimal else r"[.eE]", digits) or suffix == "f":
        try:
            value = float.fromhex(digits) if hexadecimal else float(digits)
        except (ValueError, OverflowError):
            raise emitter.error(f"'{text}' is not a number") from None
        return emitter.constant(value, FLOAT if suffix == "f" else ABSTRACT_FLOAT)
    try:
        number = int(digits, 16 if hexadecimal else 10)
    except ValueError:
        raise emitter.error(f"'{text}' is not a number") from None
    if number >= 1 << (64 if not suffix else 32):
        raise emitter.error(f"the number {text[:40]} does not fit in 32 bits")
    return emitter.constant(number, {"i": INT, "u": UINT, "": ABSTRACT_INT}[suffix])
