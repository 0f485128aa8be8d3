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
from ..options import Json, Parameters
from ..output import Bar
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...verify.ci.baseline import Known
    from ...verify.report import Report


@dataclass(frozen=True)
class Outputs:
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

    def check(self) -> None:
        """Raise InputError for what cannot be written, before anything is computed."""
        from ... import files

        if self.report is not None:
            files.check_folder(self.report)
        for file in (self.junit, self.sarif, self.write_baseline):
            if file is not None:
                files.check_file(file)

    def known(self) -> Known:
        """What is known to fail; InputError where the baseline is none."""
        if self.baseline is None:
            return {}
        from ...verify.ci import baseline

        return baseline.read(self.baseline)

    def write(self, found: Report, known: Known, as_json: bool) -> None:
        """Mark what is known in the report, write the files, and print what is for the runner."""
        from ... import files
        from ...verify import page
        from ...verify.ci import baseline, github, junit, sarif

        mended = baseline.apply(found, known)
        if self.write_baseline is not None:
            files.write_whole(self.write_baseline, baseline.text(found).encode())
            baseline.apply(found, baseline.read(self.write_baseline))
        if self.report is not None:
            page.write(found, self.report)
        for file, format_ in ((self.junit, junit), (self.sarif, sarif)):
            if file is not None:
                files.write_whole(file, format_.text(found).encode())
        stream = sys.stderr if as_json else sys.stdout  # the runner reads both
        if self.github or github.wanted():
            stream.write(github.text(found))
        for line in mended:
            print(f"mended: {line}", file=stream)


@verb(MATERIALS, place=2)
def verify(
    target: Annotated[
        list[str],
        Argument(
            metavar="TARGET...",
            help="MODEL, FILE.py:CLASS, mitsuba:PLUGIN, or a Mitsuba .xml or .json; several share the options.",
            autocompletion=completion.materials,
        ),
    ],
    outputs: Outputs,
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
    from ...verify import child

    if quick and deep:
        raise InputError("quick and deep together", "--quick", "give one of them")
    outputs.check()
    known = outputs.known()
    items = [child.Item(one, tuple(param or ()), sweep) for one in target]
    task = child.Task(items, "quick" if quick else "deep" if deep else "default", seed, law)
    with contextlib.ExitStack() as stack:
        bars: list[Bar] = []

        def progress(done: int, total: int, state: str) -> None:
            if sys.stderr.isatty():
                if not bars:
                    bars.append(stack.enter_context(Bar(", ".join(target))))
                bars[0].step(done, total, state)

        found = child.trial(task, jobs=jobs, limit=limit, memory=memory, progress=progress)
    outputs.write(found, known, as_json)
    if as_json:
        print(json.dumps(found.as_dict()))
    else:
        from rich.console import Console

        found.show(Console(emoji=False))
        if outputs.report is not None:
            print(outputs.report / "report.html")
    if not found.passed:
        raise Exit(found.exit_code)


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
