"""Write docs/report-cards/: the verdicts on all Gonio models and all BSDF plugins of Mitsuba.

    python docs/make_report_cards.py [--effort quick|default] [--only NAME,...] [--seed 1]

The folder contains one page per material, README.md with all failures in order of severity, cards.json with all
measured values and, in programs/, a program for each failure of a Mitsuba plugin. The programs need only Mitsuba.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
import shutil
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gonio as go
from gonio.bridge import foreign
from gonio.verify import Report, verify
from gonio.verify.laws import laws
from gonio.verify.severity import Grade, percent
from gonio.verify.targets import resolve
from gonio.verify.verdict import DECLARED, FAIL, NOT_APPLICABLE, PASS, Verdict

FOLDER = Path(__file__).parent / "report-cards"
PROGRAMS = FOLDER / "programs"
MARKS = {PASS: "pass", FAIL: "**fail**", DECLARED: "declared", NOT_APPLICABLE: "-"}
FURNACE = re.compile(r"(loss|gain) in a white furnace: (.*)")
SHORT = [name for name, law in laws().items() if not law.on_request]

# settings to test in addition to the defaults
SETTINGS = {
    "mitsuba:roughconductor": [["distribution=ggx"]],
    "mitsuba:roughdielectric": [["distribution=ggx"]],
    "mitsuba:roughplastic": [["distribution=ggx"]],
}

# worst first: grades that bias pictures, then those that do not, then failures for which the material is not at fault
ORDER = [
    *(Grade.BROKEN, Grade.VISIBLE, Grade.SMALL, Grade.INVISIBLE, Grade.NAN),
    *(Grade.NOISE, Grade.FITTING, Grade.INTERFACE, Grade.INNER, Grade.BY_NATURE),
]

# issues and pull requests in Mitsuba's repositories about the failure or a related one
UPSTREAM = {
    ("principled", "calls"): "mitsuba3 #1951 (merged 2026-09-07, not yet released) names the components",
    ("principledthin", "calls"): "mitsuba3 #1951 (merged 2026-09-07, not yet released) names the components",
    ("principled", "energy"): "mitsuba3 #465 (closed) concerns energy that is lost in transmission",
    ("blendbsdf", "calls"): "mitsuba2 #151 (open): the component is always 0",
    ("blendbsdf", "positivity"): "mitsuba3 #1681 (merged 2025) fixed the pdf and the null lobes",
    ("roughplastic", "positivity"): "mitsuba2 #32 (open): NaN where the cosine is 0",
    ("roughplastic", "energy"): "mitsuba3 #1155 (closed) concerns energy that is lost at high roughness",
    ("hair", "pdf"): "mitsuba3 #871 (merged 2023): Mitsuba's own chi-square test of hair covers few parameters",
}

EXPLANATION = """
- *pass*: the law holds within its tolerance, at the given parameter values and at the other values listed on the
  material's card. *declared*: the model declares that it violates the law, and declares the size of the violation.
  *-*: the law does not apply; the card gives the reason.
- A failure is listed with its grade. Four grades measure the error of the reflected light: *invisible* (less than 0.1 %
  on average and less than 1 % at worst), *small* (less than 1 % and 10 %), *visible* (less than 10 % and 50 %) and
  *broken* (larger errors). The other grades state the kind of failure: *NaN* (some values are not finite), *noise*
  (samples are wasted, but nothing is biased), *interface* (the failure occurs only in calls that a plain path tracer
  does not make), *inner* (a nested material fails; with a correct one, the law holds) and *by nature* (no BSDF of this
  kind can obey the law).
- Mitsuba's plugins are evaluated in float32 and tested with wider tolerances. The laws `gradients` and `precision` need
  double precision and are therefore not tested for these plugins.
- For Mitsuba's plugins, a sample of weight 0 counts as failed, as in Mitsuba's own chi-square test.
- Composite BSDFs are tested with simple nested materials: `blendbsdf` blends `diffuse` and `roughconductor`; `mask`,
  `bumpmap` and `normalmap` contain `diffuse`; `twosided` contains `roughconductor`. `bumpmap` is tested on a uniform
  slope: a BSDF with a tilted shading normal is neither isotropic nor reciprocal with respect to the geometric normal.
  `hair` is defined relative to a fiber, not to a surface normal.
- Directions are given as theta, phi in degrees.
- Mitsuba's microfacet plugins use Beckmann's distribution by default; GGX is also tested.
"""

BLIND = """
## What this report does not cover

The tests use one point of an untextured surface (uv = 0.5, 0.5), unpolarized light in three color channels, and only
the parameter values listed. Violations below the tolerances are not detected. Integrators and interreflection between
surfaces are not tested. Whether a formula is the right one for the material is not tested either: many wrong formulas
obey the laws.
"""


def targets() -> list[str]:
    """Every model and every plugin."""
    return [*go.models(), *(f"mitsuba:{name}" for name in foreign.plugins())]


def trials(target: str) -> list[Any]:
    """The subjects of a target: its defaults and other settings."""
    return [one for settings in ([], *SETTINGS.get(target, [])) for one in resolve(target, settings)]


def losses(report: Report) -> dict[str, str]:
    """The loss or gain in the white furnace, per setting."""
    notes_of = {card.title: [FURNACE.match(note) for note in card["energy"].notes] for card in report.cards}
    first = {title: next(filter(None, matches), None) for title, matches in notes_of.items()}
    return {title: f"{match[1]} of {match[2]}" for title, match in first.items() if match}


def summary(report: Report, law: str) -> str:
    """A table cell: the worst verdict on a law over all settings."""
    verdicts = [card[law] for card in report.cards]
    failed = sorted((v for v in verdicts if v.failed), key=_rank)
    if failed:
        return f"**{failed[0].grade or 'fails'}**"
    statuses = {v.status for v in verdicts}
    return next(MARKS[status] for status in (DECLARED, PASS, NOT_APPLICABLE) if status in statuses)


def _rank(verdict: Verdict) -> tuple[int, float]:
    average = -verdict.bias.average if verdict.bias else 0.0
    return (ORDER.index(verdict.grade) if verdict.grade in ORDER else len(ORDER), average)


def shows(program: str) -> bool:
    """Whether a program ends with an AssertionError, in a process that cannot import Gonio."""
    command = [sys.executable, "-c", "import sys; sys.modules['gonio'] = None; exec(sys.stdin.read())"]
    done = subprocess.run(command, input=program, capture_output=True, text=True, timeout=120)
    return "AssertionError" in done.stderr


def findings(target: str, report: Report) -> list[dict[str, Any]]:
    """All failures. Writes a program for each failure that can be reproduced without Gonio."""
    failures = []
    for card in report.cards:
        for v in card.verdicts:
            if not v.failed:
                continue
            if v.reproduction and not shows(v.reproduction):
                v.reproduction = ""  # it draws too few of the random numbers for which the law fails
            name = "-".join([target.removeprefix("mitsuba:"), *map(str, card.subject.settings.values()), v.law])
            if v.reproduction:
                PROGRAMS.mkdir(exist_ok=True)
                about = f"# {card.title}: {v.law}. Mitsuba {version('mitsuba')}, {datetime.date.today()}.\n"
                (PROGRAMS / f"{name}.py").write_text(about + v.reproduction)
            failures.append(
                {
                    "rank": _rank(v),
                    "grade": str(v.grade or "ungraded"),
                    "title": card.title,
                    "target": target,
                    "law": v.law,
                    "size": _size(v),
                    "cause": v.cause or "unknown",
                    "upstream": UPSTREAM.get((target.removeprefix("mitsuba:"), v.law), ""),
                    "program": f"programs/{name}.py" if v.reproduction else "",
                }
            )
    return failures


def _size(v: Verdict) -> str:
    if v.bias is None:
        return v.shown
    if v.bias.kind in ("bias", "lost", "gained"):
        verb = {"bias": "wrong by", "lost": "loses", "gained": "gains"}[v.bias.kind]
        return f"{verb} {percent(v.bias.average)} on average, {percent(v.bias.worst)} at worst"
    if v.bias.kind == "interface":
        return _clean("; ".join(why for why in v.why if "is allowed" not in why))
    return _clean(v.bias.where)


def page(target: str, report: Report) -> str:
    """The page for one target."""
    made = f"Mitsuba {version('mitsuba')}, " if ":" in target else ""
    lines = [
        f"# {target}",
        "",
        f"This page lists the results of `gonio verify` ({made}Gonio {go.__version__}, {datetime.date.today()}, "
        f"{report.effort} effort, seed {report.seed}). The report includes {report.tests} statistical tests, each at a "
        f"significance level of {report.threshold:.1e} (0.01 overall, Sidak correction). A rejection counts only if a "
        "test with a second seed confirms it. Directions are given as theta, phi in degrees.",
    ]
    for card in report.cards:
        lines += [
            "",
            f"## {card.title}",
            "",
            "| law | verdict | measured | allowed | remark |",
            "|---|---|---|---|---|",
        ]
        for v in card.verdicts:
            allowed = (
                ""
                if v.tolerance is None or v.tolerance == float("inf")
                else f"{v.tolerance:.0e}"
                if v.tolerance
                else "0"
            )
            grade = f" ({v.grade})" if v.failed and v.grade else ""
            lines.append(f"| {v.law} | {MARKS[v.status]}{grade} | {v.shown} | {allowed} | {_remark(v)} |")
        lines += ["", f"The material was {card.covered}."]
        if card.quality is not None:
            lines += ["", card.quality.words.capitalize() + "."]
        for v in sorted((v for v in card.verdicts if v.failed), key=_rank):
            lines += ["", f"**{v.law}**: {'; '.join(_clean(w) for w in v.why)}."]
            if v.bias is not None:
                lines += [f"Effect on a picture: {_clean(v.bias.words)}."]
            lines += [f"Cause: {_ended(_clean(v.cause) or 'unknown')}", "", f"    {v.command}"]
            if v.reproduction:
                lines += ["", "```python", v.reproduction.rstrip(), "```"]
    return "\n".join(lines) + "\n" + BLIND


def _remark(v: Verdict) -> str:
    if v.status == NOT_APPLICABLE:
        return _clean("; ".join(v.why))
    return _clean("; ".join([*v.notes, *([f"worst case: {v.worst.replace(': ', ', ', 1)}"] if v.worst else [])]))


def _number(text: str) -> str:
    """The number in the description of a measure of sampling quality: "0.35 %", "2.9"; "" if there is none."""
    return "".join(re.findall(r"[0-9.]+(?: %)?", text)[:1])


def _ended(text: str) -> str:
    """The text with a period, unless it is a question."""
    return text if text.endswith("?") else f"{text}."


def _clean(text: str) -> str:
    return text.replace("|", "/").replace(str(Path.cwd()), ".")


def _untested(target: str, reason: str) -> str:
    """The text of the page for a target that cannot be created."""
    *_, message = reason.rpartition("Mitsuba rejects it: ")
    why = f"`{target}` was not tested, because it cannot be created without parameters."
    return f"{why} The error message is: {message}"


def main() -> int:
    """Write all pages; returns the exit code, 0 regardless of the verdicts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", default="default", choices=("quick", "default"))
    parser.add_argument("--only", default="")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chosen = options.only.split(",") if options.only else targets()
    FOLDER.mkdir(exist_ok=True)
    stored = FOLDER / "cards.json"
    results: dict[str, Any] = json.loads(stored.read_text()) if options.only and stored.exists() else {}
    if not options.only:
        shutil.rmtree(PROGRAMS, ignore_errors=True)
    started = time.perf_counter()
    for target in chosen:
        name = target.replace(":", "-")
        began = time.perf_counter()
        try:
            report = verify(trials(target), quick=options.effort == "quick", seed=options.seed)
        except go.GonioError as error:
            reason = " ".join(str(error).split())
            results[target] = {"not judged": reason}
            (FOLDER / f"{name}.md").write_text(f"# {target}\n\n{_untested(target, reason)}\n")
            continue
        found = findings(target, report)  # drops programs that show nothing
        (FOLDER / f"{name}.md").write_text(page(target, report))
        results[target] = {
            "laws": {law: summary(report, law) for law in SHORT},
            "worst": {law: report[law].shown for law in SHORT},
            "losses": losses(report),
            "settings": [card.title for card in report.cards],
            "findings": found,
            "quality": {card.title: card.quality.texts if card.quality else None for card in report.cards},
        }
        print(f"{target}: {time.perf_counter() - began:.1f} s", flush=True)
    stored.write_text(json.dumps(dict(sorted(results.items())), indent=1) + "\n")
    (FOLDER / "README.md").write_text(overview(results, options.effort, options.seed))
    print(f"all: {time.perf_counter() - started:.0f} s")
    return 0


def overview(results: dict[str, Any], effort: str, seed: int) -> str:
    """All failures, worst first, and the tables of all targets."""
    renderers = f"Gonio {go.__version__} and Mitsuba {version('mitsuba')} (llvm_ad_rgb), {datetime.date.today()}"
    ordered = sorted(results.items(), key=lambda item: (":" in item[0], item[0]))
    lines = [
        "# Report cards",
        "",
        f"This page summarizes the results of `gonio verify` for {renderers}, {effort} effort, seed {seed}.",
        "It is generated by `python docs/make_report_cards.py`. The tables give the worst verdict on each law over all",
        "settings of a target. Engine shaders have [their own report cards](engines/README.md).",
        "",
        *EXPLANATION.strip().splitlines(),
        "",
        "## Failures, worst first",
        "",
        "Percentages refer to the reflected light. The programs need only Mitsuba; as long as a defect exists, its",
        "program ends with an AssertionError that states the measured value.",
        "",
        "| grade | BSDF | law | effect | probable cause | upstream issue | program |",
        "|---|---|---|---|---|---|---|",
    ]
    failures = [one for _, result in ordered for one in result.get("findings", [])]
    for one in sorted(failures, key=lambda one: tuple(one["rank"])):
        link = f"[{one['title'].removeprefix('mitsuba:')}]({one['target'].replace(':', '-')}.md)"
        program = f"[program]({one['program']})" if one["program"] else ""
        cells = one["grade"], link, one["law"], one["size"], _clean(one["cause"]), one["upstream"], program
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "## All laws",
        "",
        "| target | " + " | ".join(SHORT) + " |",
        "|---" * (len(SHORT) + 1) + "|",
    ]
    for target, result in ordered:
        link = f"[{target}]({target.replace(':', '-')}.md)"
        if "not judged" in result:
            lines.append(f"| {link} | not tested |" + " |" * (len(SHORT) - 1))
        else:
            lines.append(f"| {link} | " + " | ".join(result["laws"][law] for law in SHORT) + " |")
    lines += [
        "",
        "## Sampling quality",
        "",
        "These values are measurements, not verdicts; they differ even between materials that obey all laws. Each",
        "value is a mean over directions wo. The last two columns give the efficiency relative to cosine sampling and",
        "to ideal sampling, which has no variance.",
        "",
        "| target and setting | failed samples | relative variance of the weights | relative to cosine sampling "
        "| relative to ideal sampling |",
        "|---|---|---|---|---|",
    ]
    for _, result in ordered:
        for setting, texts in result.get("quality", {}).items():
            if texts:
                lines.append(f"| {setting} | {' | '.join(map(_number, texts))} |")
    lines += [
        "",
        "## White furnace",
        "",
        "For this test, every albedo and, if possible, F is set to 1, so that nothing is absorbed. The table gives the",
        "loss or gain of energy: its cosine-weighted average over the hemisphere of wo, and its extreme value.",
        "",
        "| target and setting | loss or gain |",
        "|---|---|",
    ]
    for _, result in ordered:
        for setting, text in result.get("losses", {}).items():
            lines.append(f"| {setting} | {text} |")
    return "\n".join(lines) + "\n" + BLIND


if __name__ == "__main__":
    sys.exit(main())
