"""The severity of a violated law: the resulting bias of a picture, and its grade.

A bias is a fraction of the reflected light. It is stated for the worst direction wo, and as the cosine-weighted average
over the hemisphere of wo, which is the average over a sphere viewed by an orthographic camera. `estimators` computes
the bias due to sampling.

    bias = severity.between(subject, pair)     bias.worst, bias.average, bias.share, bias.words
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from ..energy.albedo import cubature
from . import directions
from .subject import Subject

Kind: TypeAlias = Literal["bias", "lost", "gained", "nan", "noise", "derivatives", "interface"]
# maps (wo, wi), (N, 3) each, to two values (N, channels) that should be equal, the correct one first if known
Pair: TypeAlias = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

ACCURACY = 4e-3  # requested of integrals; the division of cells makes them ten times as accurate
FLOOR = 0.02  # fraction of the brightest channel: an error of a nearly black one is invisible
PER_VIEW = 2048  # samples per wo of `by_samples`


class Grade(enum.StrEnum):
    """The severity of a failure. `LIMITS` contains the limits for the average and for the worst direction.

    NAN, NOISE, FITTING and INTERFACE (a call that integrators do not make, or whose result they ignore) do not bias a
    picture. BY_NATURE and INNER mean that this material is not at fault: the failure follows from the kind of material,
    or is that of an inner material.
    """

    INVISIBLE = "invisible"
    SMALL = "small"
    VISIBLE = "visible"
    BROKEN = "broken"
    NAN = "NaN"
    NOISE = "noise"
    FITTING = "fitting only"
    INTERFACE = "interface"
    BY_NATURE = "by nature"
    INNER = "inner"


# (average, worst). A quarter of an 8-bit step is 0.1 %, and the noise of a render hides 1 % at single directions. Two
# pictures side by side show 1 % of a flat tone (Weber); 10 % is visible without a comparison, as a wrong material.
LIMITS = {Grade.INVISIBLE: (1e-3, 0.01), Grade.SMALL: (0.01, 0.1), Grade.VISIBLE: (0.1, 0.5)}
_KINDS = {"nan": Grade.NAN, "noise": Grade.NOISE, "derivatives": Grade.FITTING, "interface": Grade.INTERFACE}


@dataclasses.dataclass(frozen=True)
class Bias:
    """The effect of a violation on a picture, as fractions of the reflected light (1 is all of it).

    worst    bias for the worst wo, in the worst channel
    average  cosine-weighted average of the bias over the hemisphere of wo
    share    fraction of this hemisphere in which the bias exceeds 1 %
    where    the worst wo, or another description of the place
    kind     "bias"; "lost" or "gained" energy; "nan", with fractions of directions instead of light; "noise", which
             wastes samples without bias; "derivatives", which affects fitting only; "interface", which affects only
             callers of the methods that `where` names
    furnace  average under uniform light, where errors of opposite sign cancel; None if sampling is not affected
    both     average with light and BSDF samples combined; None if sampling is not affected
    """

    worst: float
    average: float
    share: float
    where: str
    kind: Kind
    furnace: float | None = None
    both: float | None = None

    @property
    def grade(self) -> Grade:
        if self.kind in _KINDS:
            return _KINDS[self.kind]
        for grade, (average, worst) in LIMITS.items():
            if self.average < average and self.worst < worst:
                return grade
        return Grade.BROKEN

    @property
    def words(self) -> str:
        """The bias as text: "a loss of 4.8 % of the reflected light on average, 12 % at worst (wo at 85 degrees)"."""
        if self.kind == "noise":
            return f"wasted samples, but no bias: {self.where}"
        if self.kind == "interface":
            return f"pictures rendered by a plain path tracer are correct; {self.where}"
        if self.kind == "derivatives" and not self.average:
            return f"pictures are correct, but derivatives are not finite: {self.where}"
        if self.kind == "derivatives":
            return (
                f"pictures are correct, but derivatives are wrong by {percent(self.average)} on average: {self.where}"
            )
        if self.kind == "nan":
            if not self.worst:
                return f"NaN only at isolated directions: {self.where}"
            text = f"values are negative or not finite for {percent(self.average)} of all pairs of directions"
            return f"{text}, {percent(self.worst)} at worst ({self.where})"
        if not self.worst:
            return "none"
        name = {"lost": "a loss", "gained": "a gain", "bias": "an error"}[self.kind]
        text = f"{name} of {percent(self.average)} of the reflected light on average, {percent(self.worst)} at worst"
        text += f" ({self.where})"
        if self.share:
            text += f"; more than 1 % for {percent(self.share)} of the directions wo"
        if self.furnace is not None and self.furnace < 0.9 * self.average:
            text += f"; {percent(self.furnace)} on average under uniform light"
        if self.both is not None and abs(self.both - self.average) > 0.1 * self.average:
            text += f"; {percent(self.both)} on average with light and BSDF sampling combined"
        return text


def percent(share: float) -> str:
    """A fraction as a percentage: "4.8 %", "120 %"."""
    if share > 100.0:
        return "more than 10,000 %"
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


def degrees(theta: float) -> str:
    """An angle in degrees as text: "1 degree", "82 degrees"."""
    number = f"{theta:.3g}"
    return f"{number} degree{'' if number == '1' else 's'}"


# --------------------------------------------------------------------------- over directions


def views(sides: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """16 directions wo per side of the surface, and the fractions of the cosine-weighted hemispheres that they
    represent, which sum to 1."""
    # Equal steps of sin^2 theta have equal fractions; their midpoints avoid the round angles at which a material may
    # change. The normal itself, where azimuths are undefined, is left out.
    middles = np.degrees(np.arcsin(np.sqrt((np.arange(12) + 0.5) / 12.0)))
    theta = np.concatenate([[1.0], middles, [82.0, 86.0, 89.5]])
    s = np.sin(np.radians(theta)) ** 2
    edges = np.concatenate([[0.0], 0.5 * (s[1:] + s[:-1]), [1.0]])
    phi = 137.508 * np.arange(len(theta))
    wo = [directions.at(theta if side > 0 else 180.0 - theta, phi) for side in sides or (1,)]
    return directions.single(np.concatenate(wo)), np.tile(np.diff(edges), len(wo)) / len(wo)


def summed(
    off: np.ndarray, light: np.ndarray, wo: np.ndarray, mass: np.ndarray, kind: Kind | None = None, where: str = ""
) -> Bias:
    """The bias that results from errors of the reflected light.

    off       signed errors, (N, channels)
    light     reflected light, (N, channels)
    wo, mass  directions and their fractions, from `views`
    kind      kind of the bias; if None, an error of the same sign nearly everywhere is lost or gained energy
    where     text to append to the description of the worst wo
    """
    floor = np.maximum(FLOOR * light.max(1, keepdims=True), 1e-3 * light.max(initial=0.0))
    relative = off / np.maximum(np.maximum(light, floor), 1e-12)
    channel = np.argmax(np.abs(relative), axis=1)
    signed = relative[np.arange(len(off)), channel]
    size = np.abs(signed)
    row = int(np.argmax(size))
    average = float(mass @ size)
    if kind is None:
        kind = "bias" if abs(float(mass @ signed)) < 0.9 * average else "lost" if signed[row] < 0.0 else "gained"
    theta = float(directions.angles(wo[row])[0])
    place = f"wo at {degrees(theta)}"
    if off.shape[1] == 3 and np.ptp(relative[row]) > 0.1 * size[row]:
        place += f", in {('red', 'green', 'blue')[int(channel[row])]}"
    return Bias(float(size[row]), average, float(mass[size > 0.01].sum()), f"{place}{where}", kind)


def between(subject: Subject, pair: Pair, where: str = "") -> Bias | None:
    """The bias of a value b relative to a value a to which it should be equal: int |a - b| dwi / int |a| dwi.

    pair   function (wo, wi) that returns the two values, a and b
    where  text to append to the description of the worst wo
    Returns None if nothing is reflected, or if values are random.
    """
    if subject.stochastic or not subject.has_density or not subject.steady:
        return None
    wo, mass = views(subject.sides)

    def integrand(o: np.ndarray, i: np.ndarray) -> np.ndarray:
        a, b = (np.nan_to_num(value, nan=0.0, posinf=0.0, neginf=0.0) for value in pair(o, i))
        return np.concatenate([np.abs(a - b), np.abs(a)], axis=1)

    value = cubature.integrate(seeds(subject), cubature.of_rows(integrand), wo, ACCURACY).value
    off, light = np.split(value, 2, axis=1)
    return summed(off, light, wo, mass, "bias", where) if np.any(light > 0.0) else None


def by_samples(subject: Subject, pair: Pair, where: str = "") -> Bias | None:
    """The same as `between`, with the same arguments, but by Monte Carlo integration with half of the directions
    uniform, for differences that are too irregular for cells."""
    if subject.stochastic or not subject.steady:
        return None
    wo, mass = views(subject.sides)
    rng = np.random.default_rng(12)
    o = np.repeat(wo, PER_VIEW, axis=0)
    wi = directions.uniform(rng, len(o))
    s = subject.sample(o, directions.numbers(rng, len(o)))
    drawn = (rng.random(len(o)) < 0.5) & (s.pdf > 0.0) & ~s.delta
    wi[drawn] = directions.single(s.wi[drawn])
    density = 0.5 * subject.pdf(o, wi)[:, None] + 0.125 / np.pi
    a, b = (np.nan_to_num(v, nan=0.0, posinf=0.0, neginf=0.0) / density for v in pair(o, wi))
    off, light = (v.reshape(len(wo), PER_VIEW, -1).mean(1) for v in (np.abs(a - b), np.abs(a)))
    return summed(off, light, wo, mass, "bias", where) if np.any(light > 0.0) else None


def seeds(subject: Subject) -> cubature.Sampler:
    """The sampler from which the cubature places its cells: that of the subject, except that samples that are not unit
    vectors count as failed."""

    def sample(wo: np.ndarray, u: np.ndarray) -> object:
        s = subject.sample(wo, u, precision="float32")
        lengths = np.linalg.norm(np.nan_to_num(s.wi), axis=1)
        return s._replace(pdf=np.where(np.abs(lengths - 1.0) < 1e-3, np.nan_to_num(s.pdf), 0.0))

    return sample
