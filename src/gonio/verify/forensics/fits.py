"""Fit a formula to the ratio of two values that should be equal: a constant, a factor of the table, or a factor with
fitted constants.

The result is the simplest formula that holds for nearly every pair of directions.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator

import numpy as np

from ...errors import GonioError
from ..subject import Subject
from . import factors
from .ratio import COVER, NUMBERS, SPREAD, Fit, Ratio, holds, scalar, tolerance, written

FEWEST = 64  # pairs of directions that a fit needs
ANY = "a constant factor"  # the guess for a number that is not a known constant


def fitted(ratio: Ratio) -> Fit | None:
    """The first candidate formula that explains a ratio everywhere; None if none does."""
    if len(ratio.wo) < FEWEST:
        return None
    plain = scalar(ratio)
    quality = None if plain is None else holds(ratio, plain)
    if quality is not None:
        return None  # 1 except for a few pairs: any factor that is 1 for the others would fit
    return next((fit for fit in (candidate(ratio) for candidate in CANDIDATES) if fit is not None), None)


def simple(ratio: Ratio) -> Fit | None:
    """The fit by a known number, a color or powers of cosines, which need no further evaluations; None if none fits."""
    if len(ratio.wo) < FEWEST:
        return None
    fit = _constant(ratio)
    if fit is not None:
        return fit if fit.number is None or written(abs(fit.number)) in NUMBERS else None
    return _color(ratio) or _cosines(ratio)


def _reflects(ratio: Ratio) -> bool:
    return bool(np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0))


def _constant(ratio: Ratio) -> Fit | None:
    """The fit by the same factor everywhere: pi, 2, 4 or any other number, including 0 and -1."""
    r = scalar(ratio)
    if r is None:
        return None
    middle = float(np.median(r))
    if abs(middle) < 1e-9:
        flat = float(np.mean(np.abs(r) < 1e-9))
        return Fit("0", ratio.zero, 0.0, flat) if flat > COVER else None
    quality = holds(ratio, r / middle)
    if quality is None or abs(middle - 1.0) < max(SPREAD, 2.0 * tolerance(ratio)):
        return None
    if abs(middle + 1.0) < SPREAD:
        return Fit("-1", "a wrong sign", *quality)
    for name, number in ratio.numbers.items():
        if abs(middle / number - 1.0) < SPREAD:
            return Fit(f"{name} = {middle:.5g}", "the chain rule is omitted or applied twice", *quality)
    text = written(middle) if middle > 0.0 else f"-{written(-middle)}"
    known = text.lstrip("-") in NUMBERS
    guess = "a constant that is missing from one of the two" if known else ANY
    return Fit(text, guess, *quality, middle)


def _color(ratio: Ratio) -> Fit | None:
    """The fit by one constant per channel: an albedo or a tint that one of the two values lacks."""
    if ratio.above.shape[1] != 3 or ratio.antisymmetric or np.any(ratio.below <= 0.0):
        return None
    r = ratio.above / ratio.below
    middle = np.median(r, axis=0)
    if np.any(middle <= 0.0) or np.ptp(middle) < 0.01 * middle.max():
        return None
    qualities = [holds(ratio, column / m) for column, m in zip(r.T, middle, strict=True)]
    spreads = [quality for quality in qualities if quality is not None]
    if len(spreads) < 3:
        return None
    text = ", ".join(f"{m:.4g}" for m in middle)
    guess = "a color that is missing from one of the two"
    return Fit(f"({text})", guess, max(s for s, _ in spreads), min(c for _, c in spreads))


COSINES = ("(o.m)", "cos_m", "cos_i", "cos_o", "sin_i", "sin_o")


def _cosines(ratio: Ratio) -> Fit | None:
    """The fit by powers of the cosines of a reflection, times a known number: 4 (o.m), cos_i, cos_o / cos_i, ..."""
    r = scalar(ratio)
    if r is None or not _reflects(ratio):
        return None
    wo, wi = ratio.wo, ratio.wi
    names: tuple[str, ...] = COSINES
    logs = np.log(factors.values_of(COSINES, wo, wi, factors.half_vector(wo, wi)))
    if ratio.antisymmetric:  # factors that are symmetric in the two directions cancel
        names, logs = ("cos_i", "sin_i"), logs[:, [2, 4]] - logs[:, [3, 5]]
    positive = np.isfinite(r) & (r > 0.0)
    if positive.mean() < COVER:
        return None
    # most exponents are 0: one or two cosines at a time, so that a few outliers do not disturb the others
    for count in (1, 2):
        for which in itertools.combinations(range(len(names)), count):
            fit = _powers(ratio, r, logs[:, which], [names[k] for k in which], positive)
            if fit is not None:
                return fit
    return None


def _powers(ratio: Ratio, r: np.ndarray, logs: np.ndarray, names: list[str], positive: np.ndarray) -> Fit | None:
    """The fit by integer powers of some cosines, by least squares."""
    if np.any(np.ptp(np.percentile(logs, [5.0, 95.0], axis=0), axis=0) < 0.05):
        return None  # nearly constant: any power would fit
    rows = np.flatnonzero(positive)
    columns = np.column_stack([logs[rows], np.ones(len(rows))])
    solved = np.linalg.lstsq(columns, np.log(r[rows]), rcond=None)[0]
    powers = np.round(solved[:-1])
    if np.any(powers == 0.0) or np.abs(powers).max() > 4.0 or np.abs(solved[:-1] - powers).max() > 0.2:
        return None
    quotient = r / np.exp(logs @ powers)
    scale = float(np.median(quotient))
    plain = abs(scale - 1.0) < SPREAD
    if not plain and written(scale) not in NUMBERS:
        return None  # clamping gives such a ratio, with an arbitrary constant
    quality = holds(ratio, quotient / scale)
    if quality is None:
        return None
    powers_of = dict(zip(names, powers.astype(int).tolist(), strict=True))
    if ratio.antisymmetric:
        powers_of |= {name.replace("_i", "_o"): -power for name, power in powers_of.items()}
    return Fit(factors.product("" if plain else scale, powers_of), factors.guess_of(names), *quality)


def _of_table(ratio: Ratio, table: Iterator[factors.Factor]) -> Fit | None:
    """The fit by the first factor of a table that equals the ratio."""
    r = scalar(ratio)
    for factor in table if r is not None else ():
        with np.errstate(divide="ignore", invalid="ignore"):
            quality = holds(ratio, r / factor.field(ratio.wo, ratio.wi))
        if quality is not None:
            return Fit(factor.formula, factor.guess, *quality)
    return None


def _index(ratio: Ratio) -> Fit | None:
    if not np.any(ratio.wo[:, 2] * ratio.wi[:, 2] < 0.0):
        return None
    guess = "the factor (eta_o / eta_i)^2 of radiance is missing, applied twice or inverted"
    return _of_table(ratio, factors.indices(ratio.subject, (2, -2, 1, -1, 4, -4, 3, -3), guess))


def _refraction(ratio: Ratio) -> Fit | None:
    r = scalar(ratio)
    if r is None or np.any(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0) or np.any(~(r > 0.0)):
        return None
    return _of_table(ratio, factors.refractions(ratio.subject))


def _distribution(ratio: Ratio) -> Fit | None:
    return _of_table(ratio, factors.distributions(ratio.subject)) if _reflects(ratio) else None


def _dielectric(ratio: Ratio) -> Fit | None:
    return _of_table(ratio, factors.dielectrics(ratio.subject, ratio.antisymmetric))


def _otherwise(ratio: Ratio) -> Fit | None:
    """The fit if the numerator is the denominator with swapped arguments, in the other mode, or at another width."""
    if ratio.recompute is None:
        return None
    subject, wo, wi = ratio.subject, ratio.wo, ratio.wi
    ways: list[tuple[str, str, tuple[Subject, np.ndarray, np.ndarray, str]]] = []
    if not ratio.antisymmetric:
        ways.append(("with wo and wi exchanged", "swapped arguments", (subject, wi, wo, "radiance")))
        flips = {"wi.x": (-1.0, 1.0, 1.0), "wi.y": (1.0, -1.0, 1.0), "wi.x and wi.y": (-1.0, -1.0, 1.0)}
        for text, flip in flips.items():
            guess = "a wrong sign of a tangent, or a reversed direction"
            ways.append((f"with the sign of {text} flipped", guess, (subject, wo, wi * np.array(flip), "radiance")))
    if subject.transmits:
        for mode in ("radiance", "importance"):
            ways.append((f"in mode {mode}", "`mode` is ignored or inverted", (subject, wo, wi, mode)))
    for text, guess, other in factors.widths(subject):
        ways.append((f"with {text}", guess, (other, wo, wi, "radiance")))
    for words, guess, arguments in ways:
        try:
            below = ratio.recompute(*arguments)
        except (GonioError, ValueError):
            continue
        if below.shape[1] != ratio.below.shape[1] or not np.all(np.isfinite(below)):
            continue
        r = scalar(dataclasses.replace(ratio, below=below))
        quality = holds(ratio, r) if r is not None else None
        if quality is not None:
            return Fit(f"1 {words}", guess, *quality)
    return None


SCHLICK = {"n.o": "cos_o", "n.i": "cos_i", "o.m": "(o.m)", "n.m": "cos_m"}


def _schlick(ratio: Ratio) -> Fit | None:
    """The fit by Schlick's F at another cosine, such as n.o instead of o.m, with R0 fitted per channel."""
    if not _reflects(ratio):
        return None
    wo, wi, m = ratio.wo, ratio.wi, factors.half_vector(ratio.wo, ratio.wi)
    powers = {
        name: (1.0 - np.clip(np.abs(factors.COSINES[cosine].field(wo, wi, m)), 0.0, 1.0)) ** 5
        for name, cosine in SCHLICK.items()
    }
    r = ratio.above / np.where(ratio.below == 0.0, np.nan, ratio.below)
    cases: list[tuple[str, str, np.ndarray, np.ndarray]] = []
    if not ratio.antisymmetric:
        # F with (1 - cos)^5 = 1 is 1: a term that one of the two lacks
        one, guess = np.ones(len(r)), "the Fresnel term is missing from one of the two or applied twice"
        for name, x in powers.items():
            cases += [(f"F({name})", guess, x, one), (f"1 / F({name})", guess, one, x)]
    order = [("n.o", "n.i"), ("n.i", "n.o")] if ratio.antisymmetric else itertools.permutations(powers, 2)
    cases += [(f"F({a}) / F({b})", factors.AT_NORMAL, powers[a], powers[b]) for a, b in order]
    for formula, guess, x, y in cases:
        quality = _schlick_quotient(ratio, r, x, y)
        if quality is not None:
            return Fit(formula, guess, *quality)
    return None


def _schlick_quotient(ratio: Ratio, r: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[float, float] | None:
    """Spread and cover, as in `holds`, of a ratio divided by (R0 + (1 - R0) x) / (R0 + (1 - R0) y), with R0 fitted."""
    spread, cover = 0.0, 1.0
    for column in r.T:
        # the equation is linear in R0
        a, b = column * (1.0 - y) - (1.0 - x), x - column * y
        good = np.isfinite(a) & np.isfinite(b)
        if not good.any() or np.sum(a[good] ** 2) < 1e-12:
            return None
        r0 = float(np.sum(a[good] * b[good]) / np.sum(a[good] ** 2))
        if not 0.0 <= r0 < 0.99:
            return None
        field = (r0 + (1.0 - r0) * x) / (r0 + (1.0 - r0) * y)
        if np.ptp(np.percentile(field, [5.0, 95.0])) < 0.01:
            return None
        quality = holds(ratio, column / field)
        if quality is None:
            return None
        spread, cover = max(spread, quality[0]), min(cover, quality[1])
    return spread, cover


DEGREE = 9
KNOTS = 97  # of a function that may have kinks, such as a smooth step at the horizon


def _one_direction(ratio: Ratio) -> Fit | None:
    """The fit by f(wo, wi) / f(wi, wo) = g(cos_o) / g(cos_i), for a term that depends on one of the two directions
    only."""
    r = scalar(ratio) if ratio.antisymmetric else None
    if r is None or not _reflects(ratio) or not np.all(r > 0.0):
        return None
    o, i = (np.abs(w[:, 2:]) for w in (ratio.wo, ratio.wi))
    powers = np.arange(1, DEGREE + 1)
    smooth = np.column_stack([o**powers - i**powers, np.log(o / i)])
    knots = np.linspace(0.0, 1.0, KNOTS)
    tents = [np.maximum(1.0 - np.abs(w - knots) * (KNOTS - 1), 0.0) for w in (o, i)]
    for columns in (smooth, np.column_stack([tents[0] - tents[1], np.log(o / i)])):
        solved = np.linalg.lstsq(columns, np.log(r), rcond=None)[0]
        quality = holds(ratio, r / np.exp(columns @ solved))
        if quality is not None:
            break
    if quality is None:
        return None
    guess = "a term that depends on one direction only, instead of the half vector or both directions"
    return Fit("g(wo) / g(wi), where g is a function of one cosine", guess, *quality)


CANDIDATES: tuple[Callable[[Ratio], Fit | None], ...] = (
    _constant,
    _color,
    _cosines,
    _index,
    _refraction,
    _otherwise,
    _distribution,
    _schlick,
    _dielectric,
    _one_direction,
)
