"""The command `gonio verify`."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from .. import completion
from ..options import Executor, Json, Material, Options, Seed, output_option
from ..output import Bar, console
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...verify.isolation.child import Task
    from ...verify.report import Report


class Files(Options):
    """Reports for people and for continuous integration."""

    output: Annotated[Path | None, output_option("DIR", "Folder for report.html and report.json.")] = None
    junit: Annotated[Path | None, Option("--junit", metavar="FILE", help="JUnit XML file for the verdicts.")] = None
    sarif: Annotated[Path | None, Option("--sarif", metavar="FILE", help="SARIF 2.1.0 file for the failures.")] = None
    github: Annotated[
        bool, Option("--github", help="Print annotations for GitHub Actions; the default on GitHub runners.")
    ] = False
    baseline: Annotated[
        Path | None,
        Option(
            "--baseline",
            metavar="FILE",
            help="File of known failures, as written by --write-baseline; only new failures count.",
        ),
    ] = None
    write_baseline: Annotated[
        Path | None,
        Option("--write-baseline", metavar="FILE", help="File for the failures, as a baseline for later runs."),
    ] = None
    tolerate: Annotated[
        str, Option(metavar="GRADE", help="Most severe grade of failures to tolerate: invisible, small or visible.")
    ] = ""


class Effort(Options):
    """Options that select the laws to test and the effort of the tests."""

    vary: Annotated[
        str,
        Option(
            metavar="NAME=V1,V2|A..B",
            help="Parameter and its values (a range gives five); each value has its own report card.",
        ),
    ] = ""
    quick: Annotated[bool, Option("--quick", help="Run a quick test, which takes only seconds.")] = False
    deep: Annotated[bool, Option("--deep", help="Test with more samples, directions and roughnesses.")] = False
    seed: Seed = None
    law: Annotated[
        list[str] | None,
        Option(
            "--law",
            metavar="NAME",
            help="Law to test, instead of all laws; repeatable.",
            autocompletion=completion.laws,
        ),
    ] = None
    timeout: Annotated[float | None, Option(metavar="S", help="Time limit per law in seconds; 300 by default.")] = None
    memory: Annotated[
        float | None, Option(metavar="GB", help="Memory limit per BSDF; half of the machine's memory by default.")
    ] = None

    def name(self) -> str:
        from ...errors import InputError

        if self.quick and self.deep:
            raise InputError("both quick and deep given", "--quick", "give one of them")
        return "quick" if self.quick else "deep" if self.deep else "default"


@verb(MATERIALS, place=2)
def verify(
    target: Annotated[
        list[str],
        Argument(
            metavar="TARGET",
            help="MODEL, FILE.py:CLASS, a shader such as FILE.glsl, mitsuba:PLUGIN, or a Mitsuba .xml or .json; "
            "several targets share the same options.",
            autocompletion=completion.materials,
        ),
    ],
    *,
    to: Files,
    made: Material,
    how: Effort,
    at: Annotated[
        str,
        Option(metavar="O/I", help="Pair of directions to evaluate in both orders: theta,phi/theta,phi in degrees."),
    ] = "",
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Verify the energy conservation, reciprocity, sampling, gradients and precision of BSDFs.

    Each target is tested in a separate process, so a BSDF that crashes or hangs does not end the run. The exit code is
    1 if a target violates a law without declaring it, or 4 if all such violations are too small to see in a picture.

    \b
    Examples:
      gonio verify conductor --param alpha=0.3 -o report
      gonio verify dielectric --vary alpha=0.01..1 --quick --workers 4
      gonio verify mitsuba:roughplastic
      gonio verify glass.py:Glass --law reciprocity
      gonio verify glass.py:Glass cloth.py:Cloth --junit laws.xml --sarif laws.sarif
      gonio verify glass.py:Glass --write-baseline known.json
      gonio verify glass.py:Glass --baseline known.json
    """
    target = made.shaders(target)
    if at:
        _show_pairs(target, made.settings(), how.vary, at, as_json)
        return
    # Import only small modules before the first process has started, which takes as long as all other steps together.
    from ...verify.ci.outputs import Outputs
    from ...verify.isolation import child

    effort = how.name()
    outputs = Outputs(to.output, to.junit, to.sarif, to.baseline, to.write_baseline, to.tolerate)
    known = outputs.check()
    items = [child.Item(one, tuple(made.settings()), how.vary) for one in target]
    task = child.Task(items, effort, 1 if how.seed is None else how.seed, how.law)
    report = _judge(task, ", ".join(target), how, executor, quiet=as_json)
    outputs.write(report, known)
    _annotate(report, to.github, as_json)
    if as_json:
        print(json.dumps(report.as_dict()))
    else:
        report.show(console())
        if to.output is not None:
            print(to.output / "report.html")
    if not report.passed:
        raise Exit(report.exit_code)


def _judge(task: Task, title: str, how: Effort, executor: Executor, *, quiet: bool) -> Report:
    """The report of a task, computed by `executor`, with a progress bar and, unless `quiet`, early results."""
    from ...verify.isolation import child

    with _progress(title) as (progress, tell):
        # A single target or a quick check need not be resumable, so its cards are divided among processes without a
        # cluster.
        if executor.cluster is None and (len(task.items) == 1 or task.effort == "quick"):
            workers = 1 if executor.workers is None else executor.workers
            shown = None if quiet else tell
            return child.trial(task, jobs=workers, limit=how.timeout, memory=how.memory, progress=progress, tell=shown)
        from ...verify import trials

        with executor.running():
            return trials.trial(task, limit=how.timeout, memory=how.memory, progress=progress)


@contextlib.contextmanager
def _progress(title: str) -> Iterator[tuple[Callable[[int, int, str], None], Callable[[str], None]]]:
    """Two functions that write to standard error: one updates a progress bar, which is created at the first step
    because it loads Rich; the other prints lines above the bar."""
    with contextlib.ExitStack() as stack:
        bars: list[Bar] = []

        def progress(done: int, total: int, state: str) -> None:
            if sys.stderr.isatty():
                if not bars:
                    bars.append(stack.enter_context(Bar(title)))
                bars[0].step(done, total, state)

        def tell(text: str) -> None:
            if bars:
                bars[0].tell(text)
            else:
                print(text, file=sys.stderr, flush=True)

        yield progress, tell


def _annotate(report: Report, wanted: bool, as_json: bool) -> None:
    """Print annotations if requested, or on a GitHub runner, which reads both standard output and standard error."""
    from ...verify.ci import github

    if wanted or github.wanted():
        (sys.stderr if as_json else sys.stdout).write(github.text(report))


def _show_pairs(target: Sequence[str], settings: Sequence[str], vary: str, at: str, as_json: bool) -> None:
    """Print what each target returns for one pair of directions, in both orders."""

    from ...verify import targets, terminal
    from ...verify.directions import parse

    for subject in [subject for one in target for subject in targets.resolve(one, settings, vary)]:
        if as_json:
            print(json.dumps(terminal.pair(subject, *parse(at))))
        else:
            terminal.show_pair(subject, *parse(at), console())
