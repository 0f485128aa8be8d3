"""`gonio doctor`."""

from __future__ import annotations

import json

from typer import Exit

from ..options import Json
from ..output import listing, print_rich
from .base import SUPPORT, verb


@verb(SUPPORT, place=2)
def doctor(as_json: Json = False) -> None:
    """Say what this machine can render with, what is missing, and how to get it.

    Exit code 3 where there is nothing to render with.

    \b
    Example:
      gonio doctor
    """
    from rich.text import Text

    from ...render import doctor as examination

    report = examination.examine()
    if as_json:
        print(json.dumps(report.as_dict()))
    else:
        table = listing("", "", "")
        marks = {"ok": Text("ok", "green"), "missing": Text("--", "yellow"), "bad": Text("!!", "red")}
        for finding in report.findings:
            table.add_row(marks[finding.state], finding.subject, finding.text)
        print_rich(table)
        print(report.verdict)
    if not report.can_render:
        raise Exit(3)
