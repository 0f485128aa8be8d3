"""`gonio verify`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

from .. import completion
from ..options import Json, Parameters
from ..output import Bar
from .base import MATERIALS, verb


@verb(MATERIALS, place=2)
def verify(
    target: Annotated[
        str,
        Argument(
            metavar="TARGET",
            help="MODEL, FILE.py:CLASS, mitsuba:PLUGIN, or a Mitsuba .xml or .json.",
            autocompletion=completion.materials,
        ),
    ],
    param: Parameters = None,
    sweep: Annotated[
        str, Option(metavar="NAME=A..B", help="A card for each of five values, or for NAME=V1,V2,...")
    ] = "",
    quick: Annotated[bool, Option("--quick", help="A first look, in seconds.")] = False,
    deep: Annotated[bool, Option("--deep", help="More samples, more directions, more widths.")] = False,
    seed: Annotated[int, Option(metavar="N", help="Of all random numbers.")] = 1,
    law: Annotated[
        list[str] | None,
        Option("--law", metavar="NAME", help="Only this law; repeatable.", autocompletion=completion.laws),
    ] = None,
    at: Annotated[
        str, Option(metavar="O/I", help="Only print both ways of one pair, theta,phi/theta,phi in degrees.")
    ] = "",
    report: Annotated[
        Path | None, Option("--report", metavar="DIR", help="Write report.html and report.json there.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Prove a BSDF: energy, reciprocity, sampling, gradients, precision.

    Exit code 1 where a law is broken that the material does not declare to break.

    \b
    Examples:
      gonio verify conductor --param alpha=0.3 --report out
      gonio verify dielectric --sweep alpha=0.01..1 --quick
      gonio verify mitsuba:roughplastic
      gonio verify glass.py:Glass --law reciprocity
    """
    from rich.console import Console

    from ...verify import run, targets, terminal
    from ...verify.directions import parse

    subjects = targets.resolve(target, param or [], sweep)
    console = Console(emoji=False)
    if at:
        for subject in subjects:
            if as_json:
                print(json.dumps(terminal.pair(subject, *parse(at))))
            else:
                terminal.show_pair(subject, *parse(at), console)
        return
    with Bar(target) as bar:
        found = run.verify(subjects, quick=quick, deep=deep, seed=seed, law=law, report=report, progress=bar.step)
    if as_json:
        print(json.dumps(found.as_dict()))
    else:
        found.show(console)
        if report is not None:
            print(report / "report.html")
    if not found.passed:
        raise Exit(found.exit_code)
