"""A baseline: a list of known failures. Only new failures fail a report.

A failure is known if the same law on the same card failed when the baseline was written, and its value has grown by at
most a tenth since then. Any report.json can serve as a baseline. `text` writes a short form, to be stored with the
code.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...errors import InputError
from ..report import Report
from ..verdict import FAIL, KNOWN, TOLERATED, Verdict

SCHEMA = "gonio-baseline/1"
WORSE = 1.1  # ratio of values above which a failure is new: rounding and other machines change values by less

Known = Mapping[tuple[str, str], float | None]


def read(path: Path) -> Known:
    """The values of the known failures in a baseline, by title and law; None for failures without a value. Raises
    InputError if the file is not a baseline."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"no file '{path}'", "--baseline", "write one with --write-baseline FILE") from None
    except (OSError, ValueError) as error:
        raise InputError(f"invalid JSON: {error}", str(path), "write one with --write-baseline FILE") from None
    try:
        return dict(_failures(data))
    except (KeyError, TypeError, AttributeError):
        what = "neither a baseline nor a report.json"
        raise InputError(what, str(path), "write one with --write-baseline FILE") from None


def _failures(data: Any) -> list[tuple[tuple[str, str], float | None]]:
    if data["schema"] == SCHEMA:
        return [((str(one["title"]), str(one["law"])), _number(one["figure"])) for one in data["failures"]]
    return [
        ((str(card["title"]), str(verdict["law"])), _number(verdict["figure"]))
        for card in data["cards"]
        for verdict in card["verdicts"]
        if verdict["status"] in (FAIL, KNOWN, TOLERATED)
    ]


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def text(report: Report) -> str:
    """The failures of a report as a baseline, in JSON."""
    failures = [
        {"title": card.title, "law": verdict.law, "figure": verdict.as_dict()["figure"], "why": verdict.why[:1]}
        for card in report.cards
        for verdict in card.verdicts
        if verdict.failed or verdict.excused
    ]
    data = {"schema": SCHEMA, "seed": report.seed, "effort": report.effort, "failures": failures}
    return json.dumps(data, indent=2) + "\n"


def apply(report: Report, known: Known) -> list[str]:
    """Mark known failures in a report, so that they do not fail it. Returns those that no longer occur, as text."""
    fixed = []
    for card in report.cards:
        for verdict in card.verdicts:
            key = card.title, verdict.law
            if key not in known:
                continue
            if not verdict.failed:
                fixed.append(f"{card.title}: {verdict.law} no longer fails and can be removed from the baseline")
            elif _no_worse(verdict, known[key]):
                verdict.status = KNOWN
            else:
                now = verdict.shown or "no measured value"
                verdict.notes.append(f"worse than in the baseline: {now}, {_words(known[key])}")
    return fixed


def _no_worse(verdict: Verdict, before: float | None) -> bool:
    now = verdict.as_dict()["figure"]
    if not isinstance(now, float | int):
        return before is None
    return before is None or abs(now) <= WORSE * abs(before)


def _words(before: float | None) -> str:
    return "no measured value before" if before is None else f"{before:.3g} before"


__all__ = ["apply", "read", "text"]
