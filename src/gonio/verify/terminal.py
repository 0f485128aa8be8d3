"""The report as a table for the terminal, and the two numbers behind one pair of directions."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from . import directions
from .report import DECLARED, FAIL, NOT_APPLICABLE, PASS, Report, Verdict
from .subject import Fault, Subject

MARKS = {
    PASS: "[green]pass[/]",
    FAIL: "[bold red]FAIL[/]",
    DECLARED: "[yellow]breaks as declared[/]",
    NOT_APPLICABLE: "[dim]-[/]",
}


def show(report: Report, console: Any) -> None:
    """Print the report: a table a subject, then for each failure why, what it means, and how to see it again."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    for card in report.cards:
        table = Table(box=SIMPLE_HEAD, pad_edge=False, title=f"[bold]{escape(card.title)}[/]", title_justify="left")
        for heading, style in (
            ("", "dim"),
            ("law", "cyan"),
            ("verdict", ""),
            ("figure", ""),
            ("allowed", ""),
            ("", "dim"),
        ):
            table.add_column(heading, style=style, no_wrap=heading in ("law", "verdict", "allowed"))
        for v in card.verdicts:
            table.add_row(str(v.number), v.law, MARKS[v.status], escape(_figure(v)), _allowed(v), escape(_remark(v)))
        console.print(table)
        for v in card.verdicts:
            if v.failed:
                _explain(v, console)
    console.print(_summary(report))


def text(report: Report) -> str:
    """The same as plain text."""
    from rich.console import Console

    out = io.StringIO()
    show(report, Console(file=out, width=120, no_color=True))
    return out.getvalue()


def _figure(verdict: Verdict) -> str:
    return verdict.shown if verdict.figure is not None else ""


def _allowed(verdict: Verdict) -> str:
    if verdict.tolerance is None or not np.isfinite(verdict.tolerance):
        return ""
    return f"{verdict.tolerance:.0e}" if verdict.tolerance else "0"


def _remark(verdict: Verdict) -> str:
    if verdict.status == NOT_APPLICABLE:
        return "does not apply: " + "; ".join(verdict.why)
    if verdict.failed:
        return verdict.title
    return verdict.notes[0] if verdict.notes else ""


def _explain(verdict: Verdict, console: Any) -> None:
    from rich.text import Text

    console.print(Text(f"{verdict.law}: ", style="bold red").append(verdict.title, style="default not bold"))
    rows = [("why", line) for line in verdict.why] + [("note", line) for line in verdict.notes]
    rows += [
        ("worst", verdict.worst),
        ("means", verdict.meaning),
        ("tolerance", verdict.reason),
        ("again", verdict.command),
    ]
    for name, line in rows:
        if line:
            console.print(Text(f"  {name:>9}  ", style="cyan").append(line, style="default"), soft_wrap=name == "again")
    console.print()


def _summary(report: Report) -> str:
    failed = len(report.failures)
    word = "[green]all laws hold[/]" if not failed else f"[bold red]{failed} broken[/]"
    tests = (
        f"{report.tests} statistical tests, each at {report.threshold:.1e} (.01 over all)"
        if report.tests
        else "no statistical test"
    )
    return f"{word}  [dim]{report.effort}, seed {report.seed}, {tests}, {report.seconds:.1f} s[/]"


# --------------------------------------------------------------------------- one pair


def pair(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> dict[str, Any]:
    """What the subject says of one pair, both ways round and in each precision, as plain numbers."""
    a, b = wo[None], wi[None]
    rows: dict[str, Any] = {"wo": directions.text(wo), "wi": directions.text(wi)}
    for precision in subject.precisions:
        for label, o, i in (("wo -> wi", a, b), ("wi -> wo", b, a)):
            try:
                rows[f"{precision}, {label}"] = {
                    "f": subject.f(o, i, precision=precision)[0].tolist(),
                    "eval": subject.eval(o, i, precision=precision)[0].tolist(),
                    "pdf": float(subject.pdf(o, i, precision)[0]),
                }
            except Fault as fault:
                rows[f"{precision}, {label}"] = {"fault": str(fault)}
    return rows


def show_pair(subject: Subject, wo: np.ndarray, wi: np.ndarray, console: Any) -> None:
    """Print `pair`."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    found = pair(subject, wo, wi)
    title = f"{subject.title}: wo {found.pop('wo')}, wi {found.pop('wi')} (theta, phi in degrees)"
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")
    for heading in ("", "f, 1/sr", "eval", "pdf, 1/sr"):
        table.add_column(heading)
    for label, row in found.items():
        if "fault" in row:
            table.add_row(label, escape(row["fault"]), "", "")
        else:
            digits = 7 if label.startswith("float32") else 15
            values = ["  ".join(f"{v:.{digits}g}" for v in row[key]) for key in ("f", "eval")]
            table.add_row(label, *values, f"{row['pdf']:.{digits}g}")
    console.print(table)
