"""`gonio check` and `go.check`: recognize the kind of a student's work and check it."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, Unpack

from ..arguments import takes_fields
from ..catalog import notation, operands, outside, shaders, texts
from ..errors import InputError
from ..files import check_file, write_whole
from ..material import BSDF
from ..owner import public
from . import classes, pictures, samples, sheet, stated, tables
from .finding import Finding
from .report import Mark, Report, Submission, junit


@dataclass(frozen=True)
class Work:
    """The work to be checked, and the options of the check. The fields are arguments of `check`."""

    target: str | Path | BSDF
    against: str | BSDF | None = None
    scene: str | Path | None = None
    up: str = "z"
    tolerance: float | None = None
    function: str = ""
    allow_outside: bool = False
    allow_code: bool = False

    @property
    def path(self) -> Path:
        return Path(os.path.expanduser(str(self.target)))

    @property
    def suffix(self) -> str:
        return "" if isinstance(self.target, BSDF) else self.path.suffix.lower()

    @property
    def is_material(self) -> bool:
        """Whether the target is a material, a class in a Python file, or a shader."""
        if isinstance(self.target, BSDF):
            return True
        name = notation.split(self.text)[0]
        return outside.names_code(name) or shaders.names_shader(name)

    @property
    def text(self) -> str:
        """The target as a string; for the .toml adapter of a shader, the shader."""
        text = str(self.target)
        shader = text.removesuffix(".toml")
        return shader if shader != text and shaders.names_shader(shader) else text

    def model(self) -> BSDF:
        """The material with which the work is compared. Raises InputError if none is given."""
        if isinstance(self.against, BSDF):
            return self.against
        if not self.against:
            raise InputError(
                "no model to compare with", "MODEL", "such as: gonio check mine.py:Mine conductor -p alpha=0.3"
            )
        operands.kind_of(self.against, operands.MATERIALS, "MODEL")
        return notation.named(self.against)[0]


class WorkKeywords(TypedDict, total=False):
    """The fields of `Work` except `target` and `against`, as keyword arguments, for type checkers."""

    scene: str | Path | None
    up: str
    tolerance: float | None
    function: str
    allow_outside: bool
    allow_code: bool


def _class(work: Work) -> Finding:
    given = work.target if isinstance(work.target, BSDF) else _named(work)
    name = type(given).name if isinstance(work.target, BSDF) else notation.split(work.text)[0]
    return classes.check(name, given, work.model(), work.tolerance)


def _named(work: Work) -> BSDF:
    if not work.function:
        return notation.named(work.text)[0]
    head, own = notation.split(work.text)
    if not shaders.names_shader(head):
        raise InputError(f"--function given, but '{head}' is not a shader", "--function", "leave it out")
    named = shaders.with_options(head, [("function", work.function)])
    return notation.made(shaders.class_of(named), texts.assignments(own))[0]


def _rows(work: Work) -> Finding:
    return samples.check(work.path, stated.for_command(work.path, work.against), work.up, work.tolerance)


def _picture(work: Work) -> Finding:
    assert work.scene is not None
    return pictures.check(work.path, Path(work.scene), work.allow_outside, work.allow_code)


def _table(work: Work) -> Finding:
    if work.against is not None and not isinstance(work.against, str):
        raise InputError(
            "a table of E cannot be compared with a material",
            "MODEL",
            "give a masking term, such as schlick-ibl, or none",
        )
    return tables.check(tables.read(work.path), work.against or "")


# For each kind of work: whether a target is of that kind, and the function that checks it. The first match is used.
JUDGES: tuple[tuple[Callable[[Work], bool], Callable[[Work], Finding]], ...] = (
    (lambda work: work.is_material, _class),
    (lambda work: work.suffix in sheet.ROWS, _rows),
    (lambda work: work.suffix in sheet.PICTURES and work.scene is not None, _picture),
    (lambda work: work.suffix in sheet.PICTURES, _table),
)


@public
@takes_fields(Work, WorkKeywords)
def check(
    target: str | Path | BSDF,
    against: str | BSDF | None = None,
    *,
    sheet: str | None = None,
    hide_solution: bool = False,
    junit: str | Path | None = None,
    **work: Unpack[WorkKeywords],
) -> Finding | Report:
    """Check a student's work, and report the size of the error and the probable mistake.

        go.check("E.png").facts                                  # its form (k, flip, 1 - E), and the difference
        go.check("f.csv", go.OrenNayar(sigma=0.3), up="y").cause
        go.check(MyConductor(alpha=0.3), go.Conductor(alpha=0.3)).passed
        go.check("submissions", sheet="hw4").rows()

    target     a table of E or E_avg (.png, .exr, .npz); rows of wo, wi and f (.csv, .txt); a material, FILE.py:CLASS; a
               shader (.glsl, .wgsl, ...); a picture, with `scene`; a folder of these or of such folders, with `sheet`
    against    the material with which the work is compared, as a string or an object; for a table, the required
               masking term
    scene      the scene that a picture shows; with `sheet`, a folder of scenes named like the pictures
    sheet      "hw4" or "lab2": the tasks and their points
    up         the axis along the normal in rows of directions: "z", "y" or "x"
    tolerance  relative tolerance for values of f; None: 2e-3 for rows, 1e-4 for a material
    allow_outside, allow_code  permissions of scenes, as in `go.render`
    hide_solution  omit the formulas and values of the solution
    junit      path of a JUnit XML file for the verdicts
    function   the name of the shader function to check, in place of the function specified in the adapter
    Returns a Finding, or a Report for a folder; both have `passed`, `exit_code` and `as_dict`.
    Raises InputError for work that cannot be read. In a folder, the error becomes a finding, and the other files are
    checked.
    """
    if junit is not None:
        check_file(junit)
    result = _judge(Work(target, against, **work), sheet)
    if hide_solution:
        result = result.without_solution()
    if junit is not None:
        write_whole(junit, _junit(result).encode())
    return result


def _judge(work: Work, tasks: str | None) -> Finding | Report:
    if not work.is_material and work.path.is_dir():
        if not tasks:
            raise InputError(
                f"'{work.target}' is a folder", "TARGET", f"name its sheet: --sheet {' or '.join(sheet.SHEETS)}"
            )
        return sheet.check(work.path, tasks, None if work.scene is None else Path(work.scene), work.up)
    if tasks:
        raise InputError(f"'{work.target}' is not a folder", "--sheet", "give the folder of one or more submissions")
    judge = next((judge for accepts, judge in JUDGES if accepts(work)), None)
    if judge is None:
        what = f"'{work.target}' is {'a PDF, which' if work.suffix == '.pdf' else 'of a kind that'} cannot be checked"
        raise InputError(
            what, "TARGET", "give a table (.png), rows of f (.csv), FILE.py:CLASS, a shader, or a folder with --sheet"
        )
    if not work.is_material and not work.path.exists():
        raise InputError(f"no file '{work.target}'", "TARGET", "check the path")
    return judge(work)


def _junit(result: Finding | Report) -> str:
    if isinstance(result, Report):
        return junit(result.submissions)
    return junit([Submission(result.name, [Mark(result.kind, 0.0, result)])])
