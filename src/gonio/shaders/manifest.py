"""The interface of a shader as plain data, for the program that uses it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ..errors import InputError
from ..material import BSDF, tree
from ..ops.table import Table
from ..ops.types import Value
from . import program as programs
from .languages import Language
from .names import Names
from .operations import operations
from .program import Program
from .textures import axes, width
from .values import SIZES

Json: TypeAlias = Any  # a value that a JSON file may contain

# symbols of the parameters in papers
SYMBOLS = {
    "alpha": "\u03b1",
    "eta": "\u03b7",
    "sigma": "\u03c3",
    "albedo": "\u03c1",
    "rotation": "\u03c6",
    "weight": "w",
}


def manifest(made: Program, names: Names, numbers: Mapping[str, Json], bindings: Mapping[int, int]) -> dict[str, Json]:
    """The interface of a shader; see docs/emit.md.

    numbers   values of the numeric parameters, by path
    bindings  number of the binding of each table, by the table's identity
    """
    language = names.language
    model = made.model
    cls = type(model)
    struct = made.struct_of(made.bound)
    assert struct is not None
    offsets, size = layout([type_ for _, type_ in struct.record.fields], language)
    fields = [
        {
            "name": language.word(name),
            "path": path,
            "type": type_,
            "value": numbers[path],
            "offset": offset,
            "doc": struct.record.docs.get(name, ""),
        }
        for (name, type_), path, offset in zip(struct.record.fields, struct.paths, offsets, strict=True)
    ]
    terms = made.entries.get("terms")
    derived = made.derived
    facts = made.bound  # its properties hold for any values of the shader's parameters
    return {
        "version": 1,
        "lang": language.name,
        "model": cls.name,
        "title": cls.__name__,
        "doc": inspect.cleandoc(cls.__doc__ or ""),
        "shader": cls.name + language.suffix,
        "struct": names.struct(struct.record),
        "size": size,
        "fields": fields,
        "derived": derived
        and {
            "struct": names.struct(derived.record),
            "fields": [
                {"name": language.word(one.name), "type": f"{one.type}[{one.length}]" if one.length else one.type}
                for one in names.members(derived.record)
            ],
        },
        "functions": {method: names.routines[routine] for method, routine in made.entries.items()},
        "operations": {method: operations(routine) for method, routine in made.entries.items()},
        "terms": [
            {"name": name, "type": type_, "doc": TERMS.get(name, "")}
            for name, type_ in (terms.record.fields if terms and terms.record else [])
        ],
        "parameters": list(_parameters(model, set(struct.paths), made.folds)),
        "textures": [texture(table, names, bindings) for table in made.tables],
        "transmits": bool(facts.transmits),
        "delta": facts.delta,
        "stochastic": False,
        "isotropic": bool(facts.isotropic),
    }


def texture(table: Table, names: Names, bindings: Mapping[int, int]) -> dict[str, Json]:
    """The texture of a table."""
    return {
        "uniform": names.table(table, "table_"),
        "dimension": 3 if len(axes(table)) == 3 else 2,
        "size": list(axes(table)),
        "channels": width(table),
        "format": f"{'rgba'[: width(table)]}{names.placement.bits}float",
        "file": names.file(table),
        "file_format": names.placement.form(names.language),
        "group": names.placement.group,
        "binding": bindings[id(table)],
    }


def layout(types: list[str], language: Language) -> tuple[list[int], int]:
    """(byte offset of each field, size of the struct) in a uniform buffer: std140, WGSL's, or an HLSL cbuffer."""
    offsets, end = [], 0
    for type_ in types:
        size = 4 * SIZES.get(type_, 1)
        offsets.append(language.offset(end, size))
        end = offsets[-1] + size
    return offsets, max(16, end + -end % 16)


TERMS = {
    "D": "density of microfacet normals at the half vector, 1/sr",
    "G": "masking and shadowing",
    "F": "Fresnel reflectance at the half vector",
    "single": "single scattering: the base alone, times |cos theta_i|",
    "multi": "multiple scattering: the compensation, times |cos theta_i|",
}


def _parameters(model: BSDF, fields: set[str], folds: bool) -> Iterator[dict[str, Json]]:
    fixed = model.fixed
    for path, parameter, value, _ in tree.surface(model):
        yield {
            "path": path,
            "kind": parameter.kind,
            "value": _plain(value),
            "default": None if parameter.required else _plain(parameter.default),
            "low": None if parameter.low == -np.inf else parameter.low,
            "high": None if parameter.high == np.inf else parameter.high,
            "unit": parameter.unit,
            "doc": parameter.doc,
            "symbol": SYMBOLS.get(parameter.name, parameter.name),
            "choices": parameter.choices,
            "field": programs.flat(path) if path in fields else None,
            "off": parameter.off,
            "fixed": path in fixed or (folds and path in fields),
        }


def _plain(value: object) -> object:
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, Path):
        return str(value)
    array = np.asarray(value, dtype=float)
    return float(array) if array.ndim == 0 else array.tolist()


def numbers_of(model: BSDF) -> Iterator[tuple[str, Value]]:
    """(path, value in the form of its field) of each numeric parameter."""
    for path, parameter, value, owner in tree.surface(model):
        if parameter.numeric and value is not None:
            array = np.asarray(value, dtype=float)
            location = f"emit: {type(owner).__name__}.{parameter.name}"
            widest = {"spectrum": 3, "alpha": 2}.get(parameter.kind, 1)
            if array.ndim > 1 or array.size not in (1, widest) or (array.ndim == 1 and widest == 1):
                what = "one value per ray given, a single value expected"
                raise InputError(what, location, "the shader's struct describes one material")
            if np.any(np.abs(array) > np.finfo(np.float32).max):
                raise InputError(
                    f"{np.abs(array).max():g} given, at most 3.4e38 expected", location, "shaders use float32"
                )
            if parameter.kind == "spectrum":
                array = np.broadcast_to(array, (3,))
            elif parameter.kind == "alpha":
                array = np.broadcast_to(array, (2,))
            elif parameter.kind == "angle":
                array = np.array([np.cos(array), np.sin(array)])
            yield path, array.tolist()
