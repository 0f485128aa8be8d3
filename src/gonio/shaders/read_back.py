"""The round trip: a material is written as shader text, the text is read, and the values are compared in float64.

    made = bundle(material, "wgsl")
    Original(material, made, wo, wi, u).difference(made)

The reference is the recording from which the text was written, evaluated in NumPy, with its constants and tables
rounded to single precision as in the text. Only the order of additions may differ, so a difference beyond rounding
errors of double precision is a fault of the writer or of the reader.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..catalog.shaders.guesses import of_struct
from ..errors import InputError
from ..material import BSDF, recording
from ..ops import graph
from ..ops.table import Table
from ..spirv import Machine, Module, compile_text, parse, translated
from ..spirv.images import Texture
from ..spirv.module import Function
from ..spirv.values import leaves, numeric
from . import program as programs
from .bundle import Bundle
from .manifest import Json

LANGUAGES = ("glsl", "hlsl", "wgsl")  # the languages that can be read
TINY = 1e-100  # smaller values in double precision may be caused by underflow
Array = NDArray[np.float64]


class Difference(NamedTuple):
    """The largest difference of a function, relative to the larger of the two values, with its row and both values."""

    function: str
    figure: float
    row: int
    written: float
    read: float


class Original:
    """The values of a material's recording, with which the values of shader texts are compared.

    made    a shader of the material, in any language that can be read back
    wo, wi  directions, (N, 3)
    u       random numbers, (N, 3)
    seed    seed of the random parameter values in half of the rows; see `parameters`
    """

    def __init__(self, material: BSDF, made: Bundle, wo: Array, wi: Array, u: Array, seed: int = 0) -> None:
        self.given = {"wo": wo.T, "wi": wi.T, "u": u.T}
        self.count = len(wo)
        self.fields = parameters(made.manifest, self.count, seed)
        names = [name for name in programs.FUNCTIONS if name in made.manifest["functions"]]
        with np.errstate(all="ignore"):
            self.values = values_of(recorded(material, names), names, self.given, self.fields)

    def difference(self, made: Bundle) -> list[Difference]:
        """The largest relative difference of each function of the text.

        Raises InputError for text that cannot be read, and MachineError if there is no compiler for GLSL and HLSL.
        """
        with np.errstate(all="ignore"):
            read = _read(_module(made.text, made.manifest["lang"]), made, list(self.values), self.given, self.fields)
        return [_largest(name, written, read[name], self.count) for name, written in self.values.items()]


def parameters(manifest: Mapping[str, Json], count: int, seed: int) -> dict[str, Array]:
    """Values of each field of the struct, by path: `count` rows, (N,) or (components, N), in single precision.

    Even rows have the material's values, odd rows have random values: a fifth are at the ends of the range, and half
    are close to its lower end, where code has other branches. An open range extends to twice or half the value.
    Parameters on which tables depend are unchanged.

    seed  seed of the random values
    """
    random = np.random.default_rng([seed, 3])
    kinds = {one["path"]: one for one in manifest["parameters"]}
    values = {}
    for field in manifest["fields"]:
        own = np.asarray(field["value"], float).reshape(-1, 1)
        rows = np.repeat(own, count, axis=1)
        kind = kinds[field["path"]]
        odd = slice(1, None, 2)
        share = np.clip(random.uniform(-0.125, 1.125, rows[:, odd].shape), 0.0, 1.0)
        share = np.where(random.random(share.shape) < 0.5, share**4, share)
        if kind["kind"] == "angle":
            rows[:, odd] = np.stack([np.cos(2.0 * np.pi * share[0]), np.sin(2.0 * np.pi * share[0])])
        elif not kind["fixed"]:
            low = np.minimum(0.5 * own, 2.0 * own) if kind["low"] is None else kind["low"]
            high = np.maximum(0.5 * own, 2.0 * own) if kind["high"] is None else kind["high"]
            rows[:, odd] = low + (high - low) * share
        rows = rows.astype(np.float32).astype(float)
        values[field["path"]] = rows if isinstance(field["value"], list) else rows[0]
    return values


def _largest(name: str, written: list[Array], read: list[Array], count: int) -> Difference:
    if len(written) != len(read):
        raise InputError(f"{name}: {len(read)} numbers read, {len(written)} written", "shader")
    worst = Difference(name, 0.0, 0, 0.0, 0.0)
    for one, other in zip(written, read, strict=True):
        a, b = np.broadcast_to(one, count).astype(float), np.broadcast_to(other, count).astype(float)
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        with np.errstate(all="ignore"):
            error = np.where(same, 0.0, np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), TINY))
        error = np.where(np.isfinite(error), error, np.inf)
        row = int(np.argmax(error))
        if error[row] > worst.figure:
            worst = Difference(name, float(error[row]), row, float(a[row]), float(b[row]))
    return worst


# ---------------------------------------------------------------------- the text


def _module(text: str, language: str) -> Module:
    where = f"{language} text"
    if language == "wgsl":
        return translated(text, where, {}, ())
    return parse(compile_text(text, where, language=language), where)


def _read(
    module: Module, made: Bundle, names: list[str], given: dict[str, Array], fields: dict[str, Array]
) -> dict[str, list[Array]]:
    """The values of the text's functions."""
    textures = {name: Texture(name, Table(name, texels.astype(float))) for name, texels in made.tables.items()}
    columns = {f"field_{place}": column for place, column in enumerate(fields.values())}

    def formula(**symbols: Any) -> tuple[tuple[Any, ...], ...]:
        machine = Machine(module, {}, textures)
        for start in module.function("main"):  # in GLSL, it assigns the initial values of globals
            machine.call(start, ())
        split = {name: _components(symbol) for name, symbol in symbols.items()}
        structs = [tuple(split[name] for name in columns)] if columns else []
        if "derive" in made.manifest["functions"]:
            structs.append(machine.call(_one(module, made, "derive"), structs))
        results = []
        for name in names:
            function = _one(module, made, name)
            more = [split["wo"], split["u" if name == "sample" else "wi"]]
            results.append(_called(machine, module, function, structs, more))
        return tuple(results)

    types = {name: "float" if column.ndim == 1 else f"vec{len(column)}" for name, column in columns.items()}
    types |= dict.fromkeys(given, "vec3")
    keyword = inspect.Parameter.KEYWORD_ONLY
    formula.__signature__ = inspect.Signature([inspect.Parameter(name, keyword) for name in types])  # type: ignore[attr-defined]
    recorded = ops.record(formula, types=types, name="formula", into=graph.Graph(named=False))
    return {name: _numbers(one) for name, one in zip(names, recorded.evaluate(**columns, **given), strict=True)}


def _components(symbol: graph.Node) -> Any:
    """A vector as a tuple of numbers, as in `spirv.machine`."""
    if symbol.type == "float":
        return symbol
    return tuple(getattr(symbol, letter) for letter in "xyz"[: int(symbol.type[-1])])


def _one(module: Module, made: Bundle, method: str) -> Function:
    """The function of a method; among overloads, as in a mix of mixes, the one whose argument is the material's
    struct."""
    name = made.manifest["functions"][method]
    candidates = module.function(name)
    if len(candidates) > 1:
        candidates = of_struct(module, name, made.manifest["struct"])
    if len(candidates) != 1:
        raise InputError(f"{len(candidates)} functions '{name}' in the text", "shader")
    return candidates[0]


def _called(
    machine: Machine, module: Module, function: Function, structs: list[Any], more: list[Any]
) -> tuple[Any, ...]:
    """A function's result as numbers; a function that needs no parameters or derived values has fewer structs."""
    names = [module.names.get(id, "") for id, _ in function.parameters]
    offered = dict(zip(("self", "derived"), structs, strict=False))
    offered["material"] = offered.get("self")
    arguments = [offered[name] if name in offered else more[name in ("wi", "u")] for name in names]
    return tuple(numeric(leaf) for leaf in leaves(machine.call(function, arguments)))


# ---------------------------------------------------------------------- the recording


def recorded(material: BSDF, names: Sequence[str], bits: int = 32, without: Sequence[str] = ()) -> graph.Graph:
    """The recording of a material's functions, with 32-bit constants and tables of 32 or 16 bits.

    without  paths of parameters that are switched off, on which the code depends, as in `Program`
    """
    tables: dict[int, Table] = {}
    made = programs.recorded(recording.symbols(material, without), tuple(names), True)
    for function in made.functions:
        for node in function.nodes:
            _fold(node)
        for node in function.nodes:
            node.args = tuple(map(_single, node.args))
            if node.op == "constant":
                node.static = _single(node.static)
            elif node.op in ("lookup", "fetch"):
                table, channel = node.static
                node.static = tables.setdefault(id(table), _rounded(table, bits)), channel
    return made


def values_of(
    made: graph.Graph, names: Sequence[str], given: Mapping[str, Array], fields: Mapping[str, Array]
) -> dict[str, list[Array]]:
    """The values of a recording's functions, by component.

    given   values of the arguments, by name
    fields  values of the parameters, by path
    """
    values = {f"self_{path.replace('.', '_')}": column for path, column in fields.items()}
    result = made.evaluate(**values, **given)
    return {name: _numbers(one) for name, one in zip(names, result, strict=True)}


def _fold(node: graph.Node) -> None:
    """Replace an operation whose arguments are all numbers by its result, which is one 32-bit number in the text."""
    node.args = tuple(arg.static if isinstance(arg, graph.Node) and arg.op == "constant" else arg for arg in node.args)
    if node.op == "mul" and node.type == "float" and 0.0 in [arg for arg in node.args if isinstance(arg, float)]:
        node.op, node.args, node.static = "constant", (), 0.0  # of `zeros_like` and `ones_like`
    elif node.args and node.op in graph.NUMPY and not any(isinstance(arg, graph.Node) for arg in node.args):
        number = graph.NUMPY[node.op](*node.args)
        node.op, node.args, node.static = "constant", (), number if isinstance(number, bool) else float(number)


def _single(value: object) -> object:
    """A number in single precision."""
    return float(np.float32(value)) if isinstance(value, float) else value


def _rounded(table: Table, bits: int) -> Table:
    """A table with 32 or 16 bits per number."""
    return Table(table.name, table.values.astype(f"f{bits // 8}").astype(float))


def _numbers(value: object) -> list[Array]:
    """The numbers of a result in order; a vector contributes its components."""
    return list(_each(value))


def _each(value: object) -> Iterator[Array]:
    parts = list(value.values()) if isinstance(value, dict) else value
    if isinstance(parts, list | tuple):
        for part in parts:
            yield from _each(part)
        return
    array = np.asarray(parts, float)
    yield from array if array.ndim > 1 else [array]
