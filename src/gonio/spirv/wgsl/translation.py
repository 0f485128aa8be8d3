"""A WGSL shader as a module; declarations outside functions are translated when they are first used.

All functions of the shader's own file are translated; functions of imported files are translated when they are called.
A function with unsupported constructs is rejected only if it is called, so that a file may contain such functions.

An `override` of type f32 without a value in `defines` is a uniform with a default; an override that depends on such an
override is computed before any function runs. Other overrides are constants, because loops and array lengths may depend
on them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...errors import InputError
from ..module import Function as ModuleFunction
from ..module import Instruction, Module
from ..values import refuse
from .emitter import Emitter, Value
from .expressions import Expressions, Place, Signature
from .sources import Sources, Unit
from .statements import Body
from .syntax import Alias, Assign, Block, Declared, Expression, Function, Name, Struct, names_in
from .types import FLOAT, MATRICES, NAMED, REFUSED, TEXTURES, VECTORS, VOID, Type, concrete, matrix, vector

MAX_INSIDE = 32  # depth of declarations that depend on each other
# SPIR-V's storage classes
_SPACES = {"uniform": 2, "storage": 12, "push_constant": 9, "immediate": 9, "private": 6, "": 0}


def translated(
    text: str, where: str, defines: Mapping[str, str], folders: Sequence[Path], read: list[Path] | None = None
) -> Module:
    """The module of a WGSL text.

    where    name of the file, for messages
    defines  names for #ifdef, and values of overrides
    folders  folders from which #import may read
    read     receives the files that are imported
    Raises InputError, with file and line.
    """
    try:
        sources = Sources(text, where, defines, folders)
        module = _Translation(sources).module()
        if read is not None:
            read += sources.read
        return module
    except RecursionError:
        raise refuse("expressions are nested too deeply", "name the parts with let", where) from None


class _Translation:
    """The declarations outside functions, by file and name."""

    def __init__(self, sources: Sources) -> None:
        self.sources, self.emitter = sources, Emitter()
        self._values: dict[tuple[str, str], Value | Place] = {}
        self._types: dict[tuple[str, str], Type] = {}
        self._signatures: dict[tuple[str, str], Signature] = {}
        self._queue: deque[tuple[Unit, Function, Signature]] = deque()
        self._inside: list[tuple[str, str]] = []

    def module(self) -> Module:
        main, module = self.sources.main, self.emitter.module
        self.emitter.where = main.where
        for one in main.declarations.values():
            try:
                if isinstance(one, Function) and not one.entry:
                    self.signature(main, one.name, one.line)
                elif isinstance(one, Declared) and one.kind == "var":
                    self.value(main, one.name, one.line)
            except InputError:  # rejected only where it is used
                continue
        for assertion in main.assertions:
            held = Expressions(self.emitter, self, main).value(assertion.condition)
            if self.emitter.known(held) is False:
                raise self.emitter.error("const_assert does not hold")
        while self._queue:
            unit, function, signature = self._queue.popleft()
            self.emitter.where = unit.where
            try:
                module.functions[signature.id] = Body(self.emitter, self, unit, signature).write(function)
            except InputError as error:
                module.functions[signature.id] = self._declaration(function, signature)
                module.refused[signature.id] = error
        return module

    def _declaration(self, function: Function, signature: Signature) -> ModuleFunction:
        """A function without a body."""
        made = ModuleFunction(signature.id, self.emitter.type_id(signature.result))
        for parameter, type in zip(function.parameters, signature.parameters, strict=True):
            id = self.emitter.fresh()
            self.emitter.module.names[id] = parameter.name
            made.parameters.append((id, self.emitter.type_id(type)))
        return made

    # ------------------------------------------------------------------ lookups by expressions

    def value(self, unit: Unit, name: str, line: int) -> Value | Place | None:
        """The constant or variable with a name; None if there is none."""
        home, declared = self.sources.find(unit, name, line) or (unit, None)
        if not isinstance(declared, Declared):
            return None
        key = home.where, declared.name
        if key not in self._values:
            with _Entered(self, key, home, declared.line):
                derived = self._computed if self._derived(home, declared) else self._constant
                self._values[key] = (self._variable if declared.kind == "var" else derived)(home, declared)
        return self._values[key]

    def signature(self, unit: Unit, name: str, line: int) -> Signature | None:
        """The function with a name; None if there is none."""
        home, function = self.sources.find(unit, name, line) or (unit, None)
        if not isinstance(function, Function):
            return None
        key = home.where, function.name
        if key not in self._signatures:
            with _Entered(self, key, home, function.line):
                types = tuple(self._asked(home, one.type) for one in function.parameters)
                result = self._asked(home, function.result) if function.result is not None else VOID
            signature = self._signatures[key] = Signature(self.emitter.fresh(), types, result)
            title = self._title(home, function.name)
            self.emitter.module.names[signature.id] = "main_" if title == "main" else title
            self._queue.append((home, function, signature))
        return self._signatures[key]

    def type(self, unit: Unit, expression: Expression) -> Type | None:
        """The type to which an expression refers; None if it does not refer to a type."""
        if not isinstance(expression, Name):
            return None
        name, arguments = expression.text, expression.arguments
        declared = unit.declarations.get(name)
        if declared is None and not arguments and name in NAMED:
            return NAMED[name]
        if declared is None and arguments:
            return self._generated(unit, expression)
        if declared is None and (name in REFUSED or name.startswith("texture_")):
            what = REFUSED.get(name, f"the texture type {name}")
            raise refuse(f"{what} is not supported", "", f"{unit.where}:{expression.line}")
        home, one = self.sources.find(unit, name, expression.line) or (unit, None)
        if not isinstance(one, Struct | Alias):
            return None
        key = home.where, one.name
        if key not in self._types:
            with _Entered(self, key, home, one.line):
                self._types[key] = self._struct(home, one) if isinstance(one, Struct) else self._asked(home, one.type)
        return self._types[key]

    # ------------------------------------------------------------------ declarations

    def _title(self, unit: Unit, name: str) -> str:
        return name if unit is self.sources.main else f"{unit.path}::{name}"

    def _asked(self, unit: Unit, expression: Expression) -> Type:
        type = self.type(unit, expression)
        if type is None:
            name = expression.text if isinstance(expression, Name) else "an expression"
            raise refuse(f"'{name}' is not a type", "declare it", f"{unit.where}:{expression.line}")
        return type

    def _generated(self, unit: Unit, node: Name) -> Type | None:
        name, arguments, place = node.text, node.arguments, f"{unit.where}:{node.line}"
        if name in VECTORS or name in MATRICES:
            scalar = self._asked(unit, arguments[0])
            if len(arguments) != 1 or scalar.kind not in ("float", "int", "uint", "bool"):
                raise refuse(f"{name}<{scalar}> is not supported", f"use {name}<f32>", place)
            return vector(scalar, VECTORS[name]) if name in VECTORS else matrix(scalar, *MATRICES[name])
        if name == "array":
            item = self._asked(unit, arguments[0])
            if len(arguments) != 2:
                raise refuse("an array without a length", "write array<f32, 4>", place)
            return Type("array", (item,), self._length(unit, arguments[1], place))
        if name in ("ptr", "ref") and len(arguments) >= 2:
            return Type("pointer", (self._asked(unit, arguments[1]),), 7)
        if name in TEXTURES:
            if self._asked(unit, arguments[0]) != FLOAT:
                raise refuse(f"{name} of integers is not supported", f"use {name}<f32>", place)
            return Type("texture", (), TEXTURES[name])
        if name in REFUSED or name.startswith("texture_"):
            raise refuse(f"{REFUSED.get(name, f'the texture type {name}')} is not supported", "", place)
        return None

    def _length(self, unit: Unit, expression: Expression, place: str) -> int:
        value = Expressions(self.emitter, self, unit).value(expression)
        length = self.emitter.known(value)
        if not isinstance(length, int) or isinstance(length, bool) or length < 1:
            raise refuse("an array whose length is not a constant", "declare it with const", place)
        return length

    def _struct(self, unit: Unit, one: Struct) -> Type:
        names = tuple(member.name for member in one.members)
        if len(set(names)) != len(names) or not names:
            raise refuse(f"struct {one.name} has no members, or two of the same name", "", f"{unit.where}:{one.line}")
        types = tuple(self._asked(unit, member.type) for member in one.members)
        title = self._title(unit, one.name)
        self.emitter.structs[title] = names, types
        return Type("struct", name=title)

    def _constant(self, unit: Unit, one: Declared) -> Value | Place:
        asked = self._asked(unit, one.type) if one.type is not None else None
        given = self.sources.defines.get(one.name) if one.kind == "override" else None
        if given is not None:
            return self._override(one, asked or FLOAT, given)
        if one.value is None:
            if one.kind == "override" and asked == FLOAT:
                return self._parameter(unit, one, None)
            hint = f"add defines = {{ {one.name} = '...' }} to the adapter"
            raise self.emitter.error(f"{one.kind} {one.name} without a value", hint)
        value = Expressions(self.emitter, self, unit).value(one.value)
        if one.kind == "override" and (asked or concrete(value.type)) == FLOAT:
            return self._parameter(unit, one, self.emitter.converted(value, FLOAT, f"'{one.name}'"))
        return self.emitter.converted(value, asked, f"'{one.name}'") if asked is not None else value

    def _parameter(self, unit: Unit, one: Declared, default: Value | None) -> Place:
        """An override of type f32 as a uniform."""
        module, id = self.emitter.module, self.emitter.fresh()
        pointer = self.emitter.type_id(Type("pointer", (FLOAT,), _SPACES[""]))
        module.variables[id] = Instruction("Variable", pointer, id, (_SPACES[""],), one.line, unit.where)
        module.names[id] = one.name
        if default is not None:
            module.defaults[one.name] = float(self.emitter.known(default) or 0.0)
        return Place(id, FLOAT)

    def _derived(self, unit: Unit, one: Declared) -> bool:
        """Whether an override has no given value and depends on an override that is a uniform."""
        if one.kind != "override" or one.value is None or one.name in self.sources.defines:
            return False
        return any(isinstance(self.value(unit, name, one.line), Place) for name in sorted(names_in(one.value)))

    def _computed(self, unit: Unit, one: Declared) -> Place:
        """A variable for an override, assigned by a function after the overrides on which it depends."""
        assert one.value is not None
        type = self._asked(unit, one.type) if one.type is not None else FLOAT
        place = Place(self.emitter.fresh(), type)
        pointer = self.emitter.type_id(Type("pointer", (type,), _SPACES["private"]))
        operands = (_SPACES["private"],)
        self.emitter.module.variables[place.pointer] = Instruction(
            "Variable", pointer, place.pointer, operands, one.line, unit.where
        )
        start = Signature(self.emitter.fresh(), (), VOID)
        self.emitter.module.names[start.id] = "main"
        body = Block(one.line, [Assign(one.line, Name(one.line, one.name), "=", one.value)])
        self._queue.append((unit, Function(one.line, "main", [], None, body, False), start))
        return place

    def _override(self, one: Declared, type: Type, text: str) -> Value:
        try:
            number = float(text) if type == FLOAT else text == "true" if type.kind == "bool" else int(text)
        except ValueError:
            raise self.emitter.error(f"{one.name} = '{text}' is not of type {type}", "see `defines`") from None
        return self.emitter.constant(number, type)

    def _variable(self, unit: Unit, one: Declared) -> Place:
        value = Expressions(self.emitter, self, unit).value(one.value) if one.value is not None else None
        if one.type is not None:
            type = self._asked(unit, one.type)
        elif value is not None:
            value = self.emitter.with_concrete_type(value)
            type = value.type
        else:
            raise self.emitter.error(f"var {one.name} without type and value")
        if one.space not in _SPACES or (not one.space and type.kind not in ("texture", "sampler")):
            raise self.emitter.error(f"a variable in '{one.space}'", f"use one of {', '.join(filter(None, _SPACES))}")
        id, module = self.emitter.fresh(), self.emitter.module
        space = _SPACES[one.space]
        operands: tuple[int, ...] = (space,)
        if value is not None:
            operands = space, self.emitter.converted(value, type, f"'{one.name}'").id
        pointer = self.emitter.type_id(Type("pointer", (type,), space))
        module.variables[id] = Instruction("Variable", pointer, id, operands, one.line, unit.where)
        module.names[id] = one.name
        return Place(id, type)


class _Entered:
    """The translation of a declaration: rejects declarations that depend on themselves, and restores the location for
    messages."""

    def __init__(self, translation: _Translation, key: tuple[str, str], unit: Unit, line: int) -> None:
        self.translation, self.key, self.unit, self.line = translation, key, unit, line
        emitter = translation.emitter
        self.before = emitter.where, emitter.line, emitter.block

    def __enter__(self) -> None:
        inside, place = self.translation._inside, f"{self.unit.where}:{self.line}"
        if self.key in inside:
            raise refuse(f"'{self.key[1]}' depends on itself", "", place)
        if len(inside) >= MAX_INSIDE:
            raise refuse(f"more than {MAX_INSIDE} declarations that depend on each other", "", place)
        inside.append(self.key)
        emitter = self.translation.emitter
        emitter.where, emitter.line, emitter.block = self.unit.where, self.line, None

    def __exit__(self, *_: object) -> None:
        self.translation._inside.pop()
        emitter = self.translation.emitter
        emitter.where, emitter.line, emitter.block = self.before
