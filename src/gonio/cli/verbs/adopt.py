"""`gonio adopt`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ...errors import InputError
from ..options import Json
from .base import MATERIALS, verb


@verb(MATERIALS, place=10)
def adopt(
    file: Annotated[Path, Argument(metavar="FILE", help="A shader: .glsl, .frag, .hlsl, .wgsl, .spv or .brdf.")],
    *,
    force: Annotated[bool, Option("--force", help="Replace an adapter that is there already.")] = False,
    as_json: Json = False,
) -> None:
    """Write the adapter of a shader, FILE.toml: which function is the BRDF, and what its arguments mean.

    It is a first one by names of functions, arguments and uniforms; the guesses are printed.

    \b
    Examples:
      gonio adopt my.glsl
      gonio verify my.glsl
    """
    from ... import files
    from ...catalog import shaders

    adopted = shaders.adopt(file)
    target = Path(f"{file}.toml")
    if target.exists() and not force:
        raise InputError(f"'{target}' is there already", "FILE", "edit it, or replace it with --force")
    files.write_whole(target, adopted.text.encode())
    if as_json:
        print(json.dumps({"written": str(target), "guesses": adopted.guesses}))
        return
    print(target)
    for guess in adopted.guesses:
        print(f"  guessed: {guess}")
