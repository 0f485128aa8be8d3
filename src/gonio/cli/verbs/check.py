"""`gonio check`."""

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
    """Options of the judgment and of its report."""

    scene: Annotated[
        Path | None, Option(metavar="FILE", help="The scene of a picture; with --sheet, a folder of scenes.")
    ] = None
    sheet: Annotated[
        str | None, Option(metavar="hw4|lab2", help="The assignment sheet for a folder of submissions.")
    ] = None
    up: Annotated[str, Option(metavar="z|y|x", help="The axis along the normal in rows of directions.")] = "z"
    tolerance: Annotated[
        float | None, Option(metavar="X", help="Relative difference of f that counts as equal; 0.002 for rows.")
    ] = None
    hide_solution: Annotated[
        bool, Option("--hide-solution", help="Print where a mistake is, without formulas and values of the solution.")
    ] = False
    function: Annotated[str, Option(metavar="NAME", help="The function to judge in a shader.")] = ""
    junit: Annotated[Path | None, Option("--junit", metavar="FILE", help="Write the verdicts as JUnit XML.")] = None


@verb(MATERIALS, place=3)
def check(
    target: Annotated[
        str | None,
        Argument(
            metavar="WORK", help="A table (.png), rows of f (.csv), FILE.py:CLASS, a shader, a picture, or a folder."
        ),
    ] = None,
    model: Annotated[
        str | None,
        Argument(
            metavar="MODEL",
            help="The material to judge by; for a table of E, the masking term that it must have.",
            autocompletion=completion.materials,
        ),
    ] = None,
    *,
    how: Judging,
    made: Material,
    against: Annotated[str | None, Option(metavar="MODEL", help="The same as MODEL.")] = None,
    reference: Annotated[
        Path | None,
        Option(
            metavar="DIR",
            help="Write reference values there: f at 200 pairs for WORK, a material, or all of the courses.",
        ),
    ] = None,
    trust: Trust,
    as_json: Json = False,
) -> None:
    """Judge a student's own work: right or wrong, how far off, and the probable mistake.

    A table of E or E_avg is compared with all forms that follow from the homework's text, its figures and the usual
    mistakes. Rows of wo, wi and f from any program, and classes, are compared with MODEL pair by pair. A picture may be
    shifted by up to two pixels, have another exposure, and be stored with or without gamma. The exit code is 0 if
    everything is right, 1 if something is wrong or missing, 2 if something cannot be read.

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
    """The work, and the material or masking term by which it is judged. Each of the given parameters is set on the
    materials that have it."""
    from ...catalog import outside, shaders
    from ...optics.masking import Masking

    if target is None:
        raise InputError("nothing to judge", "WORK", "such as: gonio check E.png")
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
    table = listing("submission", "task", "file", "judgment", "points", "probable mistake")
    for row in report.rows():
        table.add_row(*row)
    print_rich(table)
