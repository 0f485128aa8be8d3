"""The command `gonio emit`."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from .. import completion
from ..options import Json, Material, Options, output_option
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...shaders.bundle import Bundle

SLASHES = tuple({"/", os.sep})  # the name of a folder ends with one of these


class Place(Options):
    """Options for embedding a shader in other code, and for the files of its tables."""

    prefix: Annotated[str, Option(metavar="TEXT", help="Prefix of all global names, such as g_.")] = ""
    group: Annotated[int, Option(metavar="N", help="Binding group of the tables; not used in GLSL ES.")] = 0
    first_binding: Annotated[int, Option(metavar="N", help="Binding number of the first table.")] = 0
    tables: Annotated[
        str, Option(metavar="raw|exr|ktx2", help="Format of the table files in a folder; raw float32 by default.")
    ] = ""
    half: Annotated[
        bool, Option("--half", help="Write 16-bit tables, and report the errors of 16-bit tables and parameters.")
    ] = False


class Content(Options):
    """The parts of the material to write, or the approximation that replaces its functions."""

    functions: Annotated[
        str, Option(metavar="NAME,..", help="Functions to write: any of eval, pdf, sample and terms.")
    ] = "eval,pdf,sample"
    lean: Annotated[
        bool, Option("--lean", help="Omit layers that the parameters switch off, such as a coat of weight 0.")
    ] = False
    constants: Annotated[
        bool, Option("--constants", help="Also write the material's parameters as a constant of the struct type.")
    ] = False
    fold: Annotated[bool, Option("--fold", help="Replace the parameters in the code by their values.")] = False
    fit: Annotated[
        str,
        Option(
            metavar="N|N/M",
            help="Write rational fits of degree N/M to the albedos instead of the material; N/0 gives polynomials.",
        ),
    ] = ""
    ibl: Annotated[
        bool, Option("--ibl", help="Write the split sum for image-based lighting instead of the material.")
    ] = False
    budget: Annotated[
        int,
        Option(metavar="N", help="Operation limit; the most accurate terms, table or fit within it is selected."),
    ] = 0


Models = Annotated[
    list[str],
    Argument(
        metavar="MODEL",
        help="Material; several materials are written to one module, with the same options.",
        autocompletion=completion.materials,
    ),
]
Language = Annotated[
    str,
    Option(
        "--lang",
        "--language",
        metavar="NAME",
        help="Language: glsl, glsl-vulkan, wgsl, hlsl, slang, msl, godot, tsl, osl; Python: numpy, torch, jax.",
        autocompletion=completion.languages,
    ),
]


@verb(MATERIALS, place=3)
def emit(
    model: Models,
    *,
    lang: Language = "glsl",
    content: Content,
    made: Material,
    output: Annotated[
        list[str] | None,
        output_option("FILE|DIR/", "File for the shader, or folder for the shader, manifest.json and tables."),
    ] = None,
    place: Place,
    check: Annotated[
        int,
        Option(
            metavar="N", help="Write double-precision values for N pairs of directions as JSON, instead of a shader."
        ),
    ] = 0,
    as_json: Json = False,
) -> None:
    """Translate the source code of a material to GLSL, WGSL, HLSL, Python or a language of your own.

    -o may be given twice. A name that ends in / denotes a folder; its tables are raw float32 unless --tables selects
    another format.

    \b
    Examples:
      gonio emit conductor --preset Au
      gonio emit dielectric --lang wgsl --functions eval -o glass.wgsl
      gonio emit kulla-conty -p base=conductor -o shaders/ --tables ktx2
      gonio emit openpbr -p coat_weight=1 --lean
      gonio emit conductor dielectric --prefix g_ --lang wgsl --group 1 --first-binding 4
      gonio emit conductor --preset Au --constants --fold
      gonio emit conductor --preset Au --language torch -o gold.py
      gonio emit conductor --preset Au --check 10000 -o vectors.json
      gonio emit conductor --preset Au --fit 4 --lang wgsl
      gonio emit conductor --ibl --budget 80
      gonio emit conductor --preset Au --budget 150
    """
    from ... import files
    from ...shaders import Placement
    from ...shaders.emission import Choice
    from ...shaders.emission import shader as written_for
    from ...shaders.own_values import OwnValues

    folders = [Path(one) for one in output or () if one.endswith(SLASHES)]
    single = [Path(one) for one in output or () if not one.endswith(SLASHES)]
    for path in single:  # before anything is computed or written
        files.check_file(path)
    for path in folders:
        files.check_folder(path, parents=True)
    if check:
        _write_pairs(made.texts(model), check, content.functions, single, folders)
        return
    at = Placement(**vars(place))
    own = OwnValues(content.lean, content.constants, content.fold)
    choice = Choice(content.functions, own, content.fit, content.ibl, content.budget)
    shader, errors = written_for(made.texts(model), lang, choice, at)
    for line in errors:
        print(line, file=sys.stderr)
    _write_shader(shader, single, folders, as_json)


def _write_shader(shader: Bundle, single: list[Path], folders: list[Path], as_json: bool) -> None:
    """Write a shader to files and folders, or print it."""
    from ... import files

    if shader.tables and not folders:
        count = len(shader.tables)
        words = "a table that is" if count == 1 else f"{count} tables that are"
        names = ", ".join(shader.tables)
        print(f"the shader reads {words} not in its text: {names}; -o DIR/ writes them too", file=sys.stderr)
    written = [str(path) for folder in folders for path in shader.write(folder)]
    for path in single:
        files.write_whole(path, shader.text.encode())
        written.append(str(path))
    if as_json:
        print(json.dumps({"text": shader.text, "manifest": shader.manifest, "written": written}))
    elif written:
        print("\n".join(written))
    else:
        sys.stdout.write(shader.text)


def _write_pairs(models: list[str], count: int, functions: str, single: list[Path], folders: list[Path]) -> None:
    """Write the pairs of `--check` to files, or print them."""
    from ... import files
    from ...errors import InputError
    from ...shaders.vectors import vectors

    if folders or len(models) != 1:
        what = f"{len(models)} materials given" if len(models) != 1 else f"the folder '{folders[0]}' given"
        raise InputError(f"{what}, one material and a file expected", "--check", "gonio emit M --check N -o M.json")
    text = json.dumps(vectors(models[0], count, functions)) + "\n"
    for path in single:
        files.write_whole(path, text.encode())
        print(path)
    if not single:
        sys.stdout.write(text)
