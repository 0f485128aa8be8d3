"""The probable mistake in values of f: a wrong formula from `mistakes`, or a factor found by `verify.forensics`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..material import BSDF
from ..verify.forensics import causes as referee
from ..verify.forensics import fits
from ..verify.forensics.ratio import COVER, Ratio, tolerance
from ..verify.subject import Subject
from .finding import Mistake
from .mistakes import FAMILIES, Values, Variant, f_of

TOP, BOTTOM = "your f", "the model's"
REGION = "the region where the values differ"  # the topic if no formula explains the values


def ratio(material: BSDF, wo: np.ndarray, wi: np.ndarray, given: Values, expected: Values, accuracy: float) -> Ratio:
    """The ratio of the given values to the expected ones, both of shape (N, 3).

    accuracy  relative difference below which values count as equal
    """

    def recompute(subject: Subject, wo: np.ndarray, wi: np.ndarray, mode: str) -> np.ndarray:
        return f_of(subject.model, wo, wi)

    subject = Subject(material, type(material).name)
    return Ratio(TOP, BOTTOM, wo, wi, given, expected, subject, recompute, accuracy=accuracy)


def named(both: Ratio) -> Mistake | None:
    """The mistake that explains the ratio `both`; None if there is no such mistake.

    The explanations are tried in this order: a known wrong formula that reproduces the values; a factor that
    `verify.forensics` fits to the ratio; a wrong formula multiplied by such a factor; a region where the ratio differs
    from 1.
    """
    telling = referee.telling(both)
    wrong: list[Variant] = []
    for family in FAMILIES:
        different = list(_different(telling, family.variants(telling.subject.model, telling.wo, telling.wi)))
        equal = [variant.mistake for variant in different if _equal(telling, variant)]
        if equal:
            return _either(equal)
        wrong += different
    fit = fits.fitted(telling)
    if fit is not None:
        return Mistake(_written(both, fit), _topic(fit))
    for variant in wrong:
        fit = fits.simple(dataclasses.replace(telling, below=variant.values))
        if fit is not None:
            words = f"{variant.mistake.words}; in addition, a factor of {fit.formula}"
            return Mistake(words, variant.mistake.topic)
    cause = referee.named(both)
    return Mistake(cause.words, REGION) if cause is not None else None


def is_known(mistake: Mistake) -> bool:
    """Whether a mistake is a specific formula, rather than a region or an unexplained constant factor, which may also
    be due to a different parameter value."""
    return mistake.topic != REGION and not mistake.words.endswith(f"{fits.ANY}?")


def _either(mistakes: list[Mistake]) -> Mistake:
    """The first three of several mistakes with equal values, combined into one: for example, a factor of 4 and a factor
    of 1 / alpha, if alpha is 1/4."""
    texts = list(dict.fromkeys(mistake.words for mistake in mistakes))[:3]
    return Mistake(", or ".join(texts), " or ".join(dict.fromkeys(mistake.topic for mistake in mistakes[:3])))


def _different(both: Ratio, variants: Iterable[Variant]) -> Iterator[Variant]:
    """The mistakes whose values differ from the correct values in these rows."""
    for variant in variants:
        if variant.values.shape != both.below.shape:
            variant = Variant(variant.mistake, variant.values[:, : both.below.shape[1]])
        finite = np.all(np.isfinite(variant.values))
        if finite and not close(variant.values, both.below, tolerance(both)).mean() > COVER:
            yield variant


def _equal(both: Ratio, variant: Variant) -> bool:
    """Whether the given values are those that a mistake produces, except for a negligible fraction of the rows."""
    return bool(close(both.above, variant.values, tolerance(both)).mean() > COVER)


def close(a: Values, b: Values, accuracy: float) -> NDArray[np.bool_]:
    """Whether each row of two arrays of values agrees to within a relative accuracy, (N,). Values far below the largest
    value may differ by more."""
    size = np.maximum(np.abs(a), np.abs(b))
    floor = 1e-5 * np.percentile(size, 99.0) if size.size else 0.0
    return np.all(np.abs(a - b) <= accuracy * size + accuracy * floor, axis=1)


def _written(both: Ratio, fit: fits.Fit) -> str:
    text = f"{both.name} is {fit.formula}"
    return f"{text}: {fit.guess}?" if fit.guess else text


def _topic(fit: fits.Fit) -> str:
    return "a constant factor" if fit.number is not None else "a factor that depends on the directions"
