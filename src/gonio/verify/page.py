"""The files of a report: report.json, and a self-contained report.html with figures.

The page needs neither a network connection nor scripts: its figures are inline SVG, and its colors follow the light or
dark setting of the browser.
"""

from __future__ import annotations

import base64
import html
import json
from pathlib import Path

from .. import files
from .forensics import diagnosis
from .report import Report
from .verdict import DECLARED, FAIL, KNOWN, NOT_APPLICABLE, NOT_TRIED, PASS, TOLERATED, Card, Verdict

CLASSES = {
    PASS: "pass",
    FAIL: "fail",
    DECLARED: "declared",
    KNOWN: "declared",
    TOLERATED: "declared",
    NOT_APPLICABLE: "none",
    NOT_TRIED: "declared",
}

STYLE = """
:root { --ink: #1d2530; --soft: #5c6876; --paper: #fbfaf7; --card: #fff; --line: #e4e1da; --accent: #2b5d8a;
  --pass: #2e7d4f; --fail: #b3261e; --declared: #9a6b00; --none: #8a929c; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8eb; --soft: #9aa5b1; --paper: #14181d; --card: #1b2127;
  --line: #2c343d; --accent: #7fb2e0; --pass: #6cc28f; --fail: #f0857d; --declared: #e0b04c; --none: #77818c; }
  figure img { background: #fbfaf7; border-radius: 6px; } }
* { box-sizing: border-box }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", sans-serif; }
main { max-width: 1040px; margin: 0 auto; padding: 40px 24px 80px; }
h1 { font-size: 30px; font-weight: 650; margin: 0; letter-spacing: -.01em }
h2 { font-size: 22px; margin: 56px 0 8px; font-weight: 650 }
h3 { font-size: 17px; margin: 0; font-weight: 620 }
p { margin: 6px 0 } .soft { color: var(--soft) } code, pre { font: 13px/1.5 ui-monospace, Menlo, Consolas, monospace; }
pre { margin: 6px 0; padding: 8px 12px; background: color-mix(in srgb, var(--line) 45%, transparent);
  border-radius: 6px; overflow-x: auto; user-select: all }
.verdict { font-size: 13px; font-weight: 650; color: var(--card); border-radius: 999px; padding: 2px 11px;
  white-space: nowrap }
.pass { background: var(--pass) } .fail { background: var(--fail) } .declared { background: var(--declared) }
.none { background: var(--none) }
table { width: 100%; border-collapse: collapse; margin: 14px 0; font-size: 15px }
th { text-align: left; font-weight: 550; color: var(--soft); font-size: 13px }
td, th { padding: 7px 12px 7px 0; border-bottom: 1px solid var(--line); vertical-align: top }
td:nth-child(1) { color: var(--soft); width: 28px; font-variant-numeric: tabular-nums }
td a { color: inherit; text-decoration-color: var(--line); text-underline-offset: 3px }
section { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 18px 22px;
  margin: 16px 0 }
section header { display: flex; justify-content: space-between; gap: 16px; align-items: baseline }
dl { display: grid; grid-template-columns: 96px 1fr; gap: 3px 14px; margin: 10px 0 0; font-size: 15px }
dt { color: var(--soft) } dd { margin: 0; min-width: 0 } figure { margin: 16px 0 0 }
figure img { max-width: 100%; height: auto }
figcaption { font-size: 13.5px; color: var(--soft); margin-top: 4px }
"""


def write(report: Report, folder: Path) -> Path:
    """Write report.json and report.html into a folder, both or neither. Returns the path of the page."""
    contents = {"report.json": json.dumps(report.as_dict(), indent=2) + "\n", "report.html": page(report)}
    files.write_all(files.check_folder(folder), {name: text.encode() for name, text in contents.items()})
    return folder / "report.html"


def page(report: Report) -> str:
    """The HTML of the page."""
    title = report.cards[0].subject.target if report.cards else "nothing"
    broken = len(report.failures)
    word = "All laws hold" if not broken else f"{broken} {'law is' if broken == 1 else 'laws are'} violated"
    kind = "pass" if not broken else "fail"
    if report.untried:
        word = f"{word if broken else 'No law is violated'}; not tried: {', '.join(report.untried)}"
        kind = kind if broken else "declared"
    tests = (
        f"The report includes {report.tests} statistical tests, each at a significance level of {report.threshold:.2e} "
        "(0.01 overall, Sidak correction). A rejection counts only if a test with a second seed confirms it."
        if report.tests
        else "The report includes no statistical tests."
    )
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8>",
        "<meta name=viewport content='width=device-width, initial-scale=1'>",
        f"<title>{html.escape(title)}: report card</title><style>{STYLE}</style><main>",
        f"<header><h1>{html.escape(title)} <span class='verdict {kind}'>{word}</span></h1>",
        f"<p class=soft>Report card by Gonio: effort {report.effort}, seed {report.seed}, {report.seconds:.1f} s. ",
        f"{tests}</p>",
        "</header>",
    ]
    if len(report.cards) > 1:
        parts.append(_overview(report))
    for number, card in enumerate(report.cards):
        parts.append(_card(card, number))
    parts.append("</main></html>\n")
    return "".join(parts)


def _pill(verdict: Verdict) -> str:
    grade = f": {verdict.grade}" if verdict.grade else ""
    return f"<span class='verdict {CLASSES[verdict.status]}'>{verdict.status}{grade}</span>"


def _overview(report: Report) -> str:
    """The verdicts of all laws (rows) for all cards (columns)."""
    heads = "".join(f"<th>{html.escape(_settings(card))}" for card in report.cards)
    rows = []
    for i, verdict in enumerate(report.cards[0].verdicts):
        cells = "".join(f"<td>{_pill(card.verdicts[i])}" for card in report.cards)
        rows.append(f"<tr><td>{verdict.number}<td>{verdict.law}{cells}")
    return f"<table><tr><th><th>{heads}{''.join(rows)}</table>"


def _settings(card: Card) -> str:
    return card.title.partition(", ")[2] or "defaults"


def _card(card: Card, number: int) -> str:
    rows, details = [], []
    failed = "".join(_detail(v, f"c{number}-{v.law}") for v in diagnosis.in_order(card.verdicts))
    for v in card.verdicts:
        anchor = f"c{number}-{v.law}"
        figure = html.escape(v.shown if v.figure is not None else "; ".join(v.why))
        allowed = f"{v.tolerance:.0e}" if v.tolerance else "0" if v.tolerance == 0 else ""
        allowed = "" if v.tolerance is not None and v.tolerance == float("inf") else allowed
        rows.append(f"<tr><td>{v.number}<td><a href='#{anchor}'>{v.law}</a><td>{_pill(v)}<td>{figure}<td>{allowed}")
        if v.status != NOT_APPLICABLE and not v.failed:
            details.append(_detail(v, anchor))
    below = [*filter(None, [card.covered]), *card.notes, *([card.quality.words] if card.quality else [])]
    lines = "".join(f"<p class=soft>{html.escape(line)}</p>" for line in below)
    return (
        f"<h2>{html.escape(card.title)}</h2>{failed}"
        f"<table><tr><th><th>law<th>verdict<th>measured<th>allowed{''.join(rows)}</table>{lines}{''.join(details)}"
    )


def _detail(v: Verdict, anchor: str) -> str:
    rows: list[tuple[str, str]] = [("reason", html.escape(line)) for line in v.why]
    rows.append(("measured", html.escape(v.shown)))
    rows.append(("tolerance", html.escape(v.reason)))
    if v.p is not None:
        rows.append(("lowest p-value", f"{v.p:.3g}"))
    rows += [("note", html.escape(note)) for note in v.notes]
    if v.worst:
        rows.append(("worst case", html.escape(v.worst)))
    rows.append(("reproduce", f"<pre>{html.escape(v.command)}</pre>"))
    if v.failed or v.excused or v.status == DECLARED:
        rows.append(("effect", html.escape(f"{v.bias.words[:1].upper()}{v.bias.words[1:]}" if v.bias else v.meaning)))
        if v.bias:
            rows.append(("consequence", html.escape(v.meaning)))
    if v.cause_in_words:
        rows.append(("cause", html.escape(v.cause_in_words)))
    if v.reproduction:
        program = f"<summary>program that needs only Mitsuba</summary><pre>{html.escape(v.reproduction)}</pre>"
        rows.append(("without Gonio", f"<details>{program}</details>"))
    text = "".join(f"<dt>{name}<dd>{value}" for name, value in rows)
    drawn = ""
    if v.evidence is not None:
        svg, caption = v.evidence.draw()
        source = base64.b64encode(svg.encode()).decode()
        image = f"<img alt='{html.escape(caption)}' src='data:image/svg+xml;base64,{source}'>"
        drawn = f"<figure>{image}<figcaption>{html.escape(caption)}</figcaption></figure>"
    head = f"<header><h3>{v.number}. {html.escape(v.title)}</h3>{_pill(v)}</header>"
    return f"<section id='{anchor}'>{head}<dl>{text}</dl>{drawn}</section>"


__all__ = ["page", "write"]
