"""A shader with everything that a program needs to use it: text, manifest, tables."""

from __future__ import annotations

import inspect
import json
import re
import textwrap
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from .. import files
from .._version import __version__
from ..catalog import notation
from ..errors import InputError
from ..material import BSDF, tree
from ..material.recording import switched_off
from ..ops import graph
from ..ops.types import Value
from ..owner import exclusive
from . import program as programs
from .languages import Language
from .layout import COLUMNS, INDENT, comment
from .names import Names
from .program import Program
from .routine import RoutineWriter
from .syntax import literal
from .textures import READERS, axes, pixels, width
from .values import SIZES, Record, stem_of

Json: TypeAlias = Any  # a value that a JSON file may hold

# symbols of parameters in papers
SYMBOLS = {
    "alpha": "\u03b1",
    "eta": "\u03b7",
    "sigma": "\u03c3",
    "albedo": "\u03c1",
    "rotation": "\u03c6",
    "weight": "w",
}


@dataclass(frozen=True)
class Bundle:
    """The result of `bundle`.

    text      the shader: structs, helpers, functions; no version line, no main
    manifest  the interface of the shader: plain dicts, lists, numbers; see docs/emit.md
    tables    uniform name -> float32 array in the order of upload (x fastest), channels last
    """

    text: str
    manifest: dict[str, Json]
    tables: dict[str, np.ndarray]

    def write(self, folder: Path | str) -> list[Path]:
        """Write shader, manifest.json and one raw little-endian float32 file per table; returns their paths."""
        folder = files.check_folder(folder)
        contents = {
            self.manifest["shader"]: self.text.encode(),
            "manifest.json": json.dumps(self.manifest, indent=2).encode(),
        }
        for texture in self.manifest["textures"]:
            contents[texture["file"]] = self.tables[texture["uniform"]].astype("<f4").tobytes()
        files.write_all(folder, contents)
        return [folder / file for file in contents]


@exclusive
def emit(
    model: BSDF | str,
    lang: str = "glsl",
    functions: Sequence[str] = ("eval", "pdf", "sample"),
    *,
    lean: bool = False,
) -> str:
    """A material as shader code: eval, pdf, sample and the functions that they need.

        print(go.emit(go.Conductor.preset("Au", alpha=0.2), "glsl"))

    model      a material, or its text as on the command line: "conductor(preset=Au)"
    lang       name of a language, such as "glsl"; `gonio.shaders.languages()` has all of them
    functions  of "eval", "pdf", "sample", "terms" (D, G, F, ..., if the model has them)
    lean       omit what the material's own values switch off, such as a coat of weight 0; such a weight is then not a
               field. An eighth of the text of a default `openpbr` remains
    Numeric parameters become the fields of a struct, choices shape the code. Spectra are RGB, values those of
    "radiance" mode. Directions are unit vectors of the local frame, +z the shading normal.
    Raises InputError for a stochastic material (RandomWalk), which has no shader code.
    """
    return bundle(model, lang, functions, lean=lean).text


@exclusive
def bundle(
    model: BSDF | str,
    lang: str = "glsl",
    functions: Sequence[str] = ("eval", "pdf", "sample", "terms"),
    *,
    lean: bool = False,
    on: Collection[str] = (),
) -> Bundle:
    """Shader, manifest and tables of a material; arguments as in `emit`.

    on  paths of weights that stay fields of a lean shader although they are switched off
    """
    language = Language.family.get(str(lang))
    if isinstance(model, str):
        model = notation.named(model)[0]
    functions = programs.check(model, functions, "emit")
    numbers = dict(_numbers(model))  # raises for arrays of materials
    try:
        made = Program(model, functions, [path for path in switched_off(model) if path not in on] if lean else ())
    except graph.RecordingError as error:
        raise InputError(f"it cannot be written as shader code: {error.what}", error.where, error.hint) from error
    names = Names(made, language)
    text = _text(made, names)
    tables = {f"table_{t.name}": pixels(t) for t in made.tables}
    return Bundle(text, _manifest(made, names, numbers), tables)


# ---------------------------------------------------------------------- text


def _text(made: Program, names: Names) -> str:
    language = names.language
    bodies = [RoutineWriter(names, r).text() for r in made.routines if stem_of(r) not in language.native]
    parts: list[list[str]] = [_head(made, names)]
    constants = []
    for name, (value, about) in names.constants.items():
        line = language.constant(name, literal(value))
        if about and len(line) + len(about) + 4 <= 110:
            constants.append(f"{line}  // {about}")
        else:
            constants += [*(f"// {text}" for text in textwrap.wrap(about, 105)), line]
    if constants:
        parts.append(constants)
    for record in _structs(made, names):
        parts.append([*comment(record.doc), *_struct(record, names)])
    for place, table in enumerate(made.tables):
        uniform = f"table_{table.name}"
        size = " x ".join(map(str, table.shape))
        channels = f"{table.channels} channel{'s' * (table.channels > 1)}"
        readings = sorted(made.readings[id(table)])
        rule = "linear between texel centers, " if "lookup" in readings else ""
        about = f"// {size} texels, {channels}; {rule}clamped outside."
        binding = language.binding(uniform, 3 if len(axes(table)) == 3 else 2, place)
        readers = [line for how in readings for line in ("", *READERS[how](language, table))]
        parts.append([*binding, "", about, *readers[1:]])
    parts += bodies
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def _head(made: Program, names: Names) -> list[str]:
    model, language = made.model, names.language
    entries = sorted(made.entries.items(), key=lambda entry: list(ENTRIES).index(entry[0]))
    choices = [f"{path} = {value}" for path, value in _choices(model)]
    lines = [f"// {type(model).__name__}, written by Gonio {__version__} from its Python source.", "//"]
    lines += comment(re.sub(r"\s\(`gonio\.[\w.]+`\)", "", inspect.cleandoc(type(model).__doc__ or "")))
    if made.without:
        off = ", ".join(f"{path} = {tree.value_at(model, path):g}" for path in made.without)
        lines += ["//", *(f"// {text}" for text in textwrap.wrap(f"Written without parts that are off: {off}.", 105))]
    if choices:
        lines += ["//", *(f"// {text}" for text in textwrap.wrap("With " + ", ".join(choices) + ".", 105))]
    lines += ["//"]
    calls = [
        f"{names.routines[routine]}({', '.join(_arguments(made, method, language))})" for method, routine in entries
    ]
    for call, (method, _) in zip(calls, entries, strict=True):
        lines.append(f"// {call:{max(map(len, calls))}}  {ENTRIES[method]}")
    lines += [
        "//",
        "// wo points to the viewer, wi to the light: unit vectors of the local frame, away from the surface; +z is",
        f"// the shading normal. Colors are linear RGB. {language.precision}",
    ]
    return lines


# descriptions of the functions that a program calls
ENTRIES = {
    "derive": "quantities that depend on the parameters alone: call it once per draw",
    "eval": "the BSDF times |cos theta_i|, RGB, 1/sr",
    "pdf": "density with which `sample` chooses wi, 1/sr",
    "sample": "wi, its weight eval / pdf, its pdf; u: three random numbers in [0, 1)",
    "terms": "the factors of eval, for inspection",
}


def _arguments(made: Program, method: str, language: Language) -> list[str]:
    first = [language.word("self")]
    if method == "derive":
        return first
    return first + ["derived"] * (made.derived is not None) + ["wo", "u" if method == "sample" else "wi"]


def _choices(model: BSDF) -> list[tuple[str, Value]]:
    """(path, value) of the choices that shape the code: classes of materials, options and flags."""
    return [
        *((path, type(inner).__name__) for path, inner in tree.walk(model) if path),
        *((leaf.path, leaf.value) for leaf in tree.leaves(model) if not leaf.parameter.numeric),
    ]


def _structs(made: Program, names: Names) -> list[Record]:
    own = made.struct_of(made.bound)
    assert own is not None
    names.note(own.record)
    if made.derived is not None:
        names.note(made.derived.record)
    return list(names.records.values())


def _struct(record: Record, names: Names) -> list[str]:
    fields = [(names.language.type(type_), names.language.word(name)) for name, type_ in record.fields]
    if not fields:  # a struct needs at least one member
        fields = [(names.language.type("float"), "nothing")]
    lines = names.language.struct(names.language.word(record.name), fields)
    for place, (name, _) in zip(range(len(lines) - 2, 0, -1), reversed(record.fields), strict=False):
        about = record.docs.get(name) or (TERMS.get(name, "") if record.name.endswith("Terms") else "")
        if about and len(lines[place]) + len(about) + 5 <= COLUMNS + 10:
            lines[place] += f"  // {about}"
        elif about:
            lines[place:place] = [f"{INDENT}// {text}" for text in textwrap.wrap(about, COLUMNS)]
    return lines


# ---------------------------------------------------------------------- manifest


def _manifest(made: Program, names: Names, numbers: dict[str, Json]) -> dict[str, Json]:
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
    facts = made.bound  # of the code, whose parameters may change
    return {
        "version": 1,
        "lang": language.name,
        "model": cls.name,
        "title": cls.__name__,
        "doc": inspect.cleandoc(cls.__doc__ or ""),
        "shader": cls.name + language.suffix,
        "struct": language.word(struct.record.name),
        "size": size,
        "fields": fields,
        "derived": derived
        and {
            "struct": language.word(derived.record.name),
            "fields": [{"name": language.word(name), "type": type_} for name, type_ in derived.record.fields],
        },
        "functions": {method: names.routines[routine] for method, routine in made.entries.items()},
        "terms": [
            {"name": name, "type": type_, "doc": TERMS.get(name, "")}
            for name, type_ in (terms.record.fields if terms and terms.record else [])
        ],
        "parameters": list(_parameters(model, set(struct.paths))),
        "textures": [
            {
                "uniform": f"table_{table.name}",
                "dimension": 3 if len(axes(table)) == 3 else 2,
                "size": list(axes(table)),
                "channels": width(table),
                "format": {1: "r32float", 2: "rg32float", 4: "rgba32float"}[width(table)],
                "file": f"{table.name}.f32",
                "binding": place,
            }
            for place, table in enumerate(made.tables)
        ],
        "transmits": bool(facts.transmits),
        "delta": facts.delta,
        "stochastic": False,
        "isotropic": bool(facts.isotropic),
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


def _parameters(model: BSDF, fields: set[str]) -> Iterator[dict[str, Json]]:
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
            "fixed": path in fixed,
        }


def _plain(value: object) -> object:
    if isinstance(value, bool | str) or value is None:
        return value
    array = np.asarray(value, dtype=float)
    return float(array) if array.ndim == 0 else array.tolist()


def _numbers(model: BSDF) -> Iterator[tuple[str, Value]]:
    """(path, value in the form of its field) of each numeric parameter."""
    for path, parameter, value, owner in tree.surface(model):
        if parameter.numeric and value is not None:
            array = np.asarray(value, dtype=float)
            location = f"emit: {type(owner).__name__}.{parameter.name}"
            widest = {"spectrum": 3, "alpha": 2}.get(parameter.kind, 1)
            if array.ndim > 1 or array.size not in (1, widest) or (array.ndim == 1 and widest == 1):
                what = "one value per ray given, a single value expected"
                raise InputError(what, location, "the shader's struct holds one material")
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
