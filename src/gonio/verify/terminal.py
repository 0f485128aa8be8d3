"""Print a report card as a table in the terminal, or the values for one pair of directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import numpy as np

from . import directions
from .forensics import diagnosis
from .subject import Fault, Subject
from .verdict import CONSEQUENCE, DECLARED, FAIL, KNOWN, NOT_APPLICABLE, NOT_TRIED, PASS, TOLERATED, Card, Verdict

if TYPE_CHECKING:
    from rich.console import Console

MARKS = {
    PASS: "[green]pass[/]",
    FAIL: "[bold red]FAIL[/]",
    DECLARED: "[yellow]breaks as declared[/]",
    KNOWN: "[yellow]fails, known[/]",
    TOLERATED: "[yellow]fails, tolerated:[/]",
    NOT_APPLICABLE: "[dim]-[/]",
    NOT_TRIED: "[bold yellow]NOT TRIED[/]",
}


def show_card(card: Card, console: Console) -> None:
    """Print the verdicts as a table, then the explanation of each failure."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, title=f"[bold]{escape(card.title)}[/]", title_justify="left")
    for heading, style in (
        ("", "dim"),
        ("law", "cyan"),
        ("verdict", ""),
        ("measured", ""),
        ("allowed", ""),
        ("", "dim"),
    ):
        table.add_column(heading, style=style, no_wrap=heading in ("law", "verdict", "allowed"))
    for v in card.verdicts:
        table.add_row(str(v.number), v.law, _mark(v), escape(_figure(v)), _allowed(v), escape(_remark(v)))
    console.print(table)
    below = [card.covered, *card.notes, *([card.quality.words] if card.quality else [])]
    for line in filter(None, below):
        console.print(f"[dim]{escape(line)}[/]")
    console.print()
    ordered = diagnosis.in_order(card.verdicts)
    same = [
        v for v in ordered if v.figure is None and v.cause.startswith(CONSEQUENCE)
    ]  # the exception is another law's
    for v in ordered:
        if v not in same:
            _explain(v, console)
    if same:
        laws = ", ".join(v.law for v in same)
        console.print(f"[bold red]{escape(laws)}[/]: the same exception ({escape(same[0].cause)})\n")


def _mark(verdict: Verdict) -> str:
    """The status of a verdict, and the severity of a failure: "FAIL visible"."""
    return f"{MARKS[verdict.status]} {verdict.grade}" if verdict.grade else MARKS[verdict.status]


def _figure(verdict: Verdict) -> str:
    return verdict.shown if verdict.figure is not None else ""


def _allowed(verdict: Verdict) -> str:
    if verdict.tolerance is None or not np.isfinite(verdict.tolerance):
        return ""
    return f"{verdict.tolerance:.0e}" if verdict.tolerance else "0"


def _remark(verdict: Verdict) -> str:
    if verdict.status == NOT_APPLICABLE:
        return "does not apply: " + "; ".join(verdict.why)
    if verdict.failed or verdict.excused:
        return verdict.title
    if verdict.status == NOT_TRIED:
        return "; ".join(verdict.why)
    return verdict.notes[0] if verdict.notes else ""


def _explain(verdict: Verdict, console: Console) -> None:
    from rich.text import Text

    console.print(Text(f"{verdict.law}: ", style="bold red").append(verdict.title, style="default not bold"))
    rows = [("reason", line) for line in verdict.why] + [("note", line) for line in verdict.notes]
    rows += [
        ("effect", verdict.bias.words if verdict.bias else ""),
        ("cause", verdict.cause_in_words),
        ("worst case", verdict.worst),
        ("consequence", verdict.meaning),
        ("tolerance", verdict.reason),
        ("reproduce", verdict.command),
    ]
    for name, line in rows:
        if line:
            console.print(
                Text(f"  {name:>12}  ", style="cyan").append(line, style="default"), soft_wrap=name == "reproduce"
            )
    console.print()


# --------------------------------------------------------------------------- one pair


class Values(TypedDict):
    """The values of a subject for one pair of directions."""

    f: list[float]
    eval: list[float]
    pdf: float


def pair(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> dict[str, object]:
    """The values of a subject for a pair of directions and the swapped pair, in each precision, as plain numbers."""
    answers = {
        label: {"fault": str(answer)} if isinstance(answer, Fault) else answer
        for label, answer in _answers(subject, wo, wi).items()
    }
    return {"wo": directions.text(wo), "wi": directions.text(wi), **answers}


def show_pair(subject: Subject, wo: np.ndarray, wi: np.ndarray, console: Console) -> None:
    """Print the values that `pair` returns."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    title = f"{subject.title}: wo {directions.text(wo)}, wi {directions.text(wi)} (theta, phi in degrees)"
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")
    for heading in ("", "f, 1/sr", "eval", "pdf, 1/sr"):
        table.add_column(heading)
    for label, answer in _answers(subject, wo, wi).items():
        if isinstance(answer, Fault):
            table.add_row(label, escape(str(answer)), "", "")
        else:
            digits = 7 if label.startswith("float32") else 15
            values = ["  ".join(f"{v:.{digits}g}" for v in channels) for channels in (answer["f"], answer["eval"])]
            table.add_row(label, *values, f"{answer['pdf']:.{digits}g}")
    console.print(table)


def _answers(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> dict[str, Values | Fault]:
    answers: dict[str, Values | Fault] = {}
    for precision in subject.precisions:
        for way, o, i in (("wo -> wi", wo[None], wi[None]), ("wi -> wo", wi[None], wo[None])):
            try:
                answers[f"{precision}, {way}"] = {
                    "f": subject.f(o, i, precision=precision)[0].tolist(),
                    "eval": subject.eval(o, i, precision=precision)[0].tolist(),
                    "pdf": float(subject.pdf(o, i, precision)[0]),
                }
            except Fault as fault:
                answers[f"{precision}, {way}"] = fault
    return answers
