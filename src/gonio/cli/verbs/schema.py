"""`gonio schema`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from .base import SUPPORT, verb


@verb(SUPPORT, place=1)
def schema(
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Where to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scene files, by which editors complete and check them.

    \b
    Example:
      gonio schema -o scene.schema.json
    """
    from ...render import scene

    text = json.dumps(scene.json_schema(), indent=2) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    from ... import files

    files.write_whole(output, text.encode())
    print(output)
