"""The probable cause of a failure, which is stated only if the ratio of two values fits a formula.

Two values that should be equal have a ratio of 1. A missing Jacobian, cosine or pi appears in this ratio. The cause is
the simplest factor that fits. If the ratio is 1 except in a region, on one side of the surface or in a channel, the
cause states that region.

    cause = named(Ratio("weight x pdf", "eval", wo, wi, top, bottom, subject))
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .factors import half_vector
from .fits import FEWEST, fitted
from .ratio import COVER, Cause, Fit, Ratio, factor_key, tolerance

ROWS = 4096  # maximum number of pairs of directions


def named(ratio: Ratio) -> Cause | None:
    """The cause that a ratio suggests, or None if it fits no formula."""
    unsupported = nothing_below(ratio.top, ratio.bottom, ratio.wo, ratio.wi, ratio.above, ratio.below)
    ratio = telling(ratio)
    if len(ratio.wo) < FEWEST:
        return unsupported
    off = _off(ratio)
    if not off.any():
        return unsupported
    words = ""
    channels = np.flatnonzero(off.mean(0) > 0.02)
    if len(channels) in (1, 2) and off.shape[1] == 3 and not off[:, [c for c in range(3) if c not in channels]].any():
        words = f"only in {' and '.join(('red', 'green', 'blue')[c] for c in channels)}"
        ratio = ratio.take(np.arange(len(ratio.wo)), channels)
        off = off[:, channels]
    everywhere = fitted(ratio)
    if everywhere is not None:
        return _cause(ratio, everywhere, words)
    bad: np.ndarray = np.any(off, axis=1)
    region = _region(ratio, bad)
    if region is None and unsupported is not None:
        return unsupported
    clamp = _clamp(ratio, bad)
    if clamp is not None:
        return clamp
    if region is None:
        # a single channel counts as a region too
        text = f"{ratio.name} differs from 1 {words}"
        return Cause(text, text) if words and bad.mean() > COVER else _part(ratio)
    place, rows = region
    words = f"{words} and {place}".removeprefix(" and ") if words else place
    inside = fitted(ratio.take(np.flatnonzero(rows)))
    if inside is not None:
        return _cause(ratio, inside, words)
    text = f"{ratio.name} differs from 1 only {words.removeprefix('only ')}"
    return Cause(text, text)


def _clamp(ratio: Ratio, bad: np.ndarray) -> Cause | None:
    """A cause if one of the two values is constant, at the end of its range, wherever they differ."""
    if not 0.003 < bad.mean() < 0.97 or bad.sum() < FEWEST or np.ptp(ratio.wi[bad], axis=0).max() < 0.1:
        return None  # all values are equal for a single direction
    sides = (ratio.above, ratio.below, ratio.top, ratio.bottom), (ratio.below, ratio.above, ratio.bottom, ratio.top)
    for values, other, name, against in sides:
        clamped, right = values[bad].max(1), other[bad].max(1)
        middle = float(np.median(clamped))
        if middle <= 0.0 or np.mean(np.abs(clamped / middle - 1.0) < 1e-4) < 0.99:
            continue
        rest = values[~bad].max(1)  # within the same bound
        if np.ptp(rest) < 1e-3 * middle:
            continue  # the value is the same everywhere
        for word, side, bound in (
            ("at most", right > clamped, rest <= middle * 1.001),
            ("at least", right < clamped, rest >= middle * 0.999),
        ):
            if side.mean() > 0.99 and bound.mean() > 0.99:
                text = f"{name} is {middle:.4g} wherever {against} is {'larger' if word == 'at most' else 'smaller'}"
                return Cause(f"{text}; possible mistake: clamping to {word} {middle:.4g}", f"{name} clamped")
    return None


def _part(ratio: Ratio) -> Cause | None:
    """A cause if one of two densities never exceeds the other, as if it included fewer lobes."""
    if "pdf" not in ratio.top or "pdf" not in ratio.bottom or "weight" in ratio.top:
        return None
    above, below = ratio.above[:, 0], ratio.below[:, 0]
    for less, more, name, other in ((above, below, ratio.top, ratio.bottom), (below, above, ratio.bottom, ratio.top)):
        if np.mean(less > more * (1.0 + 10.0 * tolerance(ratio))) < 1e-3 and np.mean(less < 0.95 * more) > 0.2:
            text = f"{name} never exceeds {other} and is often smaller: is a lobe of a mixture missing?"
            return Cause(text, f"{name} part")
    return None


def _cause(ratio: Ratio, fit: Fit, place: str) -> Cause:
    where = f", {place}" if place else ""
    cover = f" for {fit.cover:.0%} of the directions" if fit.cover < 0.9995 else ""
    text = f"{ratio.name} is {fit.formula}{where}, within {max(fit.spread, 1e-9):.0e}{cover}"
    key = factor_key(fit.number) if fit.number is not None else fit.formula
    return Cause(f"{text}; possible mistake: {fit.guess}" if fit.guess else text, f"{key} {place}".strip())


def telling(ratio: Ratio) -> Ratio:
    """The ratio restricted to pairs for which both values are finite and the denominator is not negligible."""
    finite = np.isfinite(ratio.above).all(1) & np.isfinite(ratio.below).all(1)
    # within 0.06 degrees of the horizon a ratio of cosines is unreliable
    finite &= np.minimum(np.abs(ratio.wo[:, 2]), np.abs(ratio.wi[:, 2])) > 1e-3
    size = np.abs(ratio.below).max(1)
    largest = float(np.percentile(size[finite], 99.0)) if finite.any() else 0.0
    rows = np.flatnonzero(finite & (size > 1e-6 * largest))
    if len(rows) and largest > 0.0:
        return ratio.take(rows[:ROWS])
    return ratio.take(rows[:0])


def nothing_below(
    top: str, bottom: str, wo: np.ndarray, wi: np.ndarray, above: np.ndarray, below: np.ndarray
) -> Cause | None:
    """The cause if the denominator is 0 but the numerator is not, in a region with a simple description, as for samples
    where `eval` is 0.

    top, bottom   names of numerator and denominator
    above, below  their values
    """
    dark = np.all(below == 0.0, axis=1)
    lit: np.ndarray = np.any(above > 0.0, axis=1)
    bad = dark & lit
    if bad.sum() < max(FEWEST, 5e-3 * len(bad)):
        return None
    place = place_of(wo[lit], wi[lit], bad[lit])
    words = f"{top} is positive but {bottom} is 0 {place}"
    return Cause(f"{words}, for a fraction of {bad[lit].mean():.2g} of the directions", words) if place else None


def _off(ratio: Ratio) -> np.ndarray:
    """Whether the two values of a ratio differ, (N, channels)."""
    floor = 1e-3 * np.abs(ratio.below).max(1, keepdims=True)
    size = np.maximum(np.maximum(np.abs(ratio.above), np.abs(ratio.below)), floor)
    return np.abs(ratio.above - ratio.below) > tolerance(ratio) * size


# --------------------------------------------------------------------------- a region


def _region(ratio: Ratio, bad: np.ndarray) -> tuple[str, np.ndarray] | None:
    """The region outside which a ratio is 1, as text and as a mask; None if no simple region fits.

    bad  pairs for which the ratio is not 1
    """
    share = float(bad.mean())
    if not 0.003 < share < 0.97 or bad.sum() < FEWEST:
        return None
    size = np.abs(np.log(np.maximum(np.abs(_first(ratio)), 1e-9)))[bad]
    if np.percentile(size, 5.0) < 0.05 * np.median(size):
        return None  # the error grows from 0: the region has no edge
    return _place(ratio.wo, ratio.wi, bad)


def _first(ratio: Ratio) -> np.ndarray:
    """The ratio in the channel in which it differs most from 1, (N,)."""
    r = ratio.above / np.where(ratio.below == 0.0, np.nan, ratio.below)
    r = np.nan_to_num(r, nan=1.0)
    return r[np.arange(len(r)), np.argmax(np.abs(r - 1.0), axis=1)]


def _places(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Simple regions with their descriptions: sides of the surface, halves of the sphere, then ranges of an angle."""
    o, i = wo[:, 2] > 0.0, wi[:, 2] > 0.0
    through = o != i
    yield "from outside", o
    yield "from inside", ~o
    yield "in transmission", through
    yield "in reflection", ~through
    yield "in transmission from outside", through & o
    yield "in transmission from inside", through & ~o
    yield "in reflection from outside", ~through & o
    yield "in reflection from inside", ~through & ~o
    for name, w in (("wo", wo), ("wi", wi)):
        for k, axis in enumerate("xy"):
            yield f"where {name}.{axis} > 0", w[:, k] > 0.0
            yield f"where {name}.{axis} < 0", w[:, k] < 0.0
    for name, values in _angles(wo, wi):
        # the edge lies between the outermost good pair and the innermost bad one
        lowest, highest = values[bad].min(), values[bad].max()
        if highest > values[~bad].max():
            edge = np.quantile(values[bad], 0.002, method="lower")
            yield f"where {name} is more than {edge:.3g} degrees", values >= edge
        elif lowest < values[~bad].min():
            edge = np.quantile(values[bad], 0.998, method="higher")
            yield f"where {name} is less than {edge:.3g} degrees", values <= edge


def _angles(wo: np.ndarray, wi: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    def degrees(cosine: np.ndarray) -> np.ndarray:
        return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))

    yield "wo's angle to the normal", degrees(np.abs(wo[:, 2]))
    yield "wi's angle to the normal", degrees(np.abs(wi[:, 2]))
    yield ("the larger angle to the normal", degrees(np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2]))))
    yield ("the smaller angle to the normal", degrees(np.maximum(np.abs(wo[:, 2]), np.abs(wi[:, 2]))))
    yield "the angle between wo and wi", degrees(np.sum(wo * wi, axis=1))
    yield ("the half vector's angle to the normal", degrees(np.abs(half_vector(wo, wi)[:, 2])))


def _place(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> tuple[str, np.ndarray] | None:
    """The first simple region that contains the bad pairs and no others, as text and as a mask."""
    for words, rows in _places(wo, wi, bad):
        if (rows & bad).sum() >= 0.995 * bad.sum() and (rows & ~bad).sum() <= 0.005 * rows.sum() + 0.5:
            return words, rows
    return None


def place_of(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> str:
    """The region of the bad pairs as text; "" if no simple region contains exactly these."""
    place = _place(wo, wi, bad) if bad.any() and not bad.all() else None
    return place[0] if place else ""


DENSE = 0.3  # fraction of a region's pairs that must be bad


def within(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> str:
    """The smallest simple region, as text, that contains all bad pairs but may contain others: opposite azimuths, or an
    interval of an angle; "" if none is small enough."""
    if bad.sum() < 4:
        return ""
    apart = np.sum(wo[:, :2] * wi[:, :2], axis=1) < 0.0
    regions = {"where the azimuths of wo and wi differ by more than 90 degrees": apart}
    for name, values in _angles(wo, wi):
        low, high = float(values[bad].min()), float(values[bad].max())
        inside = (values >= low) & (values <= high)
        words = (
            f"beyond {low:.3g}" if high > 89.0 else f"within {high:.3g}" if low < 1.0 else f"of {low:.3g} to {high:.3g}"
        )
        regions[f"at angles {words} degrees ({name})"] = inside
        if not np.any(bad & ~apart):
            regions[f"at angles {words} degrees ({name}), with azimuths that differ by more than 90"] = inside & apart
    density = {
        words: float((bad & rows).sum() / rows.sum()) for words, rows in regions.items() if not np.any(bad & ~rows)
    }
    best = max(density, key=density.__getitem__, default="")
    return best if best and density[best] > DENSE and density[best] > 2.0 * float(bad.mean()) else ""
