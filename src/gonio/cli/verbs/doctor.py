"""The command `gonio doctor`."""

from __future__ import annotations

import json
from typing import Annotated

from typer import Exit, Option

from ..options import Device, Json
from ..output import listing, print_rich
from .base import SUPPORT, verb


@verb(SUPPORT, place=2)
def doctor(
    bench: Annotated[
        bool, Option("--bench", help="Run a benchmark that compares Gonio with Mitsuba's own plugins.")
    ] = False,
    device: Device = "cpu",
    as_json: Json = False,
) -> None:
    """Report which components for rendering are available on this machine, and how to install missing ones.

    The exit code is 3 if the machine cannot render at all. --bench prints a short table of speeds for bug reports:
    rays, calls of a material's eval and sample, direct lighting, and paths, in millions per second.

    \b
    Examples:
      gonio doctor
      gonio doctor --bench --device cuda
    """
    from rich.text import Text

    from ...render import doctor as examination

    if bench:
        _bench(device, as_json)
        return
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


def _bench(device: str, as_json: bool) -> None:
    """Print the table of speeds."""
    from ... import __version__
    from ...render import bench

    machine, rows = bench.measure(device)
    if as_json:
        print(json.dumps({"version": __version__, "machine": machine, "rows": [row.as_dict() for row in rows]}))
        return
    table = listing("M/s", "Gonio", "Mitsuba", "ratio")
    for row in rows:
        own = f"{row.gonio:.1f}" if row.gonio else "-"
        table.add_row(row.what, own, f"{row.mitsuba:.1f}", f"{row.gonio / row.mitsuba:.2f}" if row.gonio else "-")
    print(f"gonio {__version__}, {machine}")
    print_rich(table)
