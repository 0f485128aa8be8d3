"""The command `gonio schema`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

from typer import Argument

from ...errors import InputError, did_you_mean
from ..options import output_option
from .base import SUPPORT, verb

KINDS = ("scene", "report", "manifest")


@verb(SUPPORT, place=1)
def schema(
    kind: Annotated[
        str,
        Argument(
            metavar="scene|report|manifest",
            help="Kind of file that the schema describes: scene, report, or shader manifest.",
        ),
    ] = "scene",
    output: Annotated[
        Path | None, output_option("FILE", "File for the schema; by default, the schema is printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scene files, reports or shader manifests, for validation and for completion in editors.

    \b
    Examples:
      gonio schema -o scene.schema.json
      gonio schema report
      gonio schema manifest
    """
    if kind not in KINDS:
        raise InputError(f"no schema for '{kind}'", "", did_you_mean(kind, KINDS))
    if output is not None:
        from ... import files

        files.check_file(output)
    if kind == "report":
        from ...verify.ci import schema as report

        text = report.text()
    elif kind == "manifest":
        from ...shaders import schema as manifest

        text = manifest.text()
    else:
        from ... import scene

        text = json.dumps(scene.json_schema(), indent=2) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    files.write_whole(output, text.encode())
    print(output)
