"""Verbs about the installation: schema, doctor."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .app import SUPPORT, app
from .options import (
    Json,
)
from .output import listing, print_rich

if TYPE_CHECKING:
    pass


@app.command(rich_help_panel=SUPPORT)
def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Where to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scene files, by which editors complete and check them.

    \b
    Example:
      gonio schema -o scene.schema.json
    """
    from ..render import scene

    text = json.dumps(scene.json_schema(), indent=2) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    from .. import files

    files.write_whole(output, text.encode())
    print(output)


@app.command(rich_help_panel=SUPPORT)
def doctor(as_json: Json = False) -> None:
    """Say what this machine can render with, what is missing, and how to get it.

    Exit code 3 where there is nothing to render with.

    \b
    Example:
      gonio doctor
    """
    from ..render import doctor as examination

    report = examination.examine()
    if as_json:
        print(json.dumps(report.as_dict()))
    else:
        table = listing("", "", "")
        marks = {"ok": "[green]ok[/]", "missing": "[yellow]--[/]", "bad": "[red]!![/]"}
        for finding in report.findings:
            table.add_row(marks[finding.state], finding.subject, finding.text)
        print_rich(table)
        print(report.verdict)
    if not report.can_render:
        raise typer.Exit(3)
