"""The round trip: a material written as shader text, the text read again, and the values of both compared in 64 bits.

    difference(material, bundle(material, "wgsl"), wo, wi, u)

The reference is the recording from which the text was written, in NumPy, with its constants and tables rounded to 32
bits as the text's are. What is left is the order of additions, so that a difference beyond rounding in 64 bits is a
fault of the writer or of the reader.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..errors import InputError
from ..material import BSDF, recording
from ..ops import graph
from ..ops.table import Table
from ..spirv import Machine, Module, compile_text, parse, translated
from ..spirv.images import Texture
from ..spirv.values import leaves, numeric
from . import program as programs
from .bundle import Bundle

LANGUAGES = ("glsl", "hlsl", "wgsl")  # those that are read
FLOOR = 1e-9  # of the largest value: smaller ones are what a difference of larger ones leaves
Array = NDArray[np.float64]


class Difference(NamedTuple):
    """The largest difference of a function: relative to the larger value, its row, and both values there."""

    function: str
    figure: float
    row: int
    written: float
    read: float


def difference(material: BSDF, made: Bundle, wo: Array, wi: Array, u: Array) -> list[Difference]:
    """The largest relative difference of each function of a material between its recording and its text.

    made    the text with its tables, of `bundle`
    wo, wi  directions, (N, 3)
    u       random numbers, (N, 3)
    Raises InputError for text that cannot be read; MachineError without a compiler for GLSL and HLSL.
    """
    names = [name for name in programs.FUNCTIONS if name in made.manifest["functions"]]
    given = {"wo": wo.T, "wi": wi.T, "u": u.T}
    with np.errstate(all="ignore"):
        read = _read(_module(made.text, made.manifest["lang"]), made, names, given)
        written = _recorded(material, made, names, given)
    return [_largest(name, written[name], read[name], len(wo)) for name in names]


def _largest(name: str, written: list[Array], read: list[Array], count: int) -> Difference:
    if len(written) != len(read):
        raise InputError(f"{name}: {len(read)} numbers read, {len(written)} written", "shader")
    worst = Difference(name, 0.0, 0, 0.0, 0.0)
    for one, other in zip(written, read, strict=True):
        a, b = np.broadcast_to(one, count).astype(float), np.broadcast_to(other, count).astype(float)
        size = np.maximum(
            np.maximum(np.abs(a), np.abs(b)), FLOOR * np.max(np.abs(a), where=np.isfinite(a), initial=0.0)
        )
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        with np.errstate(all="ignore"):
            error = np.where(same, 0.0, np.abs(a - b) / size)
        error = np.where(np.isfinite(error), error, np.inf)
        row = int(np.argmax(error))
        if error[row] > worst.figure:
            worst = Difference(name, float(error[row]), row, float(a[row]), float(b[row]))
    return worst


# ---------------------------------------------------------------------- what is read


def _module(text: str, language: str) -> Module:
    where = f"{language} text"
    if language == "wgsl":
        return translated(text, where, {}, ())
    return parse(compile_text(text, where, language=language), where)


def _read(module: Module, made: Bundle, names: list[str], given: dict[str, Array]) -> dict[str, list[Array]]:
    """The values of the text's functions."""
    textures = {name: Texture(name, Table(name, texels.astype(float))) for name, texels in made.tables.items()}
    fields = made.manifest["fields"]
    values = tuple(
        tuple(map(float, field["value"])) if isinstance(field["value"], list) else float(field["value"])
        for field in fields
    )

    def formula(wo: ops.Direction, wi: ops.Direction, u: ops.Direction) -> tuple[tuple[Any, ...], ...]:
        machine = Machine(module, {}, textures)
        for start in module.function("main"):  # of GLSL; it assigns the initial values of globals
            machine.call(start, ())
        directions = {"wo": (wo.x, wo.y, wo.z), "wi": (wi.x, wi.y, wi.z), "u": (u.x, u.y, u.z)}
        structs = [values] if fields else []
        functions = made.manifest["functions"]
        if "derive" in functions:
            structs.append(machine.call(_one(module, functions["derive"]), structs))
        results = []
        for name in names:
            function = _one(module, functions[name])
            more = [directions["wo"], directions["u" if name == "sample" else "wi"]]
            results.append(_called(machine, module, function, structs, more))
        return tuple(results)

    recorded = ops.record(formula, types=dict.fromkeys(given, "vec3"), name="formula", into=graph.Graph())
    return {name: _numbers(one) for name, one in zip(names, recorded.evaluate(**given), strict=True)}


def _one(module: Module, name: str) -> Any:
    entry = module.function(name)
    if len(entry) != 1:
        raise InputError(f"{len(entry)} functions '{name}' in the text", "shader")
    return entry[0]


def _called(machine: Machine, module: Module, function: Any, structs: list[Any], more: list[Any]) -> tuple[Any, ...]:
    """A function's result as numbers; those that need no parameters or derived values take fewer structs."""
    names = [module.names.get(id, "") for id, _ in function.parameters]
    offered = dict(zip(("self", "derived"), structs, strict=False))
    offered["material"] = offered.get("self")
    arguments = [offered[name] if name in offered else more[name in ("wi", "u")] for name in names]
    return tuple(numeric(leaf) for leaf in leaves(machine.call(function, arguments)))


# ---------------------------------------------------------------------- what was written


def _recorded(material: BSDF, made: Bundle, names: list[str], given: dict[str, Array]) -> dict[str, list[Array]]:
    """The values of the recording, with constants of 32 bits."""
    tables: dict[int, Table] = {}
    recorded = programs.recorded(recording.symbols(material), tuple(names), True)
    for function in recorded.functions:
        for node in function.nodes:
            node.args = tuple(map(_single, node.args))
            if node.op == "constant":
                node.static = _single(node.static)
            elif node.op in ("lookup", "fetch"):
                table, channel = node.static
                node.static = tables.setdefault(id(table), _rounded(table)), channel
    values = {}
    for field in made.manifest["fields"]:
        value = np.asarray(field["value"], float)
        values[f"self_{field['path'].replace('.', '_')}"] = value[:, None] if value.ndim else value
    result = recorded.evaluate(**values, **given)
    return {name: _numbers(one) for name, one in zip(names, result, strict=True)}


def _single(value: object) -> object:
    """A number in 32 bits."""
    return float(np.float32(value)) if isinstance(value, float) else value


def _rounded(table: Table) -> Table:
    """A table in 32 bits."""
    return Table(table.name, table.values.astype(np.float32).astype(float))


def _numbers(value: object) -> list[Array]:
    """The numbers of a result, in order; of vectors component by component."""
    return list(_each(value))


def _each(value: object) -> Iterator[Array]:
    parts = list(value.values()) if isinstance(value, dict) else value
    if isinstance(parts, list | tuple):
        for part in parts:
            yield from _each(part)
        return
    array = np.asarray(parts, float)
    yield from array if array.ndim > 1 else [array]
