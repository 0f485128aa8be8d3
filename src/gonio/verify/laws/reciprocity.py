"""Reciprocity: f is symmetric in its two directions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import directions, severity, statistics
from ..effort import Effort
from ..figures import ReciprocityMap
from ..forensics.factors import index_below
from ..forensics.ratio import Cause, Ratio
from ..subject import Subject
from ..verdict import DoesNotApply, Finding, Trial
from .base import Law, pair_in_words, pairs, relative, rounding, worst_of

EXACT = 1e-6
SINGLE = 2e-3
STEPS = 24  # steps of the map per angle
EVEN = 512  # pairs of angles
REPEATS = 4096  # values of a stochastic model per pair
PERTURBATION = 1e-5  # radians
PAIRS = 1 << 13  # pairs of directions used to find a cause


class Reciprocity(Law):
    """f(wo, wi) / eta_o^2 = f(wi, wo) / eta_i^2, with eta the index on each direction's side (Veach1997, eq. 5.14)."""

    number = 2
    name = "reciprocity"
    title = "f(wo, wi) = f(wi, wo); in transmission, the same for f / eta^2"
    meaning = (
        "Pictures differ between path tracing, light tracing and photon mapping; bidirectional methods are biased."
    )

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to compare")
        eta = _eta(subject, seed)
        if subject.stochastic:
            return self._expected(subject, effort, seed, eta)
        exact = subject.best == "float64"
        wo, wi = pairs(subject, effort.pairs, seed, exact)
        # f divides by the cosine: within 0.006 degrees of the horizon, only rounding error is left
        keep = np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2])) > 1e-4
        wo, wi = wo[keep], wi[keep]
        error = _difference(subject, wo, wi, eta, exact)
        row, size = worst_of(error)
        single = "beyond the effect of changing both directions by 8 ulps, only the model's own rounding errors remain"
        return Finding(
            figure=size,
            tolerance=EXACT if exact else SINGLE,
            reason="float64 has rounding errors of 1e-16; formulas with cancellation lose up to ten digits"
            if exact
            else single,
            worst=pair_in_words(wo[row], wi[row]),
            at=(wo[row], wi[row]),
            evidence=ReciprocityMap(_map(subject, eta, exact), subject.transmits),
        )

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        eta = _eta(subject, seed)

        def both_ways(wo: np.ndarray, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            cosine = np.abs(wi[:, 2:])
            return subject.f(wo, wi) * _scale(wo, wi, eta)[:, None] * cosine, subject.f(wi, wo) * cosine

        return severity.between(subject, both_ways, "; in light tracing")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Ratio | Cause]:
        if subject.stochastic:
            return
        eta = _eta(subject, seed)
        for other in index_below(subject):
            if abs(other / eta - 1.0) < 1e-3:
                continue
            wrong = _reciprocal_with(subject, other, seed)
            if wrong:
                is_inverse = abs(other * eta - 1.0) < 1e-3
                text = "the inverse" if is_inverse else f"{eta:.4g}"
                yield Cause(
                    f"f is reciprocal for the index parameter, {other:.4g}, but `eta` of the samples is {text}",
                    "eta of samples",
                )
        if abs(eta - 1.0) > 1e-3 and _reciprocal_with(subject, 1.0, seed):
            text = "f(wo, wi) = f(wi, wo), even in transmission: is the factor (eta_o / eta_i)^2 of radiance missing"
            yield Cause(f"{text}, or should `eta` of the samples be 1?", "eta^2 in transmission")
        wo, wi = pairs(subject, PAIRS, seed, subject.best == "float64")
        there, back = (subject.f(wo, wi) * _scale(wo, wi, eta)[:, None], subject.f(wi, wo))
        yield Ratio("f(wo, wi)", "f(wi, wo)", wo, wi, there, back, subject, antisymmetric=True)
        if subject.isotropic and not subject.transmits and _difference_is_even(subject, seed):
            words = "f(wo, wi) - f(wi, wo) is the same for all azimuths"
            guess = "a base layer or compensation term that is attenuated for only one of the two directions"
            yield Cause(f"{words}; possible mistake: {guess}", "one direction of a base")

    def _expected(self, subject: Subject, effort: Effort, seed: int, eta: float) -> Finding:
        """The finding for a stochastic model, from the means over many values per pair, in both orders of the
        directions."""
        wo, wi = pairs(subject, 96, seed)
        keep = np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2])) > 0.02  # f divides by the cosine
        wo, wi = wo[keep][:24], wi[keep][:24]
        trials, worst, place = [], 0.0, 0
        for i, (a, b) in enumerate(zip(wo, wi, strict=True)):
            z = _distance(subject, a, b, eta, seed)
            if z is None:
                continue

            def repeat(a: np.ndarray = a, b: np.ndarray = b) -> float:
                return statistics.normal_two_sided(_distance(subject, a, b, eta, seed + 7919) or 0.0)

            trials.append(Trial(statistics.normal_two_sided(z), pair_in_words(a, b), repeat))
            if abs(z) > worst:
                worst, place = abs(z), i
        return Finding(
            figure=worst,
            tolerance=np.inf,
            reason="the material is stochastic: expectations are compared by p-values",
            shown=f"{worst:.2f} standard errors",
            worst=pair_in_words(wo[place], wi[place]),
            at=(wo[place], wi[place]),
            trials=trials,
        )


def _difference_is_even(subject: Subject, seed: int) -> bool:
    """Whether f(wo, wi) - f(wi, wo) depends only on the two angles to the normal."""
    rng = np.random.default_rng([seed, 7])
    theta = rng.uniform(2.0, 88.0, (2, EVEN))
    off = []
    for turn in (20.0, 75.0, 130.0, 170.0):
        wo, wi = directions.at(theta[0], 0.0), directions.at(theta[1], turn)
        off.append(subject.f(wo, wi).mean(1) - subject.f(wi, wo).mean(1))
    size = np.abs(off).max(0)
    lit = size > 1e-3 * float(np.median(np.abs(subject.f(wo, wi))))
    return bool(lit.mean() > 0.2 and np.mean(np.ptp(off, axis=0)[lit] < 1e-3 * size[lit]) > 0.97)


def _distance(subject: Subject, wo: np.ndarray, wi: np.ndarray, eta: float, seed: int) -> float | None:
    """The mean of f(wo, wi) - f(wi, wo), in standard errors; None if both are 0.

    The random numbers of a model may be a hash of its directions. Each value is therefore computed with another `seed`
    if the model has this parameter; otherwise, the directions are perturbed slightly, equally in both orders.
    """
    a, b = (np.tile(w, (REPEATS, 1)) for w in (wo, wi))
    if "seed" in subject.parameters:
        subject = subject.replace(seed=np.arange(REPEATS) + float(REPEATS * (seed % 1000)))
    else:
        rng = np.random.default_rng([seed, 6])
        a, b = (w + PERTURBATION * rng.normal(size=w.shape) for w in (a, b))
        a, b = (directions.single(w / np.linalg.norm(w, axis=1, keepdims=True)) for w in (a, b))
    there, back = subject.f(a, b).mean(1) * _scale(a, b, eta), subject.f(b, a).mean(1)
    if not there.any() and not back.any():
        return None
    off = there - back
    spread = np.hypot(off.std() / np.sqrt(REPEATS), 1e-6 * max(np.abs(there).mean(), np.abs(back).mean()))
    # where few values dominate the mean, their spread underestimates its error
    heavy = float(np.abs(off - off.mean()).max()) / np.sqrt(REPEATS)
    return float(off.mean() / max(spread, 0.25 * heavy))


def _reciprocal_with(subject: Subject, eta: float, seed: int) -> bool:
    """Whether the law holds with an eta other than that of the samples."""
    exact = subject.best == "float64"
    wo, wi = pairs(subject, PAIRS, seed, exact)
    keep = np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2])) > 1e-4
    return worst_of(_difference(subject, wo[keep], wi[keep], eta, exact))[1] < (EXACT if exact else SINGLE)


def _eta(subject: Subject, seed: int) -> float:
    """The index below the surface divided by that above, from the model's samples; 1 if nothing is transmitted."""
    if not subject.transmits:
        return 1.0
    rng = np.random.default_rng([seed, 4])
    wo = directions.on_side(directions.uniform(rng, 4096), 1)
    drawn = subject.sampler.sample(wo, directions.numbers(rng, 4096))
    through = (drawn.pdf > 0.0) & (drawn.wi[:, 2] < 0.0)
    if np.any(through & ~drawn.delta):  # light through a hole carries no information about the index
        through &= ~drawn.delta
    return float(np.median(drawn.eta[through])) if through.any() else 1.0


def _scale(wo: np.ndarray, wi: np.ndarray, eta: float) -> np.ndarray:
    """(eta_i / eta_o)^2, the factor between f(wo, wi) and f(wi, wo)."""
    through = wo[:, 2] * wi[:, 2] < 0.0
    return np.where(through, np.where(wo[:, 2] > 0.0, eta**2, eta**-2), 1.0)


def _difference(subject: Subject, wo: np.ndarray, wi: np.ndarray, eta: float, exact: bool) -> np.ndarray:
    scale = _scale(wo, wi, eta)[:, None]
    there, back = subject.f(wo, wi) * scale, subject.f(wi, wo)
    if exact:
        # a billionth of the largest value counts as 0
        floor = 1e-9 * float(np.max(np.abs(there), initial=0.0, where=np.isfinite(there)))
        return relative(there, back, 0.0, floor)
    noise = rounding(lambda a, b: subject.f(a, b) * _scale(a, b, eta)[:, None], wo, wi) + rounding(subject.f, wi, wo)
    floor = 1e-6 * float(np.percentile(np.abs(there[np.isfinite(there)]), 99.0))
    return relative(there, back, noise, floor)


def _map(subject: Subject, eta: float, exact: bool) -> np.ndarray:
    """The largest relative difference over azimuths, by (theta_o, theta_i), for the figure."""
    below = subject.transmits
    theta = (np.arange(STEPS) + 0.5) / STEPS * (180.0 if below else 90.0)
    phi = np.arange(8) * 45.0 + 11.0
    to, ti, p = np.meshgrid(theta, theta, phi, indexing="ij")
    wo, wi = directions.at(to.ravel(), 7.0), directions.at(ti.ravel(), 7.0 + p.ravel())
    error = _difference(subject, *((wo, wi) if exact else (directions.single(wo), directions.single(wi))), eta, exact)
    return error.max(1).reshape(to.shape).max(2)
