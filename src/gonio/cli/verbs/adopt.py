"""The command `gonio adopt`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ...errors import InputError
from ..options import Json, Reading, output_option
from .base import MATERIALS, verb


@verb(MATERIALS, place=10)
def adopt(
    file: Annotated[
        Path,
        Argument(
            metavar="FILE",
            help="Shader (.glsl, .frag, .hlsl, .slang, .wgsl, .spv or .brdf), or the folder of an engine's package.",
        ),
    ],
    *,
    how: Reading,
    output: Annotated[
        Path | None, output_option("DIR", "Folder for the shaders of an engine; by default named after its package.")
    ] = None,
    tsl: Annotated[
        bool, Option("--tsl", help="Also adopt the TSL build of three.js, by running its JavaScript.")
    ] = False,
    force: Annotated[bool, Option("--force", help="Replace existing files.")] = False,
    as_json: Json = False,
) -> None:
    """Write an adapter that specifies which function of a shader is its BRDF, and the meaning of its arguments.

    The adapter, FILE.toml, is inferred from the names of functions, arguments and uniforms, and each guess is printed.
    If FILE is the folder of an engine, either an npm package or a checkout of its repository, shaders that include the
    engine's code are written instead, with their adapters.

    \b
    Examples:
      gonio adopt my.glsl
      gonio verify my.glsl
      gonio adopt node_modules/three
      gonio verify three/three-standard.glsl
      gonio adopt node_modules/three --tsl
    """
    from ... import files
    from ...catalog import shaders

    if file.is_dir():
        how.shaders(())
        _adopt_package(file, output, tsl=tsl, force=force, as_json=as_json)
        return
    if tsl:
        raise InputError(f"'{file}' is not the folder of three.js", "--tsl", "gonio adopt node_modules/three --tsl")
    if output is not None:
        raise InputError(
            "-o names the folder for a package's shaders", "--output", "leave it out: FILE.toml is written"
        )
    adopted = shaders.adopt(how.shaders([str(file)])[0])
    target = Path(f"{shaders.parted(str(file))[0]}.toml")
    if target.exists() and not force:
        raise InputError(f"'{target}' already exists", "FILE", "edit it, or replace it with --force")
    files.write_whole(target, adopted.text.encode())
    if as_json:
        print(json.dumps({"written": str(target), "guesses": adopted.guesses}))
        return
    print(target)
    for guess in adopted.guesses:
        print(f"  guessed: {guess}")


def _adopt_package(folder: Path, output: Path | None, *, tsl: bool, force: bool, as_json: bool) -> None:
    from ...catalog import shaders

    target = output or Path(shaders.package_in(folder).name.rpartition("/")[2])
    if target.exists() and not force:
        raise InputError(f"'{target}' already exists", "--output", "name another folder, or replace it with --force")
    written = shaders.adopt_package(folder, target, tsl=tsl)
    print(json.dumps({"written": [str(one) for one in written]}) if as_json else "\n".join(map(str, written)))
