"""What a law is, and what several of them share: pairs of directions, and how far rounding alone moves a value."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ClassVar

import numpy as np

from ...members import Family, instances_of
from .. import directions
from ..effort import Effort
from ..forensics.ratio import Cause, Ratio
from ..severity import Bias
from ..subject import Fault, Subject
from ..verdict import Finding


class Law:
    """A law: asked of a subject, it returns a Finding, or raises DoesNotApply.

    number   its place in the report; Gonio's own are 1 to 10
    name     how it is called on the command line and in `breaks`
    title    the law as a sentence
    meaning  what its violation means for a picture
    everywhere  whether it is also asked at other values of the parameters
    at_ends     and at the ends of their ranges
    on_request  whether it is asked only when it is named
    """

    family: ClassVar[Family[Law]]
    number: ClassVar[int] = 100
    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    meaning: ClassVar[str] = ""
    everywhere: ClassVar[bool] = True
    at_ends: ClassVar[bool] = True
    on_request: ClassVar[bool] = False

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        raise NotImplementedError(f"{type(self).__name__} has no judge")

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Bias | None:
        """What a failure does to a picture; None where the law cannot say. Asked only where it fails."""
        return None

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterable[Ratio | Cause]:
        """Ratios that may name a failure's cause, or causes that are known already, the best first."""
        return ()


Law.family = Family("law", "gonio.laws", ["gonio.verify.laws"], instances_of(Law), "verify: laws")


def where_found(subject: Subject, finding: Finding) -> Subject:
    """The subject with the settings at which a finding was made."""
    return subject.replace(**finding.settings) if finding.settings else subject


def pairs(subject: Subject, count: int, seed: int, exact: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (wo, wi) on which the subject may have something to say, (count, 3) each.

    They are rounded to what float32 holds, so that both precisions see the same; with `exact` they are not, and unit
    to 64 bits.

    A third uniform on the sphere, a third with wi where the model samples (narrow lobes), a third near grazing.
    """
    rng = np.random.default_rng([seed, 1])
    sides = np.array(subject.sides or (1,))
    wo = directions.uniform(rng, count)
    wo[:, 2] = np.abs(wo[:, 2]) * rng.choice(sides, count)
    wi = directions.uniform(rng, count)
    if not subject.transmits:
        wi[:, 2] = np.copysign(wi[:, 2], wo[:, 2])
    third = count // 3
    grazing = slice(2 * third, count)
    for w in (wo[grazing], wi[grazing]):
        squeeze = 10.0 ** rng.uniform(-3.0, 0.0, len(w))
        w[:, 2] *= squeeze
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    if not exact:
        wo, wi = directions.single(wo), directions.single(wi)
    try:
        drawn = subject.sample(wo[third : 2 * third], directions.numbers(rng, third))
    except Fault:  # for the laws of sampling to report; the others do without
        return wo, wi
    good = (drawn.pdf > 0.0) & np.all(np.isfinite(drawn.wi), axis=1)
    wi[third : 2 * third][good] = drawn.wi[good]
    return wo, wi if exact else directions.single(wi)


ROUNDINGS = 4
ALLOWED = 8.0  # roundings of the directions that float32 code may show


def rounding(function: Callable[..., np.ndarray], wo: np.ndarray, wi: np.ndarray, seed: int = 0) -> np.ndarray:
    """How far a value may move by ALLOWED roundings of both directions in float32 (6e-8 each), (N, channels).

    Narrow lobes magnify the rounding of a half vector by 1 / alpha, and a step that is so near may be crossed; no
    float32 code can do better than this.
    """
    rng = np.random.default_rng([seed, 2])
    value = function(wo, wi)
    slope, step = np.zeros_like(value), np.zeros_like(value)
    for _ in range(ROUNDINGS):
        turns = [rng.uniform(-1.0, 1.0, w.shape) for w in (wo, wi)]
        a, b = (w + 2.0**-24 * turn for w, turn in zip((wo, wi), turns, strict=True))
        slope = np.maximum(slope, np.abs(function(a, b) - value))
        for side in (ALLOWED, -ALLOWED):  # one of the two crosses whatever step is that near
            a, b = (w + 2.0**-24 * side * np.sign(turn) for w, turn in zip((wo, wi), turns, strict=True))
            step = np.maximum(step, np.abs(function(a, b) - value))
    return np.where(step > 4.0 * ALLOWED * slope, step, ALLOWED * slope)


def relative(a: np.ndarray, b: np.ndarray, noise: np.ndarray | float = 0.0, floor: float = 0.0) -> np.ndarray:
    """(|a - b| - noise) / max(|a|, |b|, floor), never below 0."""
    size = np.maximum(np.maximum(np.abs(a), np.abs(b)), floor)
    return np.maximum(np.abs(a - b) - noise, 0.0) / np.where(size > 0.0, size, 1.0)


def worst_of(error: np.ndarray) -> tuple[int, float]:
    """Row and size of the largest entry of (N,) or (N, channels); what is no number counts as infinite."""
    flat = np.where(np.isfinite(error), error, np.inf)
    flat = flat if flat.ndim == 1 else flat.max(1)
    row = int(np.argmax(flat)) if len(flat) else 0
    return row, float(flat[row]) if len(flat) else 0.0


def angles(w: np.ndarray) -> str:
    """A direction's theta and phi in degrees."""
    theta, phi = directions.angles(w)
    return f"{theta:.4g}, {phi:.4g}"


def pair_in_words(wo: np.ndarray, wi: np.ndarray) -> str:
    """Both directions in degrees."""
    return f"wo at {angles(wo)}; wi at {angles(wi)} degrees"
