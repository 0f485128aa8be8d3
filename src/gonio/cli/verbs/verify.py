"""`gonio verify`."""

from __future__ import annotations

import contextlib
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from .. import completion
from ..options import Crew, Json, Parameters
from ..output import Bar
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...verify.report import Report


@dataclass(frozen=True)
class Files:
    """Files for people, and for the machines of continuous integration."""

    report: Annotated[
        Path | None, Option("--report", metavar="DIR", help="Write report.html and report.json there.")
    ] = None
    junit: Annotated[Path | None, Option("--junit", metavar="FILE", help="Write JUnit's XML.")] = None
    sarif: Annotated[Path | None, Option("--sarif", metavar="FILE", help="Write SARIF 2.1.0.")] = None
    github: Annotated[
        bool, Option("--github", help="Print annotations for GitHub Actions; there they come by themselves.")
    ] = False
    baseline: Annotated[
        Path | None, Option("--baseline", metavar="FILE", help="Fail only on what is not in it; a report.json will do.")
    ] = None
    write_baseline: Annotated[
        Path | None, Option("--write-baseline", metavar="FILE", help="Write what fails; it is known from then on.")
    ] = None


@verb(MATERIALS, place=2)
def verify(
    target: Annotated[
        list[str],
        Argument(
            metavar="TARGET",
            help="MODEL, FILE.py:CLASS, mitsuba:PLUGIN, or a Mitsuba .xml or .json; several share the options.",
            autocompletion=completion.materials,
        ),
    ],
    *,
    to: Files,
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
    jobs: Annotated[int, Option("--jobs", "-j", metavar="N", help="Targets and settings at a time.")] = 1,
    limit: Annotated[float | None, Option(metavar="SECONDS", help="Longest that a law may take; 300.")] = None,
    memory: Annotated[float | None, Option(metavar="GB", help="Most that a BSDF may take; half of all.")] = None,
    crew: Crew,
    as_json: Json = False,
) -> None:
    """Prove BSDFs: energy, reciprocity, sampling, gradients, precision.

    Each is judged in a process of its own, which it may crash or keep for ever. Exit code 1 where a law is broken that
    the material does not declare to break.

    \b
    Examples:
      gonio verify conductor --param alpha=0.3 --report out
      gonio verify dielectric --sweep alpha=0.01..1 --quick --jobs 4
      gonio verify mitsuba:roughplastic
      gonio verify glass.py:Glass --law reciprocity
      gonio verify glass.py:Glass cloth.py:Cloth --junit laws.xml --sarif laws.sarif
      gonio verify glass.py:Glass --write-baseline known.json
      gonio verify glass.py:Glass --baseline known.json
    """
    if at:
        _show_pairs(target, param or [], sweep, at, as_json)
        return
    # Nothing heavy before the first process has started: it takes as long as all else together.
    from ...errors import InputError
    from ...verify.ci.outputs import Outputs
    from ...verify.isolation import child

    if quick and deep:
        raise InputError("quick and deep together", "--quick", "give one of them")
    wanted = Outputs(**{name: value for name, value in vars(to).items() if name != "github"})
    known = wanted.check()
    items = [child.Item(one, tuple(param or ()), sweep) for one in target]
    task = child.Task(items, "quick" if quick else "deep" if deep else "default", seed, law)
    with contextlib.ExitStack() as stack:
        bars: list[Bar] = []

        def progress(done: int, total: int, state: str) -> None:
            if sys.stderr.isatty():
                if not bars:
                    bars.append(stack.enter_context(Bar(", ".join(target))))
                bars[0].step(done, total, state)

        if crew.workers is None and crew.cluster is None and len(items) == 1:
            found = child.trial(task, jobs=jobs, limit=limit, memory=memory, progress=progress)
        else:
            from ...verify import trials

            with crew.working():
                found = trials.trial(task, jobs=jobs, limit=limit, memory=memory, progress=progress)
    wanted.write(found, known)
    _annotate(found, to.github, as_json)
    if as_json:
        print(json.dumps(found.as_dict()))
    else:
        from rich.console import Console

        found.show(Console(emoji=False))
        if to.report is not None:
            print(to.report / "report.html")
    if not found.passed:
        raise Exit(found.exit_code)


def _annotate(found: Report, wanted: bool, as_json: bool) -> None:
    """Print annotations where they are wanted, or where a runner reads them: standard output and error alike."""
    from ...verify.ci import github

    if wanted or github.wanted():
        (sys.stderr if as_json else sys.stdout).write(github.text(found))


def _show_pairs(target: list[str], param: list[str], sweep: str, at: str, as_json: bool) -> None:
    """What each target says of one pair of directions, both ways round."""
    from rich.console import Console

    from ...verify import targets, terminal
    from ...verify.directions import parse

    for subject in [subject for one in target for subject in targets.resolve(one, param, sweep)]:
        if as_json:
            print(json.dumps(terminal.pair(subject, *parse(at))))
        else:
            terminal.show_pair(subject, *parse(at), Console(emoji=False))
