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
from ...spirv.composites import Cell, Pointer, placed
from ...spirv.entry import prepared
from ...spirv.images import Texture
from ...spirv.module import UNIFORMS, Function
from ...spirv.reach import Part, blocks_of, called, read, written
from ...spirv.replay import Replayed
from ...spirv.standard import normalize
from ...spirv.values import Value, leaves, numeric
from .adapter import Adapter, Uniform, check_range, meaning_of
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
        stated = adapter.where or where
        self.eval = _one(module, self.adapter, "function", where)
        self.formulas = {"eval": (self.eval, self.adapter.arguments)}
        for name in ("pdf", "sample", "derive", "albedo"):
            if getattr(self.adapter, name):
                meanings = getattr(self.adapter, f"{name}_arguments")
                self.formulas[name] = _one(module, self.adapter, name, where), meanings
        for name, (function, arguments) in self.formulas.items():
            key = "arguments" if name == "eval" else f"{name}_arguments"
            if len(arguments) != len(function.parameters):
                what = f"{len(arguments)} meanings for the {len(function.parameters)} arguments of "
                raise InputError(f"{what}'{_title(module, function)}'", f"{stated}: {key}", "one meaning per argument")
            if "derived" in arguments and (not self.adapter.derive or name == "derive"):
                raise InputError("'derived' without a function", f"{stated}: {key}", "derive = 'NAME'")
            places = [type for (_, type), one in zip(function.parameters, arguments, strict=True) if one == "result"]
            if len(places) > 1 or any(module.type(one).kind != "pointer" for one in places):
                raise InputError(
                    "'result' for what the function does not write", f"{stated}: {key}", "an `out` argument"
                )
        declared = {one.name: one for one in self._declared()}
        self.parameters = {name: declared[name] for name in (*self.adapter.parameters, *declared) if name in declared}

    # ------------------------------------------------------------------ parameters

    def _declared(self) -> Iterator[Declared]:
        names: set[str] = set()
        for name, shape, default in (*self._uniforms(), *self._arguments()):
            if name in names:
                continue
            names.add(name)
            if not name.lstrip("_").isidentifier():  # it becomes a name in Python; SPIR-V's may be any text
                hint = "letters, digits and _ that begin with a letter; of SPIR-V: compile it with names"
                raise InputError(f"{name[:40]!r} as the name of a parameter", self.where, hint)
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
        """What the adapter says of a parameter, by the shader's name or by that of the material, `isotropic_`."""
        stated = self.adapter.parameters
        return stated.get(name, stated.get(f"{name}_"))

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
                what = f"'{meaning}' as an argument of a function that is not given {error.args[0]!r}"
                hint = "eval and pdf have light and view, sample view and u, albedo the view"
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
    "derived": lambda given: given["derived"],
    "result": lambda given: given["result"],
}


# --------------------------------------------------------------------------- guesses


def _title(module: Module, function: Function) -> str:
    return module.names.get(function.id, str(function.id)).partition("(")[0]


def _one(module: Module, adapter: Adapter, key: str, where: str) -> Function:
    """The function that an entry of the adapter names; `where` is the shader."""
    name = getattr(adapter, key)
    functions = module.function(name)
    where = f"{adapter.where}: {key}" if adapter.where and name else where
    if not functions:
        known = sorted({_title(module, one) for one in module.functions.values()} - {"main", "gonio_entry"})
        what = f"no function '{name}'" if name else "no function that looks like a BRDF"
        hint = f"function = 'NAME' in the adapter; it has {', '.join(known[:12]) or 'none'}"
        raise InputError(what, where, hint)
    if len(functions) > 1 and adapter.struct:
        functions = of_struct(module, name, adapter.struct)
    if len(functions) != 1:
        raise InputError(f"{len(functions)} functions '{name}'", where, "rename one: an adapter names functions")
    return functions[0]


def of_struct(module: Module, name: str, struct: str) -> list[Function]:
    """Of the functions of a name those whose first parameter is a struct of that name, as of a mix of mixes."""
    return [one for one in module.function(name) if _first(module, one) == struct]


def _first(module: Module, function: Function) -> str:
    """The name of the type of a function's first parameter, as far as it is a struct."""
    type_ = function.parameters[0][1] if function.parameters else 0
    if type_ and module.type(type_).kind == "pointer":
        type_ = module.type(type_).parts[0]
    return module.names.get(type_, "")


def _meanings(module: Module, function: Function, derived: bool = False) -> tuple[str, ...]:
    """The meaning of each argument by its name, and by its type where the name says nothing.

    derived  whether an argument of that name is what the adapter's function `derive` returns
    """
    result = []
    written = _written(module, function)
    for id, type in function.parameters:
        if id in written:
            result.append("result" if id == written[0] and module.shape(function.type) == "void" else "ignored")
            continue
        if derived and module.names.get(id, "") == "derived":
            result.append("derived")
            continue
        meaning, shape = meaning_of(module.names.get(id, "")), module.shape(type)
        numbers = meaning in ("n.l", "n.v", "n.h", "l.h", "l.v")
        fits = shape == "float" if numbers else shape in ("vec2", "vec3") if meaning == "u" else shape == "vec3"
        result.append(meaning if fits else "parameter")
    return tuple(result)


def _written(module: Module, function: Function) -> list[int]:
    """The parameters that a function writes before it reads them, as `out` ones: colors, then numbers."""
    first: dict[int, bool] = {id: False for id, type in function.parameters if module.type(type).kind == "pointer"}
    pending, owner = set(first), {id: id for id in first}
    for block in function.blocks.values():
        for one in block.instructions:
            if one.name == "AccessChain" and one.operands[0] in owner:
                owner[one.result] = owner[one.operands[0]]
                continue
            for place, operand in enumerate(one.operands):
                if operand in owner and owner[operand] in pending:
                    pending.discard(owner[operand])
                    first[owner[operand]] = one.name == "Store" and place == 0
    shapes = {id: module.shape(type) for id, type in function.parameters}
    return [id for kind in ("vec3", "vec4", "float") for id, is_out in first.items() if is_out and shapes[id] == kind]


def _rank(module: Module, function: Function) -> tuple[int, int]:
    """How much a function looks like a BRDF: by its name, and by the directions among its arguments."""
    name = _title(module, function).lower()
    exact = {"brdf": 6, "bsdf": 6, "evalbrdf": 5, "evaluatebrdf": 5, "brdf_eval": 5, "evalbsdf": 5, "eval": 4}
    near = 4 if name.endswith("_eval") else 3 if "brdf" in name or "bsdf" in name else 0
    meanings = _meanings(module, function)
    directions = sum(one in ("light", "view", "normal", "half", "n.l", "n.v", "incident") for one in meanings)
    both = ("light" in meanings and "view" in meanings) or ("n.l" in meanings and "n.v" in meanings)
    usable = both and (module.shape(function.type) in ("vec3", "float", "vec4") or "result" in meanings)
    return (exact.get(name, near) if usable else -1), directions


def candidates(module: Module) -> list[str]:
    """The names of the functions that look most like a BRDF, equally so; those that no other of them calls first."""
    own = [one for one in module.functions.values() if not _title(module, one).startswith(("main", "gonio_"))]
    best = max((_rank(module, one) for one in own), default=(0, 0))
    equal = [one for one in own if best[0] > 0 and _rank(module, one) == best]
    called = {id for one in equal for id in _calls(one)}
    return [_title(module, one) for one in sorted(equal, key=lambda one: one.id in called)]


def _calls(function: Function) -> Iterator[int]:
    """The functions that a function calls."""
    for block in function.blocks.values():
        yield from (one.operands[0] for one in block.instructions if one.name == "FunctionCall")


def _completed(module: Module, adapter: Adapter, where: str) -> Adapter:
    """The adapter with guesses for what it leaves open."""
    guessed = not adapter.function
    name = adapter.function or next(iter(candidates(module)), "")
    adapter = replace(adapter, function=name)
    chosen = _one(module, replace(adapter, where="") if guessed else adapter, "function", where)
    stem = name.removesuffix("_eval")
    written = name != stem  # Gonio's own form: NAME_eval, NAME_pdf and NAME_sample, the cosine included
    pdf, sample, derive = adapter.pdf, adapter.sample, adapter.derive
    if written and guessed:
        if module.function(f"{stem}_pdf") and module.function(f"{stem}_sample"):
            pdf, sample = pdf or f"{stem}_pdf", sample or f"{stem}_sample"
        if module.function(f"{stem}_derive"):
            derive = derive or f"{stem}_derive"

    adapter = replace(adapter, pdf=pdf, sample=sample, derive=derive)

    def meanings(key: str) -> tuple[str, ...]:
        given: tuple[str, ...] = getattr(adapter, f"{key}_arguments")
        if given or not getattr(adapter, key):
            return given
        return _meanings(module, _one(module, adapter, key, where), bool(derive) and key != "derive")

    return replace(
        adapter,
        arguments=adapter.arguments or _meanings(module, chosen, bool(derive)),
        cosine=written if adapter.cosine is None else adapter.cosine,
        pdf_arguments=meanings("pdf"),
        sample_arguments=meanings("sample"),
        derive_arguments=meanings("derive"),
        albedo_arguments=meanings("albedo"),
    )
