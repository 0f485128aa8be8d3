"""A material as a self-contained Python file: its formulas, its tables, and eval, pdf and sample on arrays."""

from __future__ import annotations

import base64
import inspect
import textwrap
import zlib
from collections.abc import Mapping

import numpy as np

from .._version import __version__
from ..material import BSDF, tree
from ..ops.table import Table
from . import python_runtime as runtime
from .languages._python import Python
from .manifest import Json
from .names import Names
from .program import ENTRIES, Program, choices, flat, written_from
from .python_writer import PythonWriter, docstring
from .textures import groups, width
from .values import Record


def python_file(made: Program, names: Names, numbers: Mapping[str, Json]) -> str:
    """The text of the Python file.

    numbers  values of the numeric parameters, by path; angles as (cos, sin)
    """
    language = names.language
    assert isinstance(language, Python)
    bodies = [PythonWriter(names, routine).text() for routine in made.routines]
    constants = []
    for name, (value, about) in names.constants.items():
        constants += [*(f"# {line}" for line in textwrap.wrap(about, 105)), language.constant(name, repr(value))]
    tables = [f"{names.table(table, 'table_')} = {_table(table)}" for table in made.tables]
    struct = made.struct_of(made.bound)
    assert struct is not None
    names.note(struct.record)
    parts = [
        '"""' + "\n".join(_head(made, language)) + '\n"""',
        "import base64\nimport itertools\nimport math\nimport zlib\nfrom typing import NamedTuple",
        *(runtime.VECTOR, language.imports.strip("\n"), runtime.COMMON),
        "\n".join(constants),
        *("\n".join(_struct(record, names)) for record in names.records.values()),
        *tables,
        *("\n".join(body) for body in bodies),
        _defaults(made.model, made, names),
        runtime.ARGUMENTS,
        *(_entry(method, made, names, language.decorator) for method in made.entries if method != "derive"),
    ]
    return "\n\n\n".join(part.strip("\n") for part in parts if part.strip()) + "\n"


def _head(made: Program, language: Python) -> list[str]:
    model = made.model
    doc = inspect.cleandoc(type(model).__doc__ or "").replace("\\", "\\\\").splitlines()
    shaped = [f"{path} = {value}" for path, value in choices(model)]
    return [
        f"{type(model).__name__}, written by Gonio {__version__} from {written_from(model)} for {language.title}.",
        "",
        *doc,
        *(["", *textwrap.wrap("With " + ", ".join(shaped) + ".", 105)] if shaped else []),
        "",
        "wo points to the viewer, wi to the light: arrays (..., 3) of unit vectors of the local frame, away from the",
        "surface; +z is the shading normal. Colors are linear RGB. Parameters are keyword arguments: numbers or",
        f"arrays with one entry per pair; DEFAULTS contains the default values. {language.precision}",
    ]


def _struct(record: Record, names: Names) -> list[str]:
    fields = [("", names.language.word(one.name)) for one in names.members(record)] or [("", "nothing")]
    head, *rest = names.language.struct(names.struct(record), fields)
    return [head, *docstring(record.doc.strip().splitlines()), *rest]


def _table(table: Table) -> str:
    """The expression of a table: one array per group of up to four channels."""
    channels = [slice(width(table) * i, width(table) * (i + 1)) for i in range(groups(table))]
    data = [np.ascontiguousarray(table.values[..., part], dtype="<f8") for part in channels]
    text = base64.b85encode(zlib.compress(b"".join(part.tobytes() for part in data), 9)).decode()
    lines = "\n".join(f'    "{text[i : i + 100]}"' for i in range(0, len(text), 100))
    return f"_tables({[part.shape for part in data]},\n{lines})"


def _defaults(model: BSDF, made: Program, names: Names) -> str:
    struct = made.struct_of(made.bound)
    assert struct is not None
    lines = []
    for path, parameter, value, _ in tree.surface(model):
        if path in struct.paths:
            name = names.language.word(flat(path))
            plain = np.asarray(value, dtype=float).tolist()
            lines += [f"    # {line}" for line in textwrap.wrap(parameter.doc, 105)]
            lines.append(f"    {name!r}: ({plain!r}, {parameter.kind!r}),")
    own = names.struct(struct.record)
    return "\n".join(["# name -> (value, kind)", "DEFAULTS = {", *lines, "}", f"_MATERIAL = {own}"])


def _entry(method: str, made: Program, names: Names, decorator: str) -> str:
    """A public function."""
    function = names.routines[made.entries[method]]
    second = "u" if method == "sample" else "wi"
    derived = ""
    if made.derived is not None:
        derived = f"{names.routines[made.entries['derive']]}(material), "
    return "\n".join(
        [
            *([decorator] if decorator else []),
            f"def {method}(wo, {second}, **parameters):",
            f'    """{ENTRIES[method][:1].upper()}{ENTRIES[method][1:]}."""',
            f"    material, (wo, {second}) = _arguments(parameters, wo, {second})",
            f"    return _result({function}(material, {derived}wo, {second}), wo, {second})",
        ]
    )
