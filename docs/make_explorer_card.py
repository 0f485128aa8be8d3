"""Write docs/report-cards/engines/brdf-explorer.md: the verdicts on the models of the BRDF Explorer.

    python docs/make_explorer_card.py BRDFS    measure; BRDFS is the folder src/brdfs of a clone of wdas/brdf
    python docs/make_explorer_card.py          write the page from explorer.json

The files are read in place; none is part of Gonio.
"""

from __future__ import annotations

import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any

import gonio as go
from gonio.verify.severity import percent
from gonio.verify.verdict import Verdict

FOLDER = Path(__file__).parent / "report-cards" / "engines"
STORED = FOLDER / "explorer.json"
PAGE = FOLDER / "brdf-explorer.md"
LAWS = ("positivity", "reciprocity", "energy", "linearity")
SEED = 1
INTRO = f"""# BRDF Explorer

The `.brdf` files of [wdas/brdf](https://github.com/wdas/brdf), judged at their default values and over the ranges of
their parameters by {", ".join(LAWS)} of `gonio verify --quick`, seed {SEED}. Written by
`python docs/make_explorer_card.py`; all figures are in [explorer.json](explorer.json).

The Explorer draws functions, and many files are meant to be looked at, not rendered: a factor D, F or G alone is no
BRDF, and a parameter at the end of its slider may leave what its paper allows. A row says what a path tracer would
meet. The grades are explained [here](../../verify.md#severity-of-a-failure).
"""

FACTOR = re.compile(r"[dfg]_|show|compare|schlick")
FACTORS = """`d_`, `f_` and `g_` files and `schlick` hold one factor of a microfacet model, `compare` several next to
one another, and `showAngles` and `showVectors` color angles. None is a BRDF; their verdicts are listed so that nobody
renders them."""
AGAIN = """## Again

    git clone https://github.com/wdas/brdf
    gonio verify brdf/src/brdfs/disney.brdf

The Explorer itself plots the albedo of a model over the angle.
"""
_POW = (
    "`pow` of a negative number is undefined in GLSL, and NaN here: the {what}. Remedy: a product in place of `pow`, "
    "or `max(0.0, ...)`."
)
_ONE = _POW.format(what="cosine of the half vector rounds to more than 1 where wi = wo, so that 1 - u is below 0")
_FRESNEL = _POW.format(what="dielectric Fresnel term squares c (g + c) - 1 by `pow`, which is below 0 for a small c")
_DIVIDED = (
    "The file divides by dot(N, L) unless `divide_by_NdotL` is 0, so that BRDF times cosine is the lobe itself; "
    "nothing normalizes it for a small n."
)
CAUSES = {
    ("ashikhman_shirley", ""): _ONE + " With `isotropic` off the exponent is 0 / 0 where h is the normal.",
    ("cooktorrance", ""): _ONE
    + " Besides, `if (include_G) G = oneOverNdotV` switches the masking off when it is asked "
    "for, and `Beckmann` lacks the factor 1 / pi.",
    ("blinn", ""): _FRESNEL,
    ("walter", ""): _FRESNEL,
    ("blinnphong", ""): _DIVIDED,
    ("phong", ""): _DIVIDED,
    ("dAniso", ""): _POW.format(
        what="base of the highlight, -cos(a + b), is below 0 where the angles a and b "
        "to the tangent sum to less than 90 degrees"
    ),
    ("edwards06", "reciprocity"): "The half vector is projected along V alone (`NdotV / dot(N, uH)`), so that both "
    "directions are not treated alike; and see positivity.",
    ("edwards06", ""): _POW.format(what="`lump` of a point outside the disk of radius R, where it is meant to be 0"),
    ("minnaert", "energy"): "For k below 1, (n.l n.v)^(k - 1) has no bound at grazing angles; Minnaert's law for dark "
    "limbs is not meant there.",
    ("orennayar", ""): "cos(phi) is taken from the normalized projections of both directions, which are 0 / 0 where "
    "one is the normal. Remedy: the product of both tangents in place of two normalized vectors.",
    ("ward", "positivity"): "alpha_x and alpha_y may be 0, by which the lobe is divided.",
    ("ward", "energy"): "Cd and Cs are independent, and their sum is above 1; the lobe alone grows without bound "
    "towards grazing angles, where Ward divides by sqrt(n.l n.v) (Walter 2005).",
    ("disney", "energy"): "Diffuse, specular, sheen and clear coat are added; none takes light from another, and the "
    "diffuse lobe alone returns more than its color at grazing angles for a roughness near 1 (Burley 2012).",
    ("disney", "linearity"): "`mon2lin` raises baseColor to the power 2.2: the parameter is a display value by design.",
}


def measured(path: Path) -> dict[str, Any]:
    """The verdicts on a file."""
    try:
        (card,) = go.verify(str(path), quick=True, seed=SEED, law=list(LAWS)).cards
    except go.InputError as error:
        return {"rejected": str(error).split("\n")[0]}
    return {
        verdict.law: {
            "status": verdict.status,
            "grade": str(verdict.grade or ""),
            "size": _size(verdict),
            "why": verdict.why[0] if verdict.why else "",
            "cause": verdict.cause if verdict.failed else "",
        }
        for verdict in card.verdicts
        if verdict.law in LAWS
    }


def _size(verdict: Verdict) -> str:
    if not verdict.failed or verdict.bias is None:
        return verdict.shown if verdict.failed else ""
    if verdict.bias.kind in ("bias", "lost", "gained"):
        verb = {"bias": "wrong by", "lost": "loses", "gained": "gains"}[verdict.bias.kind]
        return f"{verb} {percent(verdict.bias.average)} on average, {percent(verdict.bias.worst)} at worst"
    return verdict.bias.words


def page(stored: dict[str, Any]) -> str:
    """The page, from the stored verdicts."""
    models = {name: one for name, one in stored.items() if not FACTOR.match(name)}
    factors = {name: one for name, one in stored.items() if FACTOR.match(name)}
    lines = [INTRO, "## Models", "", *_table(models), "", "## Failures of models", ""]
    for name, laws in models.items():
        for law, one in laws.items():
            if one["status"] == "fail":
                cause = (
                    CAUSES.get((name, law)) or _follows(one) or CAUSES.get((name, "")) or one["cause"] or "unexplained"
                )
                text = f"- **{name}**, {law}: {one['why']}; {one['size']}. Cause: {cause}"
                lines.append(textwrap.fill(text, 120, subsequent_indent="  ", break_on_hyphens=False))
    lines += ["", "## Factors and views", "", FACTORS, "", *_table(factors), "", AGAIN]
    return "\n".join(lines)


def _follows(one: dict[str, str]) -> str:
    """The explanation of a failure that follows from that of another law, such as NaN."""
    return one["cause"].lower() + "." if one["cause"].startswith("follows from") else ""


def _table(models: dict[str, Any]) -> list[str]:
    lines = [f"| file | {' | '.join(LAWS)} |", "|---" * (len(LAWS) + 1) + "|"]
    for name, laws in models.items():
        lines.append(f"| {name} | {' | '.join(_cell(laws[law]) for law in LAWS)} |")
    return lines


def _cell(one: dict[str, str]) -> str:
    if one["status"] == "fail":
        return f"**fails**: {one['grade']}" if one["grade"] else "**fails**"
    return {"does not apply": "-", "breaks as declared": "declared"}.get(one["status"], one["status"])


def main() -> int:
    """Measure, or write or check the page; returns the exit code."""
    stored: dict[str, Any] = {}
    if len(sys.argv) > 1 and sys.argv[1] != "--check":
        for path in sorted(Path(sys.argv[1]).glob("*.brdf")):
            stored[path.stem] = measured(path)
            STORED.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
            print(path.stem, flush=True)
    text = page(json.loads(STORED.read_text(encoding="utf-8")))
    if "--check" in sys.argv:
        return int(PAGE.read_text(encoding="utf-8") != text)
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
