"""Precision: float32 agrees with float64."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ... import ops
from .. import severity
from ..effort import Effort
from ..figures import RoundingErrors
from ..forensics.causes import place_of
from ..forensics.ratio import Cause
from ..subject import Subject
from ..verdict import DoesNotApply, Finding
from .base import ALLOWED, Law, beyond_rounding, pair_in_words, pairs, relative, rounding, worst_of

TOLERANCE = 1e-3
DARK = 1e-12  # value, 1/sr, that adds less than 1e-11 to the albedo


class Precision(Law):
    """`eval` and `pdf` in float32 equal those in float64, except for the effect of rounding the directions."""

    number = 9
    name = "precision"
    title = "float32 agrees with float64"
    meaning = "Speckles and rings appear at certain distances, angles and values of roughness."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if "float64" not in subject.precisions:
            raise DoesNotApply("the BSDF cannot be evaluated in double precision")
        if subject.stochastic:
            raise DoesNotApply("the material is stochastic: individual values are random")
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to compare")
        wo, wi = pairs(subject, effort.pairs, seed)
        worst, place, name, plain = -1.0, 0, "", 0.0
        curve = np.zeros(len(wo))
        for what in ("eval", "pdf") if subject.drawn_by is None else ("eval",):

            def values(a: np.ndarray, b: np.ndarray, p: ops.Precision = "float64", what: str = what) -> np.ndarray:
                return subject.eval(a, b, precision=p) if what == "eval" else subject.pdf(a, b, p)[:, None]

            quick, exact = values(wo, wi, "float32"), values(wo, wi)
            floor = _floor(exact)
            plain = max(plain, float(np.percentile(relative(quick, exact, 0.0, floor), 99.9)))
            error = beyond_rounding(quick, exact, values, wo, wi, floor, TOLERANCE)
            if what == "eval":
                curve = relative(quick, exact, 0.0, floor).max(1)
            row, size = worst_of(error)
            if size > worst:
                worst, place, name = size, row, what
        return Finding(
            figure=worst,
            tolerance=TOLERANCE,
            reason=f"beyond the effect of changing both directions by {ALLOWED:g} ulps, cancellation in sums remains",
            shown=f"{worst:.1e}; 99.9 % of values agree to within {plain:.1e}",
            worst=f"{name}: {pair_in_words(wo[place], wi[place])}",
            at=(wo[place], wi[place]),
            evidence=RoundingErrors(curve, np.abs(wo[:, 2]), np.abs(wi[:, 2])),
        )

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        return severity.by_samples(
            subject, lambda wo, wi: (subject.eval(wo, wi), subject.eval(wo, wi, precision="float32"))
        )

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        wo, wi = pairs(subject, 4096, seed)
        single, exact = subject.eval(wo, wi, precision="float32"), subject.eval(wo, wi)
        noise = rounding(lambda a, b: subject.eval(a, b), wo, wi)
        bad = relative(single, exact, noise, _floor(exact)).max(1) > TOLERANCE
        place = place_of(wo, wi, bad)
        # a factor of a product or a power that overflows may make the whole 0, infinite or NaN
        lost = ~np.isfinite(single) | ((single == 0.0) & (exact != 0.0))
        if bad.any() and lost.any(1)[bad].mean() > 0.5:
            words = "float32 is 0 or not finite where float64 is neither" + (f", {place}" if place else "")
            guess = "a power or an exponential outside the range of float32, 1e-38 to 3e38"
            yield Cause(f"{words}; possible mistake: {guess}", "overflow")
            return
        words = "float32 has fewer correct digits than expected" + (f", {place}" if place else "")
        yield Cause(f"{words}; possible mistake: a difference of two nearly equal numbers", "cancellation")


def _floor(values: np.ndarray) -> float:
    """The smallest value by which differences are divided: a millionth of the bright values, but at least DARK, because
    a lobe may be so narrow that 99 % of the pairs miss it, and float32 gives 0 for these pairs."""
    return max(1e-6 * float(np.percentile(np.abs(values), 99.0)), DARK)
