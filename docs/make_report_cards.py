"""Write docs/report-cards/: what every Gonio model and every BSDF plugin of Mitsuba does under the laws.

    python docs/make_report_cards.py [--effort quick|default] [--only NAME,...] [--seed 1]

One page a material (README.md is the overview) and cards.json with every figure. Nothing here judges: a cell says which
law does not hold and by how much, and the command beside it shows it again.
"""

from __future__ import annotations

import argparse
import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gonio as go
from gonio.render import foreign
from gonio.verify import Report, verify
from gonio.verify.laws import laws
from gonio.verify.targets import resolve
from gonio.verify.verdict import DECLARED, FAIL, NOT_APPLICABLE, PASS, Verdict

FOLDER = Path(__file__).parent / "report-cards"
WIDTHS = "0.05,0.2,0.5,1"
MARKS = {PASS: "pass", FAIL: "**fails**", DECLARED: "declared", NOT_APPLICABLE: "-"}
SHORT = [name for name in laws() if name != "shader"]  # which the browser judges

# what is judged besides the defaults: roughness, and the distribution that a user of either renderer picks
SWEPT = {
    "conductor": [[], ["ndf=beckmann"]],
    "dielectric": [[], ["ndf=beckmann"]],
    "mitsuba:roughconductor": [[f"distribution={d}", "specular_reflectance=1"] for d in ("ggx", "beckmann")],
    "mitsuba:roughdielectric": [[f"distribution={d}", "specular_reflectance=1"] for d in ("ggx", "beckmann")],
    "mitsuba:roughplastic": [["distribution=ggx"], ["distribution=beckmann"]],
    "mitsuba:principled": [["roughness=0.2"], ["roughness=0.5"], ["roughness=0.5", "metallic=1"]],
}

EXPLANATION = """
- *pass*: the law holds within its tolerance. *declared*: the model states that it breaks the law, and how far.
- **fails** 2/9: the law does not hold for 2 of 9 settings; the page gives each figure and a command that shows it.
- *-*: the law does not apply; the page says why. Mitsuba's plugins are float32, with wider tolerances, and have no
  64-bit twin for `gradients` and `precision`.
- A sample of weight 0 counts as failed, as in Mitsuba's own chi-square test.
- BSDFs of BSDFs are judged with plain ones inside: blendbsdf = diffuse + roughconductor, mask, bumpmap and normalmap
  over diffuse, twosided over roughconductor. bumpmap is a uniform slope: a turned normal is by nature neither
  isotropic nor reciprocal about the geometric one. hair is defined about a fibre, not about a surface's normal.
- Mitsuba's microfacet plugins take Beckmann's distribution by default.
"""


def targets() -> list[str]:
    """Every model and every plugin."""
    return [*go.models(), *(f"mitsuba:{name}" for name in foreign.plugins())]


def trials(target: str) -> list[Any]:
    """The subjects of a target: its defaults, and its sweeps."""
    found = resolve(target)
    for settings in SWEPT.get(target, []):
        sweep = f"alpha={WIDTHS}" if "principled" not in target else ""
        found += resolve(target, settings, sweep)
    return found


def losses(report: Report) -> dict[str, str]:
    """What the white furnace loses, setting by setting."""
    words = "white furnace loses "
    found = {card.title: [n for n in card["energy"].notes if n.startswith(words)] for card in report.cards}
    return {title: notes[0].removeprefix(words) for title, notes in found.items() if notes}


def summary(report: Report, law: str) -> str:
    """One cell: the worst of a law over all settings."""
    verdicts = [card[law] for card in report.cards]
    for status in (FAIL, DECLARED, PASS):
        hit = [v for v in verdicts if v.status == status]
        if hit:
            return (
                MARKS[status]
                if status != FAIL or len(hit) == len(verdicts)
                else f"**fails** {len(hit)}/{len(verdicts)}"
            )
    return MARKS[NOT_APPLICABLE]


def page(target: str, report: Report) -> str:
    """The page of one target."""
    lines = [
        f"# {target}",
        "",
        f"`gonio verify`, effort {report.effort}, seed {report.seed}; {report.tests} statistical ",
    ]
    lines[-1] += f"tests at {report.threshold:.1e} each (.01 over all, Sidak), rejections confirmed with a second seed."
    for card in report.cards:
        lines += ["", f"## {card.title}", "", "| law | verdict | figure | allowed | remark |", "|---|---|---|---|---|"]
        for v in card.verdicts:
            allowed = "" if v.tolerance is None or v.tolerance == float("inf") else f"{v.tolerance:.0e}"
            lines.append(f"| {v.law} | {MARKS[v.status]} | {v.shown} | {allowed} | {_remark(v)} |")
        if card.quality is not None:
            lines += ["", card.quality.words.capitalize() + "."]
        failed = [v for v in card.verdicts if v.failed]
        for v in failed:
            lines += ["", f"**{v.law}**: {'; '.join(_clean(w) for w in v.why)}.", "", f"    {v.command}"]
    return "\n".join(lines) + "\n"


def _remark(v: Verdict) -> str:
    if v.status == NOT_APPLICABLE:
        return _clean("; ".join(v.why))
    return _clean("; ".join([*v.notes, v.worst] if v.notes or v.worst else []))


def _clean(text: str) -> str:
    return text.replace("|", "/").replace(str(Path.cwd()), ".")


def main() -> int:
    """Write all pages; returns the exit code, 0 whatever the laws say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", default="quick", choices=("quick", "default"))
    parser.add_argument("--only", default="")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chosen = options.only.split(",") if options.only else targets()
    FOLDER.mkdir(exist_ok=True)
    stored = FOLDER / "cards.json"
    results: dict[str, Any] = json.loads(stored.read_text()) if options.only and stored.exists() else {}
    for target in chosen:
        print(target, flush=True)
        name = target.replace(":", "-")
        try:
            report = verify(trials(target), quick=options.effort == "quick", seed=options.seed)
        except go.GonioError as error:
            reason = " ".join(str(error).split())
            results[target] = {"not judged": reason}
            (FOLDER / f"{name}.md").write_text(f"# {target}\n\nNot judged: {reason}\n")
            continue
        (FOLDER / f"{name}.md").write_text(page(target, report))
        results[target] = {
            "laws": {law: summary(report, law) for law in SHORT},
            "worst": {law: report[law].shown for law in SHORT},
            "losses": losses(report),
            "settings": [card.title for card in report.cards],
        }
    stored.write_text(json.dumps(dict(sorted(results.items())), indent=1) + "\n")
    (FOLDER / "README.md").write_text(overview(results, options.effort, options.seed))
    return 0


def overview(results: dict[str, Any], effort: str, seed: int) -> str:
    """The table of all targets."""
    renderers = f"Gonio {go.__version__} and Mitsuba {version('mitsuba')} (llvm_ad_rgb)"
    lines = [
        "# Report cards",
        "",
        f"What `gonio verify` measured on {renderers}, effort {effort}, seed {seed}.",
        "Made by `python docs/make_report_cards.py`; a cell is the worst over all settings of its page.",
        "",
        *EXPLANATION.strip().splitlines(),
        "",
        "| target | " + " | ".join(SHORT) + " |",
        "|---" * (len(SHORT) + 1) + "|",
    ]
    for target, result in sorted(results.items(), key=lambda item: (":" in item[0], item[0])):
        link = f"[{target}]({target.replace(':', '-')}.md)"
        if "not judged" in result:
            lines.append(
                f"| {link} | not judged: {result['not judged'].split(': ', 1)[-1][-70:]} |" + " |" * (len(SHORT) - 1)
            )
        else:
            lines.append(f"| {link} | " + " | ".join(result["laws"][law] for law in SHORT) + " |")
    lines += [
        "",
        "## What a white furnace loses",
        "",
        "Every albedo 1 and, where it can be chosen, F = 1. The loss is that of the average over a hemisphere, and the",
        "largest; a negative loss is a gain.",
        "",
        "| target, setting | loss |",
        "|---|---|",
    ]
    for _, result in sorted(results.items(), key=lambda item: (":" in item[0], item[0])):
        for setting, text in result.get("losses", {}).items():
            lines.append(f"| {setting} | {text} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
