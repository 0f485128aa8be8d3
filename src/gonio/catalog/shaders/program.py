"""A shader with its adapter: which parameters it has, and its functions on the values of a material."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...spirv import Module
from ...spirv.arithmetic import elementwise
from ...spirv.composites import placed
from ...spirv.entry import prepared
from ...spirv.images import Texture
from ...spirv.module import UNIFORMS, Function
from ...spirv.reach import Part, blocks_of, called, read, written
from ...spirv.replay import Replayed
from ...spirv.standard import normalize
from ...spirv.values import Value, leaves, numeric
from .adapter import Adapter, Uniform, meaning_of
from .declared import PLAIN, Declared, Piece, assembled, pieces


class Program:
    """A module with the meaning of its functions. Raises InputError if the meaning does not fit the functions."""

    def __init__(
        self,
        module: Module,
        adapter: Adapter,
        textures: dict[str, Texture],
        where: str,
        files: tuple[Path, ...] = (),
    ) -> None:
        self.module, self.textures, self.where = module, textures, where
        self.files = files  # that the shader includes or reads as textures
        self._replayed: dict[str, Replayed] = {}
        self.adapter = _completed(module, adapter, where)
        self.eval = _one(module, self.adapter.function, where)
        self.formulas = {"eval": (self.eval, self.adapter.arguments)}
        for name in ("pdf", "sample", "albedo"):
            if function := getattr(self.adapter, name):
                self.formulas[name] = _one(module, function, where), getattr(self.adapter, f"{name}_arguments")
        for name, (function, arguments) in self.formulas.items():
            if len(arguments) != len(function.parameters):
                what = f"{name}: {len(arguments)} meanings for the {len(function.parameters)} arguments of "
                raise InputError(f"{what}'{_title(module, function)}'", where, "one meaning per argument")
        declared = {one.name: one for one in self._declared()}
        self.parameters = {name: declared[name] for name in (*self.adapter.parameters, *declared) if name in declared}

    # ------------------------------------------------------------------ parameters

    def _declared(self) -> Iterator[Declared]:
        names: set[str] = set()
        for name, shape, default in (*self._uniforms(), *self._arguments()):
            if name in names:
                continue
            names.add(name)
            uniform = self.adapter.parameters.get(name, Uniform())
            if uniform.default is None and default is not None:
                uniform = replace(uniform, default=default)
            yield Declared(name, shape, uniform)
        unknown = [name for name in self.adapter.parameters if name not in names]
        if unknown:
            known = ", ".join(sorted(names)) or "none"
            raise InputError(f"no uniform '{unknown[0]}' in the shader", self.where, f"it has: {known}")

    def _uniforms(self) -> Iterator[Piece]:
        """The parameters in uniforms; in matrices, arrays and structs only those that a function reads."""
        module = self.module
        starts = [*(function.id for function, _ in self.formulas.values()), *(one.id for one in self._entries)]
        used = read(module, blocks_of(module, starts))
        for name, type, part in self._globals:
            reads = {(id, None if part[1] is None else member) for id, member in used}
            if module.shape(type) in PLAIN or part in reads or (part[0], None) in used:
                yield from pieces(module, name, type, module.defaults.get(name))

    @functools.cached_property
    def _globals(self) -> list[tuple[str, int, Part]]:
        """Name, type and place of uniforms, and of members of their blocks."""
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
        """The functions that assign globals before a formula is called: those that the compiler needs, which hold the
        initial values, and the text's own `main` if a formula reads what it assigns."""
        module, formulas = self.module, [function.id for function, _ in self.formulas.values()]
        ours = module.function("gonio_entry")  # of HLSL
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
        """The functions at which the compiler's entry point begins to call every function, so that none is dropped: of
        HLSL one that does so, of Slang all."""
        module = self.module
        of_slang = any(module.names.get(id, "").startswith("gonio_") for id in module.variables)
        return list(module.functions) if of_slang else [one.id for one in module.function("@gonio_entry")]

    def _arguments(self) -> Iterator[Piece]:
        """Arguments of the functions that are parameters; the members of structs."""
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
        """A formula's result, as tuples of scalars.

        values      by parameter: a scalar, or a tuple of scalars
        directions  "light", "view", "u": tuples of three scalars
        """
        if formula not in self._replayed:
            self._replayed[formula] = Replayed(functools.partial(self._run, formula))
        return self._replayed[formula](values=values, directions=directions)

    def _run(self, formula: str, values: dict[str, Value], directions: dict[str, Value]) -> Value:
        module, zero = self.module, self.adapter.unset_is_zero
        inputs = {name: assembled(module, name, type, values, zero) for name, type, _ in self._globals}
        function, meanings = self.formulas[formula]
        machine = prepared(module, inputs, self.textures, zero, self._entries, [function.id, *self._examples])
        arguments = [
            self._argument(type, meaning, self.module.names.get(id, "argument"), values, directions)
            for (id, type), meaning in zip(function.parameters, meanings, strict=True)
        ]
        try:
            return placed(machine.call(function, arguments), self.where)
        except InputError as error:
            raise InputError(error.what, error.where or self.where, error.hint) from error

    def _argument(
        self, type: int, meaning: str, name: str, values: dict[str, Value], directions: dict[str, Value]
    ) -> Value:
        if meaning != "parameter":
            value = _GIVEN[meaning](directions)
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
        """A result as a color: a number is gray."""
        parts = leaves(value)
        if len(parts) not in (1, 3, 4):
            raise InputError(
                f"'{self.adapter.function}' returns {len(parts)} numbers", self.where, "a color or a number"
            )
        red, green, blue = parts[:3] if len(parts) > 1 else parts * 3
        return numeric(red), numeric(green), numeric(blue)

    def samplers(self) -> list[str]:
        """The names of its textures."""
        kinds = {id: self.module.type(one.type).parts[0] for id, one in self.module.variables.items()}
        return [
            self.module.names.get(id, "")
            for id, kind in kinds.items()
            if self.module.type(kind).kind in ("sampled image", "image")
        ]

    def argument_names(self, formula: str) -> list[str]:
        """The names of a formula's arguments."""
        return [self.module.names.get(id, f"argument {id}") for id, _ in self.formulas[formula][0].parameters]

    def members(self, formula: str) -> list[str]:
        """The names of the members of a formula's result, empty if it is no struct."""
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
}


# --------------------------------------------------------------------------- guesses


def _title(module: Module, function: Function) -> str:
    return module.names.get(function.id, str(function.id)).partition("(")[0]


def _one(module: Module, name: str, where: str) -> Function:
    functions = module.function(name)
    if not functions:
        known = sorted({_title(module, one) for one in module.functions.values()} - {"main", "gonio_entry"})
        what = f"no function '{name}'" if name else "no function that looks like a BRDF"
        hint = f"function = 'NAME' in the adapter; it has {', '.join(known[:12]) or 'none'}"
        raise InputError(what, where, hint)
    if len(functions) > 1:
        raise InputError(f"{len(functions)} functions '{name}'", where, "rename one: an adapter names functions")
    return functions[0]


def _meanings(module: Module, function: Function) -> tuple[str, ...]:
    """The meaning of each argument by its name, and by its type where the name says nothing."""
    result = []
    for id, type in function.parameters:
        meaning, shape = meaning_of(module.names.get(id, "")), module.shape(type)
        numbers = meaning in ("n.l", "n.v", "n.h", "l.h", "l.v")
        fits = shape == "float" if numbers else shape in ("vec2", "vec3") if meaning == "u" else shape == "vec3"
        result.append(meaning if fits else "parameter")
    return tuple(result)


def _rank(module: Module, function: Function) -> tuple[int, int]:
    """How much a function looks like a BRDF: by its name, and by the directions among its arguments."""
    name = _title(module, function).lower()
    exact = {"brdf": 6, "bsdf": 6, "evalbrdf": 5, "evaluatebrdf": 5, "brdf_eval": 5, "evalbsdf": 5, "eval": 4}
    near = 4 if name.endswith("_eval") else 3 if "brdf" in name or "bsdf" in name else 0
    meanings = _meanings(module, function)
    directions = sum(one in ("light", "view", "normal", "half", "n.l", "n.v", "incident") for one in meanings)
    both = ("light" in meanings and "view" in meanings) or ("n.l" in meanings and "n.v" in meanings)
    result = module.shape(function.type)
    usable = both and result in ("vec3", "float", "vec4")
    return (exact.get(name, near) if usable else -1), directions


def _completed(module: Module, adapter: Adapter, where: str) -> Adapter:
    """The adapter with guesses for what it leaves open."""
    name = adapter.function
    own = [one for one in module.functions.values() if not _title(module, one).startswith(("main", "gonio_"))]
    if not name:
        best = max(own, key=lambda one: _rank(module, one), default=None)
        if best is not None and _rank(module, best)[0] > 0:
            name = _title(module, best)
    chosen = _one(module, name, where)
    stem = name.removesuffix("_eval")
    written = name != stem  # Gonio's own form: NAME_eval, NAME_pdf and NAME_sample, the cosine included
    pdf, sample = adapter.pdf, adapter.sample
    if written and not adapter.function and module.function(f"{stem}_pdf") and module.function(f"{stem}_sample"):
        pdf, sample = pdf or f"{stem}_pdf", sample or f"{stem}_sample"

    def meanings(given: Sequence[str], function: str) -> tuple[str, ...]:
        return tuple(given) or (_meanings(module, _one(module, function, where)) if function else ())

    return replace(
        adapter,
        function=name,
        arguments=adapter.arguments or _meanings(module, chosen),
        cosine=written if adapter.cosine is None else adapter.cosine,
        pdf=pdf,
        sample=sample,
        pdf_arguments=meanings(adapter.pdf_arguments, pdf),
        sample_arguments=meanings(adapter.sample_arguments, sample),
        albedo_arguments=meanings(adapter.albedo_arguments, adapter.albedo),
    )
