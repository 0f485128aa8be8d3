"""Write docs/report-cards/: the verdicts on every Gonio model and every BSDF plugin of Mitsuba.

    python docs/make_report_cards.py [--effort quick|default] [--only NAME,...] [--seed 1]

One page per material, README.md with all failures in order of severity, cards.json with all measured values, and in
programs/, for each failure of a Mitsuba plugin, a program that needs only Mitsuba.
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
MARKS = {PASS: "pass", FAIL: "**fails**", DECLARED: "declared", NOT_APPLICABLE: "-"}
FURNACE = re.compile(r"(loss|gain) in a white furnace: (.*)")
SHORT = [name for name, law in laws().items() if not law.on_request]

# settings that the verifier would not try by itself, in addition to the defaults
SETTINGS = {
    "mitsuba:roughconductor": [["distribution=ggx"]],
    "mitsuba:roughdielectric": [["distribution=ggx"]],
    "mitsuba:roughplastic": [["distribution=ggx"]],
}

# worst first: grades that bias pictures, then those that bias none, then those of other materials
ORDER = [
    *(Grade.BROKEN, Grade.VISIBLE, Grade.SMALL, Grade.INVISIBLE, Grade.NAN),
    *(Grade.NOISE, Grade.FITTING, Grade.INTERFACE, Grade.INNER, Grade.BY_NATURE),
]

# issues and pull requests in Mitsuba's repositories about the failure or a related one
UPSTREAM = {
    ("principled", "calls"): "mitsuba3 #1951 (merged 2026-09-07, not yet released) names the components",
    ("principledthin", "calls"): "mitsuba3 #1951 (merged 2026-09-07, not yet released) names the components",
    ("principled", "energy"): "mitsuba3 #465 (closed) is about the energy that its transmission loses",
    ("blendbsdf", "calls"): "mitsuba2 #151 (open): the component is always 0",
    ("blendbsdf", "positivity"): "mitsuba3 #1681 (merged 2025) fixed its pdf and null lobes",
    ("roughplastic", "positivity"): "mitsuba2 #32 (open): NaN where the cosine is 0",
    ("roughplastic", "energy"): "mitsuba3 #1155 (closed) is about the energy that it loses when rough",
    ("hair", "pdf"): "mitsuba3 #871 (merged 2023): Mitsuba's own chi-square test of hair covers few parameters",
}

EXPLANATION = """
- *pass*: the law holds within its tolerance, at the given parameter values and at the others listed on the material's
  card. *declared*: the model declares that it violates the law, and by how much. *-*: the law does not apply; the card
  gives the reason.
- A failure is shown by its grade. Four grades state the error of the reflected light: *invisible* (less than 0.1 % on
  average and 1 % at worst), *small* (1 %, 10 %), *visible* (10 %, 50 %) and *broken* (more). The others state its kind:
  *NaN* (values that are not finite), *noise* (samples are wasted, without bias), *interface* (the failure occurs only
  in calls that a plain path tracer does not make), *inner* (the failure is that of a nested material; with a correct
  one, the law holds) and *by nature* (no BSDF of this kind can obey the law).
- Mitsuba's plugins are evaluated in float32, and tested with wider tolerances. `gradients` and `precision` need a
  64-bit reference, so they are not tested.
- A sample of weight 0 counts as failed, as in Mitsuba's own chi-square test.
- Composite BSDFs are tested with simple nested materials: `blendbsdf` blends `diffuse` and `roughconductor`; `mask`,
  `bumpmap` and `normalmap` contain `diffuse`; `twosided` contains `roughconductor`. `bumpmap` is tested on a uniform
  slope: a BSDF with a tilted shading normal is neither isotropic nor reciprocal with respect to the geometric normal.
  `hair` is defined relative to a fiber, not to a surface normal.
- Directions are given as theta, phi in degrees.
- Mitsuba's microfacet plugins use Beckmann's distribution by default; GGX is tested too.
"""

BLIND = """
## What this report does not cover

The tests cover one point of an untextured surface (uv = 0.5, 0.5), unpolarized light in three channels, and only the
parameter values listed. Violations below the tolerances are not detected. The tests cover neither integrators, nor
interreflection between surfaces, nor whether the formula is correct for the material: many wrong formulas obey the
laws.
"""


def targets() -> list[str]:
    """Every model and every plugin."""
    return [*go.models(), *(f"mitsuba:{name}" for name in foreign.plugins())]


def trials(target: str) -> list[Any]:
    """The subjects of a target: its defaults and other settings."""
    return [one for settings in ([], *SETTINGS.get(target, [])) for one in resolve(target, settings)]


def losses(report: Report) -> dict[str, str]:
    """The loss or gain of the white furnace, per setting."""
    notes_of = {card.title: [FURNACE.match(note) for note in card["energy"].notes] for card in report.cards}
    first = {title: next(filter(None, matches), None) for title, matches in notes_of.items()}
    return {title: f"{match[1]} of {match[2]}" for title, match in first.items() if match}


def summary(report: Report, law: str) -> str:
    """One cell: the worst verdict of a law over all settings."""
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
    """All failures, and the programs that show them."""
    failures = []
    for card in report.cards:
        for v in card.verdicts:
            if not v.failed:
                continue
            if v.reproduction and not shows(v.reproduction):
                v.reproduction = ""  # it draws too few of the random numbers at which the law fails
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
    """The page of one target."""
    made = f"Mitsuba {version('mitsuba')}, " if ":" in target else ""
    lines = [
        f"# {target}",
        "",
        f"These are the results of `gonio verify` ({made}Gonio {go.__version__}, {datetime.date.today()}, "
        f"{report.effort} effort, seed {report.seed}), with {report.tests} statistical tests, each at a significance "
        f"level of {report.threshold:.1e} (0.01 overall, Sidak correction). A rejection counts only if a second seed "
        "confirms it.",
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
            allowed = "" if v.tolerance is None or v.tolerance == float("inf") else f"{v.tolerance:.0e}"
            grade = f": {v.grade}" if v.failed and v.grade else ""
            lines.append(f"| {v.law} | {MARKS[v.status]}{grade} | {v.shown} | {allowed} | {_remark(v)} |")
        lines += ["", card.covered[:1].upper() + card.covered[1:] + "."]
        if card.quality is not None:
            lines += ["", card.quality.words.capitalize() + "."]
        for v in sorted((v for v in card.verdicts if v.failed), key=_rank):
            lines += ["", f"**{v.law}**: {'; '.join(_clean(w) for w in v.why)}."]
            if v.bias is not None:
                lines += [f"Effect on a picture: {_clean(v.bias.words)}."]
            lines += [f"Cause: {_clean(v.cause) or 'unknown'}.", "", f"    {v.command}"]
            if v.reproduction:
                lines += ["", "```python", v.reproduction.rstrip(), "```"]
    return "\n".join(lines) + "\n" + BLIND


def _remark(v: Verdict) -> str:
    if v.status == NOT_APPLICABLE:
        return _clean("; ".join(v.why))
    return _clean("; ".join([*v.notes, *([f"worst case: {v.worst.replace(': ', ', ', 1)}"] if v.worst else [])]))


def _number(text: str) -> str:
    """The number in a description of a sampling quality: "0.35 %", "2.9"; "" if there is none."""
    return "".join(re.findall(r"[0-9.]+(?: %)?", text)[:1])


def _clean(text: str) -> str:
    return text.replace("|", "/").replace(str(Path.cwd()), ".")


def _untested(target: str, reason: str) -> str:
    """The text of a page for a target that cannot be created."""
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
        f"These are the results of `gonio verify` for {renderers}, {effort} effort, seed {seed}.",
        "The page is generated by `python docs/make_report_cards.py`. A cell gives the worst verdict over all settings",
        "of a target. The shaders of engines have [their own cards](engines/README.md).",
        "",
        *EXPLANATION.strip().splitlines(),
        "",
        "## Failures, worst first",
        "",
        "Percentages refer to the reflected light. Each program needs only Mitsuba; while the fault exists, it ends",
        "with an AssertionError that states the measured value.",
        "",
        "| grade | BSDF | law | effect | probable cause | known upstream | program |",
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
        "These values are not verdicts: materials that obey all laws may differ here. All are means over the",
        "hemisphere of wo. The last two columns give the efficiency relative to cosine sampling and to sampling",
        "without variance.",
        "",
        "| target, setting | failed samples | variance of the weight | relative to cosine sampling | of the ideal |",
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
        "Every albedo is 1 and, if it can be chosen, F = 1. The table gives the average over a hemisphere and the",
        "extreme.",
        "",
        "| target, setting | loss or gain |",
        "|---|---|",
    ]
    for _, result in ordered:
        for setting, text in result.get("losses", {}).items():
            lines.append(f"| {setting} | {text} |")
    return "\n".join(lines) + "\n" + BLIND


if __name__ == "__main__":
    sys.exit(main())
