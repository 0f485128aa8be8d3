"""Where samples crowd against the pdf, by how much, and what factor would make the two agree.

The samples are the truth here: cells of the chi-square test hold their counts, and the pdf's expectation is weighed
anew by each candidate factor. One that leaves no difference, in the cells of one wo and in int
pdf of all others, is named.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...energy.albedo import cubature
from .. import directions, estimators, severity
from ..figures import SampleCells
from . import factors
from .ratio import NUMBERS, Cause, written

if TYPE_CHECKING:
    from ..subject import Subject

Field: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of (wo, wi), (N, 3) each: (N,)

BLOCK = 10  # rows and columns of cells that are joined: a difference is told from noise in few, well-filled ones
FULL = 25.0  # expectation of a block that counts
EFFECT = 0.02  # root mean square of what is left between samples and expectation, as a share: clean below this
KNOWN = 0.004  # how near a known number a scale must be; 2^17 samples tell it to a third of a per cent
BEFORE = 0.08  # and what must have been there to begin with


@dataclasses.dataclass(frozen=True)
class Blocks:
    """Joined cells of one wo: expected and seen counts (B,), centres (B, 3), the fine cells' own data beside them.

    wi, area, expected, block  of each fine cell (C, 3), (C,), (C,), (C,): its centre, its size, its expectation
    """

    wo: np.ndarray
    seen: np.ndarray
    drawn: int
    wi: np.ndarray
    area: np.ndarray
    expected: np.ndarray
    block: np.ndarray

    def joined(self, values: np.ndarray) -> np.ndarray:
        """Values of the fine cells (C,), summed over blocks (B,)."""
        return np.bincount(self.block, values, len(self.seen))


def blocks(cells: SampleCells) -> Blocks | None:
    """The cells of a test, joined; None where they do not say to which wo they belong."""
    if cells.wo is None:
        return None
    height, turn = cells.rows.astype(float), cells.columns.astype(float)
    quarter = np.minimum(np.floor(turn), 3.0)
    azimuth = 0.5 * np.pi * quarter + np.arctan2(turn - quarter, 1.0 - (turn - quarter))
    a, b = height[:, :-1, None], height[:, 1:, None]
    c, d = azimuth[..., :-1], azimuth[..., 1:]
    h, phi = np.broadcast_to(0.5 * (a + b), c.shape), 0.5 * (c + d)
    r = np.sqrt(h * (2.0 - h))
    side = np.array(cells.sides, float)[:, None, None]
    wi = np.stack([r * np.cos(phi), r * np.sin(phi), (1.0 - h) * side], -1).reshape(-1, 3)
    sides, rows, columns = c.shape
    number = np.arange(sides * (rows // BLOCK) * (columns // BLOCK)).reshape(sides, rows // BLOCK, columns // BLOCK)
    block = number.repeat(BLOCK, 1).repeat(BLOCK, 2).ravel()
    seen = np.bincount(block, cells.observed.ravel(), number.size)
    area = ((b - a) * (d - c)).ravel()
    return Blocks(cells.wo, seen, cells.drawn, wi, area, cells.expected.ravel(), block)


def crowd(subject: Subject, held: Blocks) -> str:
    """Where samples and pdf differ, by how much, and how much light those cells hold: the worst connected sign."""
    expected = held.joined(held.expected)
    off = (held.seen - expected) / np.sqrt(np.maximum(expected, FULL))
    sign = 1.0 if np.sum(np.maximum(off, 0.0) ** 2) >= np.sum(np.minimum(off, 0.0) ** 2) else -1.0
    rows = off * sign > 4.0
    if not rows.any():
        return ""
    e, o = float(expected[rows].sum()), float(held.seen[rows].sum())
    many = np.tile(held.wo, (len(held.wi), 1))
    light = np.nan_to_num(subject.eval(many, held.wi).mean(1), posinf=0.0, neginf=0.0) * held.area
    share = float(held.joined(light)[rows].sum() / max(light.sum(), 1e-30))
    worst = int(np.argmax(off * sign))
    inside = held.block == worst
    middle = np.average(held.wi[inside], axis=0, weights=held.expected[inside] + 1e-12 * held.area[inside])
    theta, phi = directions.angles(middle)
    if not e or o / e > 2.0:
        amount = f"{o / e:.2g} times as many samples as the pdf says" if e else "samples where the pdf says none"
    else:
        amount = f"{severity.percent(abs(o / e - 1.0))} {'more' if o > e else 'fewer'} samples than the pdf says"
    cells = f"in cells with {severity.percent(share)} of the light"
    theta_o, phi_o = directions.angles(held.wo)
    return f"{amount} around wi {theta:.3g}, {phi:.3g} degrees, {cells}, seen from {theta_o:.3g}, {phi_o:.3g}"


# --------------------------------------------------------------------------- what would make them agree


def named(subject: Subject, held: Blocks) -> Cause | None:
    """The factor between samples and pdf; None where none is clean."""
    light = estimators.of_subject(subject)
    for formula, guess, field in _fields(subject):
        weighed = held.expected * field(np.broadcast_to(held.wo, held.wi.shape), held.wi)
        expected = held.joined(np.nan_to_num(weighed, posinf=0.0, neginf=0.0))
        inside, seen = float(expected.sum()), float(held.seen.sum())
        if inside <= 0.0 or seen < 1000.0:
            return None
        scale = seen / inside
        left = _effect(expected * scale, held.seen)
        if formula == "1":
            before = float(np.hypot(left, np.log(scale)))
            if before < BEFORE:
                return None  # so little that any smooth factor would do
            if abs(np.log(scale)) < 0.01:
                continue
        if left > max(EFFECT, 0.0) or left > 0.1 * before:
            continue
        text = written(scale, KNOWN)
        if text not in NUMBERS:
            text = f"{scale:.3g}"
        plain = abs(scale - 1.0) < 0.01
        if not plain and formula != "1" and text not in NUMBERS:
            continue
        known = NUMBERS.get(text, 1.0 if plain else scale)

        def weighed_pdf(o: np.ndarray, i: np.ndarray, k: float = known, by: Field = field) -> np.ndarray:
            value = np.nan_to_num(subject.pdf(o, i) * by(o, i) * k, posinf=0.0, neginf=0.0)
            return value[:, None]

        total = cubature.integrate(subject.sample, cubature.of_rows(weighed_pdf), light.wo, 1e-2).value[:, 0]
        if np.any(np.abs(total - light.drawn) > 0.02 + 0.02 * light.drawn):
            if formula == "1" and left < EFFECT:
                agree = f"samples over pdf are {scale:.3g} for all wi, and another number from other wo"
                return Cause(f"{agree}: the probability of choosing a lobe?", "samples a number of wo")
            continue
        whole = formula if plain else text if formula == "1" else f"{text} times {formula}"
        if text.startswith("1 / ") and formula.startswith("1 / "):
            whole = f"1 / ({text[4:]} {formula[4:]})"
        agree = f"samples over pdf are {whole}, within {max(left, 1e-3):.0e} in the cells and in int pdf of all wo"
        return Cause(f"{agree}: {guess}?", f"samples {whole}")
    return _sides(held)


def _sides(held: Blocks) -> Cause | None:
    """Whether samples and pdf agree on each side of the surface, and not on how many fall on which."""
    expected = held.joined(held.expected)
    sides = held.joined(held.wi[:, 2] * held.area) > 0.0
    if sides.all() or not sides.any():
        return None
    scaled, shares = np.zeros_like(expected), []
    for side in (sides, ~sides):
        e, o = float(expected[side].sum()), float(held.seen[side].sum())
        if e <= 0.0 or o < 1000.0:
            return None
        scaled[side] = expected[side] * (o / e)
        shares.append(o / e)
    if _effect(scaled, held.seen) > EFFECT or abs(np.log(shares[0] / shares[1])) < BEFORE:
        return None
    above, below = shares
    agree = f"samples over pdf are {above:.3g} above the surface and {below:.3g} below it, alike within each side"
    return Cause(f"{agree}: the choice between reflection and transmission?", "samples choose the side")


def _effect(expected: np.ndarray, seen: np.ndarray) -> float:
    """Root mean square of seen / expected - 1 beyond the noise of the counts."""
    order = np.argsort(expected)
    low = expected[order] < FULL
    e = np.append(expected[order][~low], expected[order][low].sum())
    o = np.append(seen[order][~low], seen[order][low].sum())
    kept = e > 0.0
    if np.any(o[~kept] > 0.0):
        return np.inf
    square = float(np.sum((o[kept] - e[kept]) ** 2 / e[kept])) - kept.sum()
    return float(np.sqrt(max(square, 0.0) / max(seen.sum(), 1.0)))


def _fields(subject: Subject) -> Iterator[tuple[str, str, Field]]:
    """Factors from simple to less so."""
    yield "1", "a constant of the pdf", lambda o, i: np.ones(len(o))

    def uniform(o: np.ndarray, i: np.ndarray) -> np.ndarray:
        plain = subject.pdf(o, i)
        return np.divide(1.0, plain, out=np.zeros(len(o)), where=plain > 0.0)

    yield "1 / pdf", "samples are uniform, and the pdf is not", uniform
    yield (
        "cos_i / pdf",
        "samples follow the cosine, and the pdf does not",
        lambda o, i: uniform(o, i) * np.abs(i[:, 2]),
    )
    names = ("(o.m)", "cos_m", "cos_i")

    def product(o: np.ndarray, i: np.ndarray, powers: tuple[int, ...]) -> np.ndarray:
        m = factors.half_vector(o, i)
        values = np.stack([np.sum(o * m, axis=1), m[:, 2], i[:, 2]], axis=1)
        return np.prod(np.maximum(np.abs(values), 1e-9) ** np.array(powers), axis=1)

    if not subject.transmits:
        for count in (1, 2):
            for powers in itertools.product((1, -1, 0), repeat=3):
                if np.count_nonzero(powers) != count:
                    continue
                powers_of = dict(zip(names, powers, strict=True))
                guess = " and ".join(factors.Cosines.GUESSES[name] for name, p in powers_of.items() if p)
                yield (factors.product("", powers_of), guess, functools.partial(product, powers=powers))
    for eta in factors.index_below(subject):
        for place, side in (("", 0.0), (" from outside", 1.0), (" from inside", -1.0)):
            for power in (2, -2, 4, -4):
                formula = f"{factors.product('', {'eta': power})} in transmission{place}"
                field = functools.partial(_through, eta=eta, side=side, power=float(power))
                yield formula, "eta^2 of the Jacobian of refraction", field
    for text, guess, other in factors.widths(subject):

        def replaced(o: np.ndarray, i: np.ndarray, other: Subject = other) -> np.ndarray:
            plain = subject.pdf(o, i)
            return np.divide(other.pdf(o, i), plain, out=np.zeros(len(o)), where=plain > 0.0)

        yield f"those of {text}", guess, replaced
    width = factors.width_of(subject)
    if width is not None and not subject.transmits:
        for text, exponent in factors.POWERS.items():

            def narrower(o: np.ndarray, i: np.ndarray, exponent: float = exponent) -> np.ndarray:
                m = factors.half_vector(o, i)
                return factors.ggx(m, width**exponent) / factors.ggx(m, width)

            yield f"D({text}) / D(alpha) of GGX", "alpha against alpha^2", narrower


def _through(o: np.ndarray, i: np.ndarray, eta: float, side: float, power: float) -> np.ndarray:
    """A power of the index on wi's side over that on wo's in transmission from a side, from both where it is 0."""
    there = (o[:, 2] * i[:, 2] < 0.0) & (o[:, 2] * side >= 0.0)
    return np.where(there, np.where(o[:, 2] > 0.0, eta, 1.0 / eta) ** power, 1.0)


def unsampled(subject: Subject) -> str:
    """Where int pdf exceeds the share of valid samples, in words; "" where it does not."""
    light = estimators.of_subject(subject)
    excess = light.claimed - light.drawn
    row = int(np.argmax(excess))
    theta = float(directions.angles(light.wo[row])[0])
    if excess[row] < 1e-3:
        return ""
    return f"pdf claims {severity.percent(float(excess[row]))} of samples that never come, wo at {theta:.3g} degrees"
