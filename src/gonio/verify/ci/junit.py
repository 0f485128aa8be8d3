"""JUnit XML, which Jenkins, GitLab, Azure and others display: one suite per card, one case per law."""

from __future__ import annotations

import re
from xml.etree import ElementTree as xml

from ..report import Report
from ..verdict import NOT_APPLICABLE, NOT_TRIED, Card, Unread, Verdict
from . import places

_FORBIDDEN = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0, even when escaped


def text(report: Report) -> str:
    """The content of the file for a report."""
    counts = {**_counts(report.cards), "errors": str(len(report.unread)), "time": f"{report.seconds:.3f}"}
    counts["tests"] = str(int(counts["tests"]) + len(report.unread))
    root = xml.Element("testsuites", {"name": "gonio verify", **counts})
    for one in report.unread:
        _unread(root, one)
    for card in report.cards:
        time = sum(verdict.seconds for verdict in card.verdicts)
        suite = xml.SubElement(root, "testsuite", {"name": clean(card.title), **_counts([card]), "time": f"{time:.3f}"})
        for verdict in card.verdicts:
            _case(suite, card, verdict)
        lines = [*card.notes, *([card.quality.words] if card.quality else [])]
        if lines:
            xml.SubElement(suite, "system-out").text = clean("\n".join(lines))
    xml.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + xml.tostring(root, encoding="unicode") + "\n"


def _unread(root: xml.Element, one: Unread) -> None:
    """Add a suite with a single case for a target that could not be read."""
    counts = {"tests": "1", "failures": "0", "errors": "1", "skipped": "0", "time": "0.000"}
    suite = xml.SubElement(root, "testsuite", {"name": clean(one.target), **counts})
    case = xml.SubElement(suite, "testcase", classname=clean(one.target), name="read", time="0.000")
    place = places.of_unread(one)
    if place is not None:
        case.set("file", clean(place.file))
        case.set("line", str(place.line))
    xml.SubElement(case, "error", message=clean(one.words()), type="read")


def _case(suite: xml.Element, card: Card, verdict: Verdict) -> None:
    case = xml.SubElement(
        suite, "testcase", classname=clean(card.title), name=verdict.law, time=f"{verdict.seconds:.3f}"
    )
    place = places.of(card, verdict)
    if place is not None:
        case.set("file", clean(place.file))
        case.set("line", str(place.line))
    first = clean(verdict.why[0] if verdict.why else verdict.title)
    if verdict.failed:
        failure = xml.SubElement(case, "failure", message=first, type=places.grade(verdict) or verdict.law)
        failure.text = clean("\n".join(places.words(verdict)))
    elif _skipped(verdict):
        xml.SubElement(case, "skipped", message=f"{verdict.status}: {first}")
    elif verdict.notes:
        xml.SubElement(case, "system-out").text = clean("\n".join(verdict.notes))


def _skipped(verdict: Verdict) -> bool:
    return verdict.excused or verdict.status in (NOT_APPLICABLE, NOT_TRIED)


def _counts(cards: list[Card]) -> dict[str, str]:
    verdicts = [verdict for card in cards for verdict in card.verdicts]
    return {
        "tests": str(len(verdicts)),
        "failures": str(sum(verdict.failed for verdict in verdicts)),
        "errors": "0",
        "skipped": str(sum(map(_skipped, verdicts))),
    }


def clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)


__all__ = ["clean", "text"]
