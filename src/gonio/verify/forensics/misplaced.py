"""The places of samples that the pdf does not predict, if no single factor of `crowding` explains the difference.

The counts o and expectations e of blocks of cells have a ratio r = o / e. Three patterns of r are recognized:

    the pdf in another frame     samples follow pdf(wo, M wi), where M is a rotation about the normal or a reflection
    two parts                    r is a constant c in most blocks; in the others, it is always larger than c (the pdf
                                 lacks a lobe), or always smaller (the pdf has a lobe that is never sampled)
    one variable                 r is a function of one angle, whose distribution differs from that of the pdf
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...material import BSDF, tree
from .. import severity
from ..figures import SampleCells
from ..subject import Subject
from .crowding import BEFORE, EFFECT, Blocks, effect
from .factors import half_vector
from .ratio import Cause

SMALL = 0.02  # smallest difference that one variable explains
PLATEAU = 0.3  # smallest fraction of the expectation in blocks of one ratio
LEAST = 0.02  # smallest fraction of all samples that lie elsewhere
OTHER = 0.15  # largest fraction of these for differences of the other sign
APART = 2.0  # ratio of samples to pdf, relative to that of most blocks, where a lobe is missing from one of the two
BESIDE = 0.4  # smallest fraction of the difference in such blocks
NATURAL = 0.06  # largest difference of the integral of the pdf from the fraction of the samples
NOISE = 4.0  # standard errors
STEP = 0.02  # difference of logarithms within which ratios count as equal
BINS = 48
NEAR_HORIZON, NEAR_NORMAL = 0.3, 0.95  # cosines
FEW = 0.06  # fraction of the hemisphere below which an excess of samples is a ring or a point


def named(subject: Subject, cells: SampleCells, held: Blocks, seed: int) -> Cause | None:
    """The pattern of the difference, as a cause; None if there is none. For the arguments, see `mixture.named`."""
    expected = held.joined(held.expected)
    if held.observed.sum() < 1000 or expected.sum() <= 0.0:
        return None
    before = effect(expected, held.observed)
    if before < SMALL:
        return None
    if before > BEFORE:
        cause = _other_frame(subject, held, before) or _parts(subject, held)
        if cause is not None:
            return cause
    return _one_variable(cells, held, before)


# --------------------------------------------------------------------------- the pdf in another frame


def _frames(subject: Subject) -> Iterator[tuple[str, str, np.ndarray]]:
    """Rotations about the normal and mirror images: for each, its description, the mistake that it suggests, and its
    matrix."""
    guess = "the rotation of the axes is missing from one of the two, or has the wrong sign"
    for path, angle in _angles(subject):
        for factor in (1.0, -1.0, 2.0, -2.0):
            words = f"{'-' if factor < 0.0 else ''}{'2 ' if abs(factor) > 1.5 else ''}{path}"
            yield f"of wi rotated by {words}", guess, _rotation(factor * angle)
    yield (
        "of wi rotated by 180 degrees about the normal",
        "a reversed direction",
        np.diag([-1, -1, 1.0]),
    )
    for k, axis in enumerate("xy"):
        signs = np.ones(3)
        signs[k] = -1.0
        yield f"with the sign of wi.{axis} flipped", "a wrong sign of a tangent", np.diag(signs)
    exchanged = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    yield "with wi.x and wi.y exchanged", "sine and cosine of the azimuth, or x and y, exchanged", exchanged
    for sign in (1.0, -1.0):
        text = f"of wi rotated by {90.0 * sign:g} degrees about the normal"
        yield text, "x and y exchanged", _rotation(np.radians(90.0 * sign))


def _angles(subject: Subject) -> Iterator[tuple[str, float]]:
    if isinstance(subject.model, BSDF):
        for leaf in tree.leaves(subject.model):
            value = leaf.value
            if leaf.parameter.kind == "angle" and isinstance(value, int | float) and abs(float(value)) > 1e-3:
                yield leaf.path, float(value)


def _rotation(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _other_frame(subject: Subject, held: Blocks, before: float) -> Cause | None:
    wo = np.broadcast_to(held.wo, held.wi.shape)
    swapped = held.joined(np.nan_to_num(subject.pdf(held.wi, wo), posinf=0.0, neginf=0.0) * held.area) * held.drawn
    if (left := effect(swapped, held.observed)) < 3.0 * EFFECT and left < 0.3 * before:
        words = "samples follow the pdf with wo and wi exchanged; possible mistake: swapped arguments"
        return Cause(words, "samples of swapped directions")
    for text, guess, matrix in _frames(subject):
        for which, view in (("", wo), (", and the same for wo", wo @ matrix.T)):
            density = np.nan_to_num(subject.pdf(view, held.wi @ matrix.T), posinf=0.0, neginf=0.0)
            left = effect(held.joined(density * held.area) * held.drawn, held.observed)
            if left < 3.0 * EFFECT and left < 0.3 * before:
                words = f"samples follow the pdf {text}{which}"
                return Cause(f"{words}; possible mistake: {guess}", "samples in another frame")
    return None


# --------------------------------------------------------------------------- two parts


def _parts(subject: Subject, held: Blocks) -> Cause | None:
    e, o = held.joined(held.expected), held.observed.astype(float)
    filled = e > 25.0
    if not filled.any():
        return None
    logs = np.log(np.maximum(o[filled], 1.0) / e[filled])
    # the ratio in most of the expectation
    steps = np.round(logs / STEP).astype(int)
    weight = np.bincount(steps - steps.min(), e[filled])
    smooth = np.convolve(weight, np.ones(5), mode="same")
    middle = (int(np.argmax(smooth)) + steps.min()) * STEP
    near = np.abs(logs - middle) < 2.5 * STEP
    c = float(np.sum(o[filled][near]) / np.sum(e[filled][near]))
    off = o - c * e
    same = np.abs(off) < NOISE * np.sqrt(np.maximum(c * e, 1.0)) + STEP * c * e
    total = float(o.sum())
    more, less = float(off[~same & (off > 0.0)].sum()), float(-off[~same & (off < 0.0)].sum())
    if (
        e[same].sum() < PLATEAU * e.sum()
        or max(more, less) < LEAST * total
        or min(more, less) > OTHER * max(more, less)
    ):
        return None
    lacking = more > less
    # a separate lobe lies where the rest is dim; a wrong factor changes the ratio gradually
    apart = (o > APART * c * e) if lacking else (o * APART < c * e)
    if np.abs(off[~same & apart]).sum() < BESIDE * max(more, less):
        return None
    # the rest of a mixture: either the weights are those of the samples, or there is no other part in one of the two
    if (
        abs(c - 1.0) > 2.0 * STEP
        and abs(float(e.sum()) / held.drawn - (1.0 if lacking else total / held.drawn)) > NATURAL
    ):
        return None
    rows = ~same & ((off > 0.0) if lacking else (off < 0.0))
    place, ring = _place(held, np.where(rows, np.abs(off), 0.0))
    if not place:
        return None
    share = severity.percent((more if lacking else less) / (total if lacking else c * float(e.sum())))
    scale = "" if abs(c - 1.0) < 2.0 * STEP else f" times {c:.3g}"
    if lacking:
        if place.startswith("within") and "horizon" in place:
            guess = "directions below the horizon that are mirrored or clamped, or a lobe that is missing from the pdf"
        elif ring:
            guess = "an angle that is clamped, or uniform instead of its cosine, or a lobe that is missing from the pdf"
        else:
            guess = "a lobe that is missing from the pdf"
        return Cause(
            f"samples follow the pdf{scale}, except for {share} of them, {place}; possible mistake: {guess}",
            "pdf lacks a lobe",
        )
    words = f"samples follow the pdf{scale}, but {share} of the pdf, {place}, is rarely sampled"
    return Cause(f"{words}; possible mistake: a lobe that `sample` does not choose", "sample lacks a lobe")


def _place(held: Blocks, weight: np.ndarray) -> tuple[str, bool]:
    """A description of the place of most of a weight per block ("" if it is everywhere), and whether the place is a
    small part of the sphere."""
    area = held.joined(held.area)
    share = weight / max(float(weight.sum()), 1e-30)
    order = np.argsort(-share / np.maximum(area, 1e-12))
    most = order[: int(np.searchsorted(np.cumsum(share[order]), 0.8)) + 1]
    small = float(area[most].sum()) < FEW * 2.0 * np.pi
    inside = np.isin(held.block, most)
    cell = held.area * inside * (held.expected + 1e-12 * held.drawn)
    cosine = np.abs(held.wi[:, 2])
    mean = float(np.average(cosine, weights=cell)) if cell.sum() > 0.0 else 0.5
    spread = float(np.sqrt(np.average((cosine - mean) ** 2, weights=cell))) if cell.sum() > 0.0 else 1.0
    if mean + spread < NEAR_HORIZON:
        angle = np.degrees(np.arcsin(min(mean + 2.0 * spread, 1.0)))
        return f"within {angle:.2g} degrees of the horizon", small
    if mean - spread > NEAR_NORMAL:
        return "near the normal", small
    direction = np.average(held.wi, axis=0, weights=cell)
    length = float(np.linalg.norm(direction))
    if length > 0.8:
        theta = np.degrees(np.arccos(np.clip(direction[2] / length, -1.0, 1.0)))
        phi = np.degrees(np.arctan2(direction[1], direction[0])) % 360.0
        return f"near wi at {theta:.3g}, {phi:.3g} degrees", small
    return "", small


# --------------------------------------------------------------------------- one variable


def _mirrored(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    return np.asarray(np.sum(wo * np.array([-1.0, -1.0, 1.0]) * wi, axis=1))


Variable = Callable[[np.ndarray, np.ndarray], np.ndarray]
VARIABLES: dict[str, tuple[str, Variable]] = {
    "wi's angle to the normal": (
        "the distribution of the polar angle differs from that of the pdf, or a Jacobian is wrong",
        lambda o, i: i[:, 2],
    ),
    "the half vector's angle to the normal": (
        "the distribution of the half vector differs from that of the pdf",
        lambda o, i: half_vector(o, i)[:, 2],
    ),
    "the angle to the mirror direction": (
        "the distribution of the lobe about the mirror direction differs from that of the pdf",
        _mirrored,
    ),
    "wi's azimuth": (
        "the distribution of the azimuth differs from that of the pdf",
        lambda o, i: np.arctan2(i[:, 1], i[:, 0]),
    ),
    "the half vector's azimuth": (
        "the distribution of the half vector's azimuth differs from that of the pdf",
        lambda o, i: np.arctan2(half_vector(o, i)[:, 1], half_vector(o, i)[:, 0]),
    ),
}


def _one_variable(cells: SampleCells, held: Blocks, before: float) -> Cause | None:
    """A cause if the ratio of samples to pdf depends on one angle only: one ratio per step of this angle removes the
    difference."""
    wo = np.broadcast_to(held.wo, held.wi.shape)
    e, o = held.expected, cells.observed.ravel().astype(float)
    best: tuple[float, str, str, np.ndarray] | None = None
    for name, (guess, variable) in VARIABLES.items():
        order = np.argsort(variable(wo, held.wi))
        number = np.empty(len(e), int)
        number[order] = np.minimum((np.cumsum(e[order]) / max(e.sum(), 1e-30) * BINS).astype(int), BINS - 1)
        ratio = np.bincount(number, o, BINS) / np.maximum(np.bincount(number, e, BINS), 1e-30)
        left = effect(held.joined(e * ratio[number]), held.observed)
        if left < 2.0 * EFFECT and left < 0.3 * before and (best is None or left < best[0]):
            best = left, name, guess, ratio
    if best is None:
        return None
    _, name, guess, ratio = best
    words = f"the ratio of samples to pdf depends on {name} alone and is {ratio.min():.2g} to {ratio.max():.2g}"
    return Cause(f"{words}; possible mistake: {guess}", f"samples by {name}")
