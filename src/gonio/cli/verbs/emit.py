"""`gonio emit`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from .. import completion
from ..options import Json, Material, Model
from .base import MATERIALS, verb


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
        Path | None, Option("-o", "--output", metavar="FILE", help="Where to write; else it is printed.")
    ] = None,
    bundle: Annotated[
        Path | None, Option(metavar="DIR", help="Write shader, manifest.json and tables (raw float32) there.")
    ] = None,
    lean: Annotated[
        bool, Option("--lean", help="Leave out what its values switch off, such as a coat of weight 0.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write a material as shader code, traced from its own source: GLSL, WGSL, HLSL, or a language of yours.

    \b
    Examples:
      gonio emit conductor --preset Au
      gonio emit dielectric --lang wgsl --functions eval -o glass.wgsl
      gonio emit kulla-conty -p base=conductor --bundle shaders
      gonio emit openpbr -p coat_weight=1 --lean
    """
    from ... import files
    from ...shaders import bundle as make_bundle

    if output is not None:  # before anything is computed or written
        files.check_file(output)
    if bundle is not None:
        files.check_folder(bundle)
    shader = make_bundle(made.text(model), lang, functions, lean=lean)
    written = [str(path) for path in shader.write(bundle)] if bundle is not None else []
    if output is not None:
        files.write_whole(output, shader.text.encode())
        written.append(str(output))
    if as_json:
        print(json.dumps({"text": shader.text, "manifest": shader.manifest, "written": written}))
    elif written:
        print("\n".join(written))
    else:
        sys.stdout.write(shader.text)
