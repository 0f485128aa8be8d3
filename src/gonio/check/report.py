"""The results for a folder: submissions, their tasks and the suggested points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any
from xml.etree import ElementTree as xml

from ..verify.ci.junit import clean
from .finding import BY_HAND, ERROR, MISSING, RIGHT, WRONG, Finding

PARTIAL = 0.5  # fraction of the points for a result with a known mistake, because the rest of the solution is right


@dataclass(frozen=True)
class Mark:
    """A task with its points and its result."""

    task: str
    points: float
    finding: Finding

    @property
    def suggested(self) -> float | None:
        """Suggested points; None if the work must be graded by a person."""
        if self.finding.status in (BY_HAND, ERROR):
            return None
        if self.finding.status == RIGHT:
            return self.points
        return math.floor(2.0 * PARTIAL * self.points) / 2.0 if self.finding.mistake is not None else 0.0


@dataclass(frozen=True)
class Submission:
    """The work of one student; `others` lists files that match no task."""

    name: str
    marks: Sequence[Mark]
    others: tuple[str, ...] = ()

    def best(self) -> dict[str, Mark]:
        """The mark of the best file of each task, in the order of the sheet."""
        best: dict[str, Mark] = {}
        for mark in self.marks:
            held = best.get(mark.task)
            if held is None or (mark.suggested or 0.0) > (held.suggested or 0.0):
                best[mark.task] = mark
        return best

    @property
    def points(self) -> float:
        """The sum of the suggested points."""
        return sum(mark.suggested or 0.0 for mark in self.best().values())


@dataclass(frozen=True)
class Report:
    """The results for one submission or for a class."""

    submissions: Sequence[Submission]
    sheet: str

    @property
    def findings(self) -> list[Finding]:
        return [mark.finding for one in self.submissions for mark in one.marks]

    @property
    def passed(self) -> bool:
        return all(finding.passed for finding in self.findings)

    @property
    def exit_code(self) -> int:
        """0 if everything is right, 1 if something is wrong or missing, 2 if something cannot be read."""
        return max((finding.exit_code for finding in self.findings), default=0)

    def without_solution(self) -> Report:
        """The report without values and formulas of the solution."""
        hidden = [
            replace(one, marks=[replace(mark, finding=mark.finding.without_solution()) for mark in one.marks])
            for one in self.submissions
        ]
        return replace(self, submissions=hidden)

    def rows(self) -> list[tuple[str, ...]]:
        """One row per file: submission, task, file, result, points, probable mistake."""
        rows: list[tuple[str, ...]] = []
        for one in self.submissions:
            for mark in one.marks:
                finding = mark.finding
                given = "-" if mark.suggested is None else f"{mark.suggested:g}"
                unjudged = finding.facts[0] if finding.status in (ERROR, BY_HAND) and finding.facts else ""
                why = "; ".join(filter(None, [finding.cause or unjudged, finding.remark]))
                points = f"{given} / {mark.points:g}" if mark.points else ""
                rows.append((one.name, mark.task, finding.name, finding.status, points, why))
            total = sum(mark.points for mark in one.best().values())
            rows.append((one.name, "suggested", "", "", f"{one.points:g} / {total:g}", ""))
            rows += [(one.name, "", name, "not checked", "", "matches no task") for name in one.others]
        return rows

    def as_dict(self) -> dict[str, Any]:
        return {
            "sheet": self.sheet,
            "passed": self.passed,
            "submissions": [
                {
                    "name": one.name,
                    "suggested": one.points,
                    "tasks": [
                        {"task": m.task, "points": m.points, "suggested": m.suggested, **m.finding.as_dict()}
                        for m in one.marks
                    ],
                    "not judged": list(one.others),
                }
                for one in self.submissions
            ],
        }


def junit(submissions: Sequence[Submission]) -> str:
    """JUnit XML with one suite per submission and one case per file."""
    root = xml.Element("testsuites", {"name": "gonio check", **_counts([m for one in submissions for m in one.marks])})
    for one in submissions:
        suite = xml.SubElement(root, "testsuite", {"name": clean(one.name), **_counts(one.marks)})
        for mark in one.marks:
            finding = mark.finding
            name = clean(finding.name or mark.task)
            case = xml.SubElement(suite, "testcase", classname=clean(f"{one.name}.{mark.task}".strip(".")), name=name)
            text = clean("\n".join(finding.lines()))
            if finding.status in (WRONG, ERROR):
                kind = "failure" if finding.status == WRONG else "error"
                message = clean(finding.cause or next(iter(finding.facts), finding.status))
                xml.SubElement(case, kind, message=message, type=finding.status).text = text
            elif finding.status in (MISSING, BY_HAND):
                xml.SubElement(case, "skipped", message=finding.status)
            else:
                xml.SubElement(case, "system-out").text = text
    xml.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + xml.tostring(root, encoding="unicode") + "\n"


def _counts(marks: Sequence[Mark]) -> dict[str, str]:
    statuses = [mark.finding.status for mark in marks]
    return {
        "tests": str(len(statuses)),
        "failures": str(statuses.count(WRONG)),
        "errors": str(statuses.count(ERROR)),
        "skipped": str(statuses.count(MISSING) + statuses.count(BY_HAND)),
    }
