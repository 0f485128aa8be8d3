"""The command `gonio report`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Executor, Json, Options, Rendering, output_option
from ..output import Bar, print_warnings
from .base import PICTURES, verb


class Figures(Options):
    """Figures specified on the command line, in addition to the picture of the scene."""

    study: Annotated[
        list[str] | None,
        Option(
            "--study",
            metavar="NAME=V1,V2",
            help="Contact sheet of the scene over a parameter, or over two, separated by ';'; repeatable.",
        ),
    ] = None
    plot: Annotated[
        list[str] | None,
        Option("--plot", metavar="[KIND=]MODEL", help="Materials to plot, separated by ';'; repeatable."),
    ] = None
    bake: Annotated[
        list[str] | None,
        Option(
            "--bake", metavar="TARGET", help="Distribution, such as ggx, whose albedo tables are added; repeatable."
        ),
    ] = None
    work: Annotated[
        list[str] | None,
        Option("--work", metavar="WORK[;MODEL]", help="Your own work to check, such as f.csv; repeatable."),
    ] = None


@verb(PICTURES, place=3)
def report(
    target: Annotated[str, Argument(metavar="LIST|SCENE", help="List of figures (.toml), scene folder, or material.")],
    *,
    output: Annotated[Path | None, output_option("DIR", "Folder for the report; NAME-report by default.")] = None,
    figures: Figures,
    how: Rendering,
    executor: Executor,
    title: Annotated[str, Option(metavar="TEXT", help="Heading of a new report.md.")] = "",
    pdf: Annotated[
        bool, Option("--pdf", help="Also print the page to report.pdf; requires Chromium, Chrome or Edge.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Create a lab report from pictures, contact sheets, plots, tables, verdicts and text of your own.

    The report's folder contains report.md with the text, report.html (a single file that needs no network), and the
    figures. report.md is written only if it is missing: edit its text and run the same command again. Figures that have
    not changed are not created again.

    \b
    Examples:
      gonio report examples/phong
      gonio report lab2.toml -o lab2 --pdf
      gonio report examples/phong --study "shapes.1.material.p=4,16,64" --plot "slice=phong(p=4);phong(p=64)"
      gonio report conductor --study "alpha=0.1,0.3,0.5" --bake ggx --spp 32
    """
    from ...pictures import exposures
    from ...render.request import parse_size
    from ...report import run

    size = None if how.size is None else parse_size(str(how.size))
    options = replace(run.given(how), size=size, exposure=exposures.parse(str(how.exposure)))
    with Bar(target) as bar, executor.running():
        result = run.write(target, {**vars(figures)}, options, output, title, pdf, step=bar.step, tell=bar.tell)
    if as_json:
        print(json.dumps(result.as_dict()))
        return
    print_warnings(result.warnings)
    made = len(result.figures) - result.unchanged
    print(f"{result.output}  {made} figures created, {result.unchanged} unchanged")
    if result.pdf is not None:
        print(result.pdf)
    print(f"{result.words}  {'edit the text, then run the same command again' if result.new_words else 'not changed'}")
    for line in result.unused:
        print(f"  not shown there: {line}")
