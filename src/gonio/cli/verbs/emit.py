"""`gonio emit`."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from .. import completion
from ..options import Json, Material, Model, output_option
from .base import MATERIALS, verb

SLASHES = tuple({"/", os.sep})  # at the end of a folder's name


@verb(MATERIALS, place=3)
def emit(
    model: Model,
    *,
    lang: Annotated[
        str, Option(metavar="NAME", help="The shader language.", autocompletion=completion.languages)
    ] = "glsl",
    functions: Annotated[str, Option(metavar="NAME,..", help="Which of eval, pdf, sample, terms.")] = "eval,pdf,sample",
    made: Material,
    output: Annotated[
        list[str] | None,
        output_option("FILE|DIR/", "The shader; or a folder, for it, manifest.json and tables."),
    ] = None,
    lean: Annotated[
        bool, Option("--lean", help="Omit layers that are off at these values, such as a coat of weight 0.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write a material as shader code, traced from its own source: GLSL, WGSL, HLSL, or a language of yours.

    -o may be given twice: a name that ends in / is a folder, whose tables are raw float32.

    \b
    Examples:
      gonio emit conductor --preset Au
      gonio emit dielectric --lang wgsl --functions eval -o glass.wgsl
      gonio emit kulla-conty -p base=conductor -o shaders/
      gonio emit openpbr -p coat_weight=1 --lean
    """
    from ... import files
    from ...shaders import bundle as make_bundle

    folders = [Path(one) for one in output or () if one.endswith(SLASHES)]
    single = [Path(one) for one in output or () if not one.endswith(SLASHES)]
    for path in single:  # before anything is computed or written
        files.check_file(path)
    for path in folders:
        files.check_folder(path)
    shader = make_bundle(made.text(model), lang, functions, lean=lean)
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
