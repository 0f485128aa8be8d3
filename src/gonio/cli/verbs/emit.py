"""`gonio emit`."""

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

SLASHES = tuple({"/", os.sep})  # at the end of a folder's name


class Place(Options):
    """The place of a shader in a module with other code, and the files of its tables."""

    prefix: Annotated[str, Option(metavar="TEXT", help="Begin all global names with this, such as g_.")] = ""
    group: Annotated[int, Option(metavar="N", help="The group of the tables' bindings, not in GLSL ES.")] = 0
    first_binding: Annotated[int, Option(metavar="N", help="Number of the first table's binding.")] = 0
    tables: Annotated[
        str, Option(metavar="raw|exr|ktx2", help="Format of the table files in a folder; by default raw float32.")
    ] = ""
    half: Annotated[
        bool, Option("--half", help="16-bit tables; the text states the error, also for parameters in 16 bits.")
    ] = False


class Content(Options):
    """The parts of the material to write, or the approximation that replaces its functions."""

    functions: Annotated[str, Option(metavar="NAME,..", help="Which of eval, pdf, sample, terms.")] = "eval,pdf,sample"
    lean: Annotated[
        bool, Option("--lean", help="Omit layers that are off at these values, such as a coat of weight 0.")
    ] = False
    constants: Annotated[
        bool, Option("--constants", help="Also write the material's own values, as a constant of its struct.")
    ] = False
    fold: Annotated[bool, Option("--fold", help="Put the material's own values into the code.")] = False
    fit: Annotated[
        str, Option(metavar="N|N/M", help="Instead write albedos as rational fits of this order; N/0: polynomials.")
    ] = ""
    ibl: Annotated[bool, Option("--ibl", help="Instead write the split sum of image-based lighting.")] = False
    budget: Annotated[
        int, Option(metavar="N", help="Choose the most accurate terms, table or fit within N operations.")
    ] = 0


Models = Annotated[
    list[str],
    Argument(
        metavar="MODEL",
        help="A material; several share one module and the options.",
        autocompletion=completion.materials,
    ),
]
Language = Annotated[
    str,
    Option(
        "--lang",
        "--language",
        metavar="NAME",
        help="glsl, glsl-vulkan, wgsl, hlsl, slang, msl, godot, tsl, osl; numpy, torch, jax: a Python file.",
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
        output_option("FILE|DIR/", "The shader; or a folder for the shader, manifest.json and tables."),
    ] = None,
    place: Place,
    check: Annotated[
        int, Option(metavar="N", help="Instead of a shader, write N pairs of directions with 64-bit values as JSON.")
    ] = 0,
    as_json: Json = False,
) -> None:
    """Write a material, traced from its own source, as code in GLSL, WGSL, HLSL, Python or your own language.

    -o may be given twice. A name that ends in / is a folder; its tables are raw float32 unless --tables says otherwise.

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
