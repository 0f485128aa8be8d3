"""A shader with its adapter: its parameters, and its functions, which are evaluated for the values of a material."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...spirv import Module
from ...spirv.arithmetic import elementwise
from ...spirv.composites import Cell, Pointer, placed
from ...spirv.entry import prepared
from ...spirv.images import Texture
from ...spirv.module import UNIFORMS, Function
from ...spirv.reach import Part, blocks_of, called, read, written
from ...spirv.replay import Replayed
from ...spirv.standard import normalize
from ...spirv.values import Value, leaves, numeric
from .adapter import Adapter, Uniform, check_range
from .declared import PLAIN, Declared, Piece, assembled, pieces
from .guesses import completed, one_of, title

# meanings whose arguments are vectors; meanings whose arguments are numbers; types that cannot be directions
VECTORS = ("light", "view", "incident", "normal", "tangent", "bitangent", "half", "u")
COSINES = ("n.l", "n.v", "n.h", "l.h", "l.v")
NUMBERS = ("float", "int", "uint", "bool")


class Program:
    """A module with the meanings of its functions. Raises InputError if the meanings do not match the functions."""

    def __init__(
        self,
        module: Module,
        adapter: Adapter,
        textures: dict[str, Texture],
        where: str,
        files: tuple[Path, ...] = (),
    ) -> None:
        self.module, self.textures, self.where = module, textures, where
        self.files = files  # files that the shader includes or reads as textures
        self._replayed: dict[str, Replayed] = {}
        self.adapter = completed(module, adapter, where)
        stated = adapter.where or where
        self.eval = one_of(module, self.adapter, "function", where)
        self.formulas = {"eval": (self.eval, self.adapter.arguments)}
        for name in ("pdf", "sample", "derive", "albedo"):
            if getattr(self.adapter, name):
                meanings = getattr(self.adapter, f"{name}_arguments")
                self.formulas[name] = one_of(module, self.adapter, name, where), meanings
        for name, (function, arguments) in self.formulas.items():
            key = "arguments" if name == "eval" else f"{name}_arguments"
            if len(arguments) != len(function.parameters):
                what = f"{len(arguments)} meanings for the {len(function.parameters)} arguments of "
                raise InputError(f"{what}'{title(module, function)}'", f"{stated}: {key}", "give one per argument")
            if "derived" in arguments and (not self.adapter.derive or name == "derive"):
                raise InputError("'derived' given without a function", f"{stated}: {key}", "add derive = 'NAME'")
            self._check_types(name, function, arguments, f"{stated}: {key}")
            places = [type for (_, type), one in zip(function.parameters, arguments, strict=True) if one == "result"]
            if len(places) > 1 or any(module.type(one).kind != "pointer" for one in places):
                raise InputError(
                    "'result' given for an argument that is not written", f"{stated}: {key}", "use an `out` argument"
                )
        declared = {one.name: one for one in self._declared()}
        self.parameters = {name: declared[name] for name in (*self.adapter.parameters, *declared) if name in declared}

    def _check_types(self, formula: str, function: Function, meanings: Sequence[str], where: str) -> None:
        """Raise InputError if the meaning of a number is a direction, or the meaning of a vector is a number."""
        for (_, type), meaning in zip(function.parameters, meanings, strict=True):
            shape = self.module.shape(type)
            expected = "a vector" if meaning in VECTORS else "float" if meaning in COSINES else ""
            if (expected == "a vector" and shape in NUMBERS) or (expected == "float" and shape != "float"):
                what = f"'{meaning}' given for an argument of type {shape or 'struct'}, {expected} expected"
                raise InputError(what, where, f"see the arguments of {title(self.module, function)}")
        if formula == "sample" and (shape := self.module.shape(function.type)) in (*NUMBERS, "vec2"):
            what = f"'{title(self.module, function)}' returns {shape}, a direction expected"
            raise InputError(what, where.replace("sample_arguments", "sample"), "return a vec3, or a struct with wi")

    # ------------------------------------------------------------------ parameters

    def _declared(self) -> Iterator[Declared]:
        names: set[str] = set()
        for name, shape, default in (*self._uniforms(), *self._arguments()):
            if name in names:
                continue
            names.add(name)
            if not name.lstrip("_").isidentifier():  # the name must be valid in Python; in SPIR-V, it may be any text
                hint = "use letters, digits and _, a letter first; compile SPIR-V with names"
                raise InputError(f"{name[:40]!r} cannot be the name of a parameter", self.where, hint)
            uniform = self._stated(name) or Uniform()
            if uniform.default is None and default is not None:
                uniform = replace(uniform, default=default)
                check_range(name, uniform, self.adapter.where or self.where)
            yield Declared(name, shape, uniform)
        unknown = [name for name in self.adapter.parameters if not {name, name.removesuffix("_")} & names]
        if unknown:
            known = ", ".join(sorted(names)) or "none"
            stated = f"{self.adapter.where}: parameters.{unknown[0]}"
            raise InputError(f"no uniform '{unknown[0]}' in {self.where}", stated, f"it has: {known}")

    def _stated(self, name: str) -> Uniform | None:
        """The adapter's entry for a parameter, by its name in the shader or in the material, such as `isotropic_`."""
        stated = self.adapter.parameters
        return stated.get(name, stated.get(f"{name}_"))

    def _uniforms(self) -> Iterator[Piece]:
        """The parameters in uniforms. Of matrices, arrays and structs, only parts that a function reads are used."""
        module = self.module
        starts = [*(function.id for function, _ in self.formulas.values()), *(one.id for one in self._entries)]
        used = read(module, blocks_of(module, starts))
        for name, type, part in self._globals:
            reads = {(id, None if part[1] is None else member) for id, member in used}
            if module.shape(type) in PLAIN or part in reads or (part[0], None) in used:
                yield from pieces(module, name, type, module.defaults.get(name))

    @functools.cached_property
    def _globals(self) -> list[tuple[str, int, Part]]:
        """The name, type and location of each uniform and of each member of a uniform block."""
        module, result = self.module, list[tuple[str, int, Part]]()
        for id, one in module.variables.items():
            inside = module.type(one.type).parts[0]
            if one.operands[0] not in UNIFORMS:
                continue
            name = module.names.get(id, "")
            if module.type(inside).kind != "struct":
                result.append((name, inside, (id, None)))
                continue
            for place, part in enumerate(module.type(inside).parts):
                result.append((module.members.get((inside, place), f"{name}_{place}"), part, (id, place)))
        return result

    @functools.cached_property
    def _entries(self) -> list[Function]:
        """The functions that assign global variables before a formula is called.

        These are the entry points that the compiler requires, which contain the initial values, and the shader's own
        `main` if a formula reads variables that it assigns.
        """
        module, formulas = self.module, [function.id for function, _ in self.formulas.values()]
        ours = module.function("gonio_entry")  # exists in HLSL
        mains = module.function("main" if ours else "gonio_main")
        reached = {id for id, _ in read(module, blocks_of(module, formulas))}
        calls = {*formulas, *called(blocks_of(module, formulas))}
        needed = [
            one
            for one in mains
            if one.id not in calls and reached & written(module, blocks_of(module, [one.id], formulas))
        ]
        return [*(ours or [one for one in module.function("main") if not one.parameters]), *needed]

    @functools.cached_property
    def _examples(self) -> list[int]:
        """The functions at which the execution of the compiler's entry point ends.

        From there on, it only calls all functions, to prevent their removal: in HLSL through one function, in Slang
        directly.
        """
        module = self.module
        of_slang = any(module.names.get(id, "").startswith("gonio_") for id in module.variables)
        return list(module.functions) if of_slang else [one.id for one in module.function("@gonio_entry")]

    def _arguments(self) -> Iterator[Piece]:
        """The arguments of functions that are parameters, and the members of those that are structs."""
        for function, meanings in self.formulas.values():
            for (id, type), meaning in zip(function.parameters, meanings, strict=True):
                if meaning == "parameter":
                    for name, part in self._members(self.module.names.get(id, "argument"), type):
                        yield from pieces(self.module, name, part)

    def _members(self, name: str, type: int) -> Iterator[tuple[str, int]]:
        kind = self.module.type(type)
        if kind.kind == "pointer":
            yield from self._members(name, kind.parts[0])
        elif kind.kind == "struct":
            for place, part in enumerate(kind.parts):
                yield from self._members(self.module.members.get((type, place), f"{name}_{place}"), part)
        else:
            yield name, type

    # ------------------------------------------------------------------ running

    def run(self, formula: str, values: dict[str, Value], directions: dict[str, Value]) -> Value:
        """Evaluate a formula. The result consists of tuples of scalars.

        values      value of each parameter by name, a scalar or a tuple of scalars
        directions  "light", "view" and "u": tuples of three scalars
        """
        if formula not in self._replayed:
            self._replayed[formula] = Replayed(functools.partial(self._run, formula))
        return self._replayed[formula](values=values, directions=directions)

    def _run(self, formula: str, values: dict[str, Value], directions: dict[str, Value]) -> Value:
        module, zero = self.module, self.adapter.unset_is_zero
        inputs = {name: assembled(module, name, type, values, zero) for name, type, _ in self._globals}
        function, meanings = self.formulas[formula]
        starts = [function.id, *self._examples]
        given = dict(directions)
        if "derived" in meanings:
            derive, of_parameters = self.formulas["derive"]
            starts.append(derive.id)
        machine = prepared(module, inputs, self.textures, zero, self._entries, starts)
        try:
            if "derived" in meanings:
                given["derived"] = machine.call(derive, self._given(derive, of_parameters, values, directions))
            if "result" not in meanings:
                return placed(machine.call(function, self._given(function, meanings, values, given)), self.where)
            place = function.parameters[meanings.index("result")][1]
            cell = Cell(module.zero(module.type(place).parts[0]))
            machine.call(function, self._given(function, meanings, values, {**given, "result": Pointer(cell)}))
            return placed(cell.value, self.where)
        except InputError as error:
            raise InputError(error.what, error.where or self.where, error.hint) from error

    def _given(
        self, function: Function, meanings: Sequence[str], values: dict[str, Value], given: dict[str, Value]
    ) -> list[Value]:
        return [
            self._argument(type, meaning, self.module.names.get(id, "argument"), values, given)
            for (id, type), meaning in zip(function.parameters, meanings, strict=True)
        ]

    def _argument(
        self, type: int, meaning: str, name: str, values: dict[str, Value], directions: dict[str, Value]
    ) -> Value:
        if meaning == "ignored":
            kind = self.module.type(type)
            return self.module.zero(kind.parts[0] if kind.kind == "pointer" else type)
        if meaning != "parameter":
            try:
                value = _GIVEN[meaning](directions)
            except KeyError as error:
                what = f"'{meaning}' given for an argument of a function without {error.args[0]!r}"
                hint = "eval and pdf have light and view, sample has view and u, albedo has view"
                raise InputError(what, self.where, hint) from None
            kind = self.module.type(type)
            kind = self.module.type(kind.parts[0]) if kind.kind == "pointer" else kind
            return value[: kind.length] if kind.kind == "vector" and isinstance(value, tuple) else value
        kind = self.module.type(type)
        if kind.kind == "pointer":
            return self._argument(kind.parts[0], meaning, name, values, directions)
        if kind.kind == "struct":
            members = [self.module.members.get((type, p), f"{name}_{p}") for p in range(len(kind.parts))]
            return tuple(
                self._argument(part, meaning, member, values, directions)
                for part, member in zip(kind.parts, members, strict=True)
            )
        return assembled(self.module, name, type, values, self.adapter.unset_is_zero)

    def color(self, value: Value) -> Value:
        """Convert a result to a color; a number becomes gray."""
        parts = leaves(value)
        if len(parts) not in (1, 3, 4):
            raise InputError(
                f"'{self.adapter.function}' returns {len(parts)} numbers", self.where, "return a color or a number"
            )
        red, green, blue = parts[:3] if len(parts) > 1 else parts * 3
        return numeric(red), numeric(green), numeric(blue)

    def samplers(self) -> list[str]:
        """The names of the textures in the module."""
        kinds = {id: self.module.type(one.type).parts[0] for id, one in self.module.variables.items()}
        return [
            self.module.names.get(id, "")
            for id, kind in kinds.items()
            if self.module.type(kind).kind in ("sampled image", "image")
        ]

    def argument_names(self, formula: str) -> list[str]:
        """The names of the arguments of a formula."""
        return [self.module.names.get(id, f"argument {id}") for id, _ in self.formulas[formula][0].parameters]

    def members(self, formula: str) -> list[str]:
        """The names of the members of a formula's result; empty if the result is not a struct."""
        type = self.formulas[formula][0].type
        count = len(self.module.type(type).parts) if self.module.type(type).kind == "struct" else 0
        return [self.module.members.get((type, place), "") for place in range(count)]


def _half(given: dict[str, Value]) -> Value:
    return normalize(elementwise(lambda a, b: a + b, given["light"], given["view"]))


def _cosine(a: Value, b: Value) -> Value:
    return sum((x * y for x, y in zip(a[1:], b[1:], strict=True)), a[0] * b[0])


_GIVEN: dict[str, Callable[[dict[str, Value]], Any]] = {
    "light": lambda given: given["light"],
    "view": lambda given: given["view"],
    "incident": lambda given: tuple(-x for x in given["light"]),
    "normal": lambda given: (0.0, 0.0, 1.0),
    "tangent": lambda given: (1.0, 0.0, 0.0),
    "bitangent": lambda given: (0.0, 1.0, 0.0),
    "half": _half,
    "n.l": lambda given: given["light"][2],
    "n.v": lambda given: given["view"][2],
    "n.h": lambda given: _half(given)[2],
    "l.h": lambda given: _cosine(given["light"], _half(given)),
    "l.v": lambda given: _cosine(given["light"], given["view"]),
    "u": lambda given: given["u"],
    "derived": lambda given: given["derived"],
    "result": lambda given: given["result"],
}
