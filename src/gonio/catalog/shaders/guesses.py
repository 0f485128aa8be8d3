"""Guess what a shader does not state, its BRDF function and the meanings of arguments, from names and types."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...errors import InputError
from ...spirv import Module
from ...spirv.module import Function
from .adapter import Adapter, meaning_of


def title(module: Module, function: Function) -> str:
    return module.names.get(function.id, str(function.id)).partition("(")[0]


def one_of(module: Module, adapter: Adapter, key: str, where: str) -> Function:
    """The function named by an entry of the adapter; `where` is the shader, for errors."""
    name = getattr(adapter, key)
    functions = module.function(name)
    where = f"{adapter.where}: {key}" if adapter.where and name else where
    if not functions:
        titles = {title(module, one) for one in module.functions.values()}
        known = sorted(titles - {"main", "gonio_main", "gonio_entry", "@gonio_entry"})
        what = f"no function '{name}'" if name else "no function that looks like a BRDF"
        hint = f"{key} = 'NAME' in the adapter; it has {', '.join(known[:12]) or 'none'}"
        raise InputError(what, where, hint)
    if len(functions) > 1 and adapter.struct:
        functions = of_struct(module, name, adapter.struct)
    if len(functions) != 1:
        raise InputError(f"{len(functions)} functions named '{name}'", where, "rename one: an adapter names functions")
    return functions[0]


def of_struct(module: Module, name: str, struct: str) -> list[Function]:
    """The functions with a given name whose first parameter is the struct `struct`; nested mixes have overloads."""
    return [one for one in module.function(name) if _first(module, one) == struct]


def _first(module: Module, function: Function) -> str:
    """The name of the struct that is the type of a function's first parameter; "" for other types."""
    type_ = function.parameters[0][1] if function.parameters else 0
    if type_ and module.type(type_).kind == "pointer":
        type_ = module.type(type_).parts[0]
    return module.names.get(type_, "")


def _meanings(module: Module, function: Function, derived: bool = False) -> tuple[str, ...]:
    """The meaning of each argument, from its name, or from its type if the name is unknown.

    derived  whether an argument with the name "derived" is the result of the adapter's function `derive`
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
    """The parameters that a function writes before it reads them, such as `out` parameters; colors come first."""
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
    """A rank that states how likely a function is to be the BRDF, from its name and the directions in its arguments."""
    name = title(module, function).lower()
    exact = {"brdf": 6, "bsdf": 6, "evalbrdf": 5, "evaluatebrdf": 5, "brdf_eval": 5, "evalbsdf": 5, "eval": 4}
    near = 4 if name.endswith("_eval") else 3 if "brdf" in name or "bsdf" in name else 0
    meanings = _meanings(module, function)
    directions = sum(one in ("light", "view", "normal", "half", "n.l", "n.v", "incident") for one in meanings)
    both = ("light" in meanings and "view" in meanings) or ("n.l" in meanings and "n.v" in meanings)
    usable = both and (module.shape(function.type) in ("vec3", "float", "vec4") or "result" in meanings)
    return (exact.get(name, near) if usable else -1), directions


def candidates(module: Module) -> list[str]:
    """The names of the best candidates for the BRDF, which have equal rank; those not called by others come first."""
    own = [one for one in module.functions.values() if not title(module, one).startswith(("main", "gonio_"))]
    best = max((_rank(module, one) for one in own), default=(0, 0))
    equal = [one for one in own if best[0] > 0 and _rank(module, one) == best]
    called = {id for one in equal for id in _calls(one)}
    return [title(module, one) for one in sorted(equal, key=lambda one: one.id in called)]


def _calls(function: Function) -> Iterator[int]:
    """The functions called by a function."""
    for block in function.blocks.values():
        yield from (one.operands[0] for one in block.instructions if one.name == "FunctionCall")


def completed(module: Module, adapter: Adapter, where: str) -> Adapter:
    """The adapter, completed with guesses for its missing entries; `where` is the shader, for errors."""
    guessed = not adapter.function
    name = adapter.function or next(iter(candidates(module)), "")
    adapter = replace(adapter, function=name)
    chosen = one_of(module, replace(adapter, where="") if guessed else adapter, "function", where)
    stem = name.removesuffix("_eval")
    written = name != stem  # emitted by Gonio: NAME_eval, NAME_pdf and NAME_sample, with the cosine
    pdf, sample, derive = adapter.pdf, adapter.sample, adapter.derive
    if written and guessed:
        if module.function(f"{stem}_pdf") and module.function(f"{stem}_sample"):
            pdf, sample = pdf or f"{stem}_pdf", sample or f"{stem}_sample"
        if module.function(f"{stem}_derive"):
            derive = derive or f"{stem}_derive"

    if bool(pdf) != bool(sample):
        one, other = ("pdf", "sample") if pdf else ("sample", "pdf")
        place = f"{adapter.where}: {one}" if adapter.where else where
        hint = "name both functions, or neither: a guide then draws the directions"
        raise InputError(f"{one} = '{pdf or sample}' without {other}", place, hint)
    adapter = replace(adapter, pdf=pdf, sample=sample, derive=derive)

    def meanings(key: str) -> tuple[str, ...]:
        given: tuple[str, ...] = getattr(adapter, f"{key}_arguments")
        if given or not getattr(adapter, key):
            return given
        return _meanings(module, one_of(module, adapter, key, where), bool(derive) and key != "derive")

    return replace(
        adapter,
        arguments=adapter.arguments or _meanings(module, chosen, bool(derive)),
        cosine=written if adapter.cosine is None else adapter.cosine,
        pdf_arguments=meanings("pdf"),
        sample_arguments=meanings("sample"),
        derive_arguments=meanings("derive"),
        albedo_arguments=meanings("albedo"),
    )
