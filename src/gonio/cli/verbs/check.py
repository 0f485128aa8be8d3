"""The command `gonio check`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from ...errors import InputError
from .. import completion
from ..options import Json, Material, Options, Trust
from ..output import listing, print_rich
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...check import Finding, Report


class Judging(Options):
    """Options of a check and of its report."""

    scene: Annotated[
        Path | None, Option(metavar="FILE", help="Scene that the picture shows; with --sheet, a folder of scenes.")
    ] = None
    sheet: Annotated[
        str | None, Option(metavar="hw4|lab2", help="Assignment sheet, to check a folder of submissions.")
    ] = None
    up: Annotated[str, Option(metavar="z|y|x", help="Axis along the normal in rows of directions.")] = "z"
    tolerance: Annotated[
        float | None,
        Option(metavar="X", help="Relative tolerance for values of f; 0.002 by default for rows of f."),
    ] = None
    hide_solution: Annotated[
        bool,
        Option("--hide-solution", help="Print the location of a mistake, but no formulas or values of the solution."),
    ] = False
    function: Annotated[str, Option(metavar="NAME", help="Name of the shader function to check.")] = ""
    junit: Annotated[Path | None, Option("--junit", metavar="FILE", help="JUnit XML file for the verdicts.")] = None


@verb(MATERIALS, place=3)
def check(
    target: Annotated[
        str | None,
        Argument(metavar="WORK", help="Table (.png), rows of f (.csv), FILE.py:CLASS, shader, picture, or folder."),
    ] = None,
    model: Annotated[
        str | None,
        Argument(
            metavar="MODEL",
            help="Reference material; for a table of E, the required masking term.",
            autocompletion=completion.materials,
        ),
    ] = None,
    *,
    how: Judging,
    made: Material,
    against: Annotated[
        str | None, Option(metavar="MODEL", help="Reference material, as an alternative to the argument MODEL.")
    ] = None,
    reference: Annotated[
        Path | None,
        Option(
            metavar="DIR",
            help="Folder for reference values of the material WORK, or of all models of the course.",
        ),
    ] = None,
    trust: Trust,
    as_json: Json = False,
) -> None:
    """Check a student's work, and report the size of the error and the probable mistake.

    A table of E or E_avg is compared with every variant that results from the text of homework 4, from its figures or
    from a common mistake. Classes, and rows of wo, wi and f from any program, are compared with MODEL for each pair of
    directions. A picture may be shifted by up to two pixels, have a different exposure, and be stored with or without
    gamma. The exit code is 0 if everything is right, 1 if something is wrong or missing, and 2 if something cannot be
    read.

    \b
    Examples:
      gonio check E.png
      gonio check E.png schlick-ibl
      gonio check f.csv oren-nayar -p sigma=0.3 --up y
      gonio check mine.py:MyConductor conductor --preset Au -p alpha=0.3
      gonio check mine.glsl --function BRDF --against "conductor(preset=Au,alpha=0.3)"
      gonio check picture.png --scene examples/phong
      gonio check submission --sheet hw4 --junit out.xml
      gonio check --reference values
      gonio check class --sheet lab2 --scene examples --hide-solution
    """
    from ...check import check as judge

    if reference is not None:
        _write_reference(reference, target, made, as_json)
        return
    work, right = _with_parameters(target, model, against, made)
    result = judge(work, right, **vars(how), **vars(trust))
    _print(result, as_json)
    if result.exit_code:
        raise Exit(result.exit_code)


def _print(result: Report | Finding, as_json: bool) -> None:
    from ...check import Report

    if as_json:
        print(json.dumps(result.as_dict()))
    elif isinstance(result, Report):
        _print_table(result)
    else:
        print("\n".join(result.lines()))


def _write_reference(folder: Path, material: str | None, made: Material, as_json: bool) -> None:
    """Write reference values and print the names of the files."""
    from ...check import reference

    if material is None:
        made.refuse("--reference given without a material")
    written = [str(path) for path in reference.write(folder, None if material is None else made.text(material))]
    print(json.dumps({"files": written}) if as_json else "\n".join(written))


def _with_parameters(
    target: str | None, model: str | None, against: str | None, made: Material
) -> tuple[str, str | None]:
    """The work, and the material or masking term with which it is compared. Each of the given parameters is set for
    every material that has it."""
    from ...catalog import outside, shaders
    from ...optics.masking import Masking

    if target is None:
        raise InputError("no work to check", "WORK", "such as: gonio check E.png")
    if model is not None and against is not None:
        raise InputError(f"both '{model}' and --against given", "--against", "name the model once")
    model = against if model is None else model
    if model is None or model in Masking.family.all():
        made.refuse(target if model is None else model)
        return target, model
    if outside.names_code(target.partition("(")[0]) or shaders.head_in(target):
        work, model = made.texts([target, model])
        return work, model
    return target, made.text(model)


def _print_table(report: Report) -> None:
    """Print one row per file, and the suggested points of each submission."""
    table = listing("submission", "task", "file", "result", "points", "probable mistake")
    for row in report.rows():
        table.add_row(*row)
    print_rich(table)
