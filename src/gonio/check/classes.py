"""Comparison of a class, or any other material, with a model: f at pairs of directions is checked like a file of
values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..material import BSDF
from ..measure.formats.rows import Pairs
from ..verify import directions
from . import samples
from .finding import Finding
from .mistakes import Values, f_of

PAIRS = 1024
ACCURACY = 1e-4  # relative; both materials are evaluated in float64, but constants may have only five digits
_GRAZING = 0.02  # smallest cosine; beyond 89 degrees, equivalent formulas for the tangent differ numerically


def check(name: str, given: BSDF, model: BSDF, accuracy: float | None = None) -> Finding:
    """Compare f of two materials.

    name      name of the class, for the finding
    accuracy  relative difference below which values count as equal; None selects the default
    Raises InputError for values that are not finite.
    """
    wo, wi = pairs(model, PAIRS)
    f = f_of(given, wo, wi)
    if not np.all(np.isfinite(f)):
        row = int(np.flatnonzero(~np.isfinite(f).all(axis=1))[0])
        what = f"f is NaN or infinite at wo {directions.text(wo[row])}, wi {directions.text(wi[row])} degrees"
        raise InputError(what, name, "guard the division, or the root of a number below 0")
    rows = Pairs(wo, wi, f, list(range(1, len(wo) + 1)))
    finding = samples.judge(name, rows, model, ACCURACY if accuracy is None else accuracy, "a material")
    return _with_angles(finding, wo, wi)


def pairs(model: BSDF, count: int, seed: int = 1) -> tuple[Values, Values]:
    """Random pairs of directions above the surface, (count, 3) each. Half of the wi are uniformly distributed, and half
    are sampled by the model."""
    rng = np.random.default_rng(seed)
    wo, wi = (directions.on_side(directions.uniform(rng, count), 1) for _ in range(2))
    sampled = model.sample(wo, directions.numbers(rng, count), precision="float64")
    light = np.asarray(sampled.wi, float)
    usable = (np.asarray(sampled.pdf) > 0.0) & ~np.asarray(sampled.delta) & (light[:, 2] > _GRAZING)
    wi[: count // 2] = np.where(usable[:, None], light, wi)[: count // 2]
    for w in (wo, wi):
        w[:, 2] = np.maximum(w[:, 2], _GRAZING)
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    return wo, wi


def _with_angles(finding: Finding, wo: Values, wi: Values) -> Finding:
    """The finding with the angles of the pair with the largest error instead of a line number."""
    if "line" not in finding.figures:
        return replace(finding, facts=tuple(fact.replace(" rows", " pairs of directions") for fact in finding.facts))
    row = int(finding.figures["line"]) - 1
    place = f"wo {directions.text(wo[row].round(6))}, wi {directions.text(wi[row].round(6))} degrees"
    facts = (
        fact.replace(f"line {row + 1},", f"{place}:").replace(" rows", " pairs of directions") for fact in finding.facts
    )
    figures = {name: value for name, value in finding.figures.items() if name != "line"}
    return replace(finding, facts=tuple(facts), figures=figures)
