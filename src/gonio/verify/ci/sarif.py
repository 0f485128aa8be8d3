"""SARIF 2.1.0, the standard format of static checkers: one rule per law, one result per violation."""

from __future__ import annotations

import hashlib
import json
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote

from ..._version import __version__
from ..report import Report
from ..verdict import DECLARED, KNOWN, Card, Unread, Verdict
from . import places

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def text(report: Report) -> str:
    """The content of the file for a report."""
    laws = {verdict.law: verdict for card in report.cards for verdict in card.verdicts}
    rules = [_rule(verdict) for verdict in laws.values()]
    if report.unread:
        rules += [{"id": "gonio/read", "name": "Read", "shortDescription": {"text": "the shader can be read"}}]
    order = {name: index for index, name in enumerate(laws)}
    run = {
        "tool": {"driver": {"name": "Gonio", "version": __version__, "rules": rules}},
        "invocations": [{"executionSuccessful": not report.unread, "exitCode": report.exit_code}],
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(card, verdict, order[verdict.law])
            for card in report.cards
            for verdict in card.verdicts
            if verdict.failed or verdict.excused or verdict.status == DECLARED
        ]
        + [_unread(one, len(laws)) for one in report.unread],
        "properties": {"seed": report.seed, "effort": report.effort, "tests": report.tests},
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2) + "\n"


def _rule(verdict: Verdict) -> dict[str, Any]:
    rule: dict[str, Any] = {
        "id": f"gonio/{verdict.law}",
        "name": "".join(part.capitalize() for part in verdict.law.split("-")),
        "shortDescription": {"text": verdict.title},
        "defaultConfiguration": {"level": "error"},
    }
    if verdict.meaning:
        rule["fullDescription"] = {"text": verdict.meaning}
    return rule


def _unread(one: Unread, rule: int) -> dict[str, Any]:
    location: dict[str, Any] = {"logicalLocations": [{"name": one.target, "kind": "type"}]}
    place = places.of_unread(one)
    if place is not None:
        location["physicalLocation"] = _physical(place)
    key = hashlib.sha256(f"{one.target}\nread".encode()).hexdigest()
    return {
        "ruleId": "gonio/read",
        "ruleIndex": rule,
        "level": "error",
        "message": {"text": f"{one.target}: not read\n{one.words()}"},
        "locations": [location],
        "partialFingerprints": {"titleAndLaw/v1": key},
    }


def _physical(place: places.Place) -> dict[str, Any]:
    prefix = "file://" if PurePosixPath(place.file).is_absolute() else ""
    return {"artifactLocation": {"uri": prefix + quote(place.file)}, "region": {"startLine": place.line}}


def _result(card: Card, verdict: Verdict, rule: int) -> dict[str, Any]:
    location: dict[str, Any] = {
        "logicalLocations": [{"name": card.title, "fullyQualifiedName": card.subject.target, "kind": "type"}]
    }
    place = places.of(card, verdict)
    if place is not None:
        location["physicalLocation"] = _physical(place)
    key = hashlib.sha256(f"{card.title}\n{verdict.law}".encode()).hexdigest()
    facts = {
        "status": verdict.status,
        "figure": verdict.as_dict()["figure"],  # null if it is not a number
        "tolerance": verdict.as_dict()["tolerance"],
        "p": verdict.as_dict()["p"],
        "command": verdict.command,
        "grade": places.grade(verdict),
        "cause": places.cause(verdict),
    }
    result: dict[str, Any] = {
        "ruleId": f"gonio/{verdict.law}",
        "ruleIndex": rule,
        "level": places.level(verdict),
        "message": {"text": "\n".join([f"{card.title}: {verdict.title}: {verdict.status}", *places.words(verdict)])},
        "locations": [location],
        "partialFingerprints": {"titleAndLaw/v1": key},
        "properties": {name: value for name, value in facts.items() if value not in ("", None)},
    }
    if verdict.status == KNOWN:
        result["baselineState"] = "unchanged"
        result["suppressions"] = [{"kind": "external", "justification": "known from the baseline"}]
    elif verdict.excused:
        result["suppressions"] = [{"kind": "external", "justification": "tolerated: its effect on pictures is small"}]
    elif verdict.status == DECLARED:
        result["suppressions"] = [{"kind": "inSource", "justification": "the BSDF declares it"}]
    return result


__all__ = ["text"]
