"""Annotations for GitHub Actions: lines that the runner reads and displays next to the code."""

from __future__ import annotations

import os
from collections.abc import Mapping

from ..report import Report
from ..verdict import NOT_TRIED
from . import places

_KINDS = {"error": "error", "warning": "warning", "note": "notice"}


def wanted() -> bool:
    """Whether a runner of GitHub Actions reads the output."""
    return os.environ.get("GITHUB_ACTIONS") == "true"


def text(report: Report) -> str:
    """One line per law that is violated or was not tested, with the file, if any; "" if all laws hold."""
    lines = []
    for one in report.unread:
        place = places.of_unread(one)
        options = {"file": place.file, "line": str(place.line)} if place else {}
        lines.append(_line("error", {**options, "title": f"{one.target}: not read"}, one.words()))
    for card in report.cards:
        for verdict in card.verdicts:
            untried = verdict.status == NOT_TRIED
            if not verdict.failed and not verdict.excused and not untried:
                continue
            place = places.of(card, verdict)
            options = {"file": place.file, "line": str(place.line)} if place else {}
            options["title"] = f"{card.title}: {verdict.law}" + (
                f": {verdict.status}" if verdict.excused or untried else ""
            )
            lines.append(_line(_KINDS[places.level(verdict)], options, "\n".join(places.words(verdict))))
    return "".join(lines)


def _line(kind: str, options: Mapping[str, str], words: str) -> str:
    named = ",".join(f"{name}={_property(value)}" for name, value in options.items())
    return f"::{kind} {named}::{_data(words)}\n"


def _data(text: str) -> str:
    """The text as one line, escaped in the same way as by the runner's own toolkit: % is escaped first."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


__all__ = ["text", "wanted"]
