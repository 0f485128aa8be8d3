"""A shader with everything that a program needs in order to use it: text, manifest and tables."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import numpy as np

from .. import files
from ..catalog.material import MaterialLike, material
from ..errors import InputError
from ..material.recording import switched_off
from ..ops import graph
from ..owner import exclusive
from . import program as programs
from . import text as texts
from .languages import Language
from .manifest import Json, manifest, numbers_of
from .module import Module, of_several
from .names import Names
from .own_values import OwnKeywords, OwnValues
from .placement import Placement
from .program import Program
from .python_file import python_file
from .table_files import FORMATS
from .textures import pixels


@dataclass(frozen=True)
class Bundle:
    """The result of `bundle`.

    text      the shader: structs, helpers and functions, without a version line and main function
    manifest  the interface of the shader: plain dicts, lists, numbers; see docs/emit.md
    tables    uniform name -> float32 or float16 array in the order of upload (x fastest), channels last
    """

    text: str
    manifest: dict[str, Json]
    tables: dict[str, np.ndarray]

    def write(self, folder: Path | str) -> list[Path]:
        """Write the shader, manifest.json and one file per table, in the format `Placement.tables`. Returns their
        paths."""
        folder = files.check_folder(folder, parents=True)
        contents = {
            self.manifest["shader"]: self.text.encode(),
            "manifest.json": json.dumps(self.manifest, indent=2).encode(),
        }
        for texture in self.manifest["textures"]:
            contents[texture["file"]] = FORMATS[texture["file_format"]].write(self.tables[texture["uniform"]])
        files.write_all(folder, contents)
        return [folder / file for file in contents]


@exclusive
def bundle(
    model: MaterialLike | Sequence[MaterialLike],
    lang: str = "glsl",
    functions: Sequence[str] = ("eval", "pdf", "sample", "terms"),
    *,
    on: Collection[str] = (),
    arrays: bool = True,
    placement: Placement | None = None,
    **own: Unpack[OwnKeywords],
) -> Bundle:
    """Shader, manifest and tables of a material, or of several in one module; the arguments are those of `go.emit`.

    on         paths of weights that remain fields of a lean shader although they are switched off
    arrays     whether numbered derived constants are written as arrays; the viewer passes them to pixels one by one
    placement  prefix of the names, group and first number of the bindings, file format of the tables
    own        fields of `OwnValues`
    """
    values = OwnValues(**own)
    language, place = Language.family.get(str(lang)), placement or Placement()
    place.check(language)
    models = [model] if isinstance(model, str) or not isinstance(model, Sequence) else list(model)
    if not models:
        raise InputError("no material given", "emit", "name at least one, such as conductor")
    if language.standalone:
        return _file(models, language, functions, place, values)
    sources = [_recorded(one, functions, values, on, arrays=arrays) for one in models]
    module = Module(language, place, values.constants)
    manifests = [module.add(made, numbers) for made, numbers in sources]
    text = texts.joined(module.head, module.blocks, language, place.prefix)
    described = manifests[0] if len(manifests) == 1 else of_several(manifests, language)
    return Bundle(text, described, {name: pixels(table, place.bits) for name, table in module.tables.items()})


def _file(
    models: Sequence[MaterialLike],
    language: Language,
    functions: Sequence[str],
    place: Placement,
    own: OwnValues,
) -> Bundle:
    """A self-contained file, including its tables."""
    if place.prefix or place.first_binding or place.tables or place.half:
        what = f"a prefix, a binding or a table format given, but a {language.name} file is self-contained"
        raise InputError(what, "emit: lang", "omit these options; import the file under a name of your choice")
    if len(models) != 1:
        what = f"{len(models)} materials given, but a {language.name} file contains one"
        raise InputError(what, "emit: lang", "write one file per material")
    made, numbers = _recorded(models[0], functions, own, (), single=False)
    names = Names(made, language)
    text = python_file(made, names, numbers)
    described = manifest(made, names, numbers, {id(table): 0 for table in made.tables})
    return Bundle(text, {**described, "textures": []}, {})


def _recorded(
    model: MaterialLike,
    functions: Sequence[str],
    own: OwnValues,
    on: Collection[str],
    single: bool = True,
    arrays: bool = True,
) -> tuple[Program, dict[str, Json]]:
    """The parts of a material's shader, and the values of its numeric parameters by path."""
    model = material(model)
    functions = programs.check(model, functions, "emit")
    numbers = dict(numbers_of(model))  # raises for arrays of materials
    try:
        without = [path for path in switched_off(model) if path not in on] if own.lean else ()
        return Program(model, functions, without, single, arrays, numbers if own.fold else None), numbers
    except graph.RecordingError as error:
        raise InputError(f"it cannot be written as shader code: {error.what}", error.where, error.hint) from error
