"""The protocol of a law, and tools that several laws share: pairs of directions, and the effect of rounding."""

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
    """A law. Its method `judge` returns a Finding for a subject, or raises DoesNotApply.

    number      its place in the report; those of Gonio's laws are 1 to 13
    name        its name on the command line and in `known_violations`
    title       the law as a sentence
    meaning     the effect of a violation on pictures
    everywhere  whether it is also tested at other parameter values
    at_ends     whether these values may lie at the ends of their ranges
    samples     whether it tests `sample`; for a material that needs a guide, few other parameter values are tested
    on_request  whether it is tested only if it is requested by name
    """

    family: ClassVar[Family[Law]]
    number: ClassVar[int] = 100
    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    meaning: ClassVar[str] = ""
    everywhere: ClassVar[bool] = True
    at_ends: ClassVar[bool] = True
    samples: ClassVar[bool] = False
    on_request: ClassVar[bool] = False

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        raise NotImplementedError(f"{type(self).__name__} has no judge")

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Bias | None:
        """The effect of a failure on a picture; None if it is unknown. Called only after a failure.

        finding  the finding of the failure
        seed     seed of the random numbers
        """
        return None

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterable[Ratio | Cause]:
        """Ratios from which the cause of a failure may be determined, or causes that are already known, the best first.
        For the arguments, see `bias`."""
        return ()


Law.family = Family("law", "gonio.laws", ["gonio.verify.laws"], instances_of(Law), "verify: laws")


def where_found(subject: Subject, finding: Finding) -> Subject:
    """The subject with the parameter values of a finding."""
    return subject.replace(**finding.settings) if finding.settings else subject


def pairs(subject: Subject, count: int, seed: int, exact: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (wo, wi) for which `eval` may be positive, (count, 3) each: a third uniform on the sphere, a third with wi
    sampled by the subject (for narrow lobes), and a third near grazing angles.

    seed   seed of the directions
    exact  whether they are float64 unit vectors; if not, they are rounded to float32, so that both precisions get the
           same input
    """
    key = f"pairs {count} {seed} {exact}"
    if key not in subject.memo:  # several laws use the same pairs
        subject.memo[key] = _pairs(subject, count, seed, exact)
    wo, wi = subject.memo[key]
    return wo.copy(), wi.copy()


def _pairs(subject: Subject, count: int, seed: int, exact: bool) -> tuple[np.ndarray, np.ndarray]:
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
        drawn = subject.sampler.sample(wo[third : 2 * third], directions.numbers(rng, third))
    except Fault:  # the laws that test sampling report it; the others need no samples
        return wo, wi
    good = (drawn.pdf > 0.0) & np.all(np.isfinite(drawn.wi), axis=1)
    wi[third : 2 * third][good] = drawn.wi[good]
    return wo, wi if exact else directions.single(wi)


ROUNDINGS = 4
ROWS = 1 << 20  # rows per call
CLOSER = 64  # random changes at the few pairs where ROUNDINGS are not enough
MINOR = 0.01  # fraction of the tolerance below which a difference needs no explanation
ALLOWED = 8.0  # tolerated rounding error of the directions in float32 code, in units of 2^-24


def rounding(
    function: Callable[..., np.ndarray], wo: np.ndarray, wi: np.ndarray, seed: int = 0, times: int = ROUNDINGS
) -> np.ndarray:
    """The change of a value if both directions change by ALLOWED rounding errors of float32 (6e-8 each), (N, channels).

    Narrow lobes magnify the rounding error of a half vector by 1 / alpha, and a step of the value may lie within this
    distance; no float32 code can be more accurate.

    function  function (wo, wi) that returns the values, (N, channels)
    times     number of random changes
    """
    rng = np.random.default_rng([seed, 2])
    value = function(wo, wi)
    slope, step = np.zeros_like(value), np.zeros_like(value)
    together = max(1, ROWS // max(3 * len(wo), 1))  # changes per call: a call with few rows takes as long
    for first in range(0, times, together):
        moved: list[tuple[np.ndarray, np.ndarray]] = []
        for _ in range(min(together, times - first)):
            turns = [rng.uniform(-1.0, 1.0, w.shape) for w in (wo, wi)]
            moved.append((wo + 2.0**-24 * turns[0], wi + 2.0**-24 * turns[1]))
            for side in (ALLOWED, -ALLOWED):  # one of the two crosses a step that close
                moved.append((wo + 2.0**-24 * side * np.sign(turns[0]), wi + 2.0**-24 * side * np.sign(turns[1])))
        values = function(*(np.concatenate(part) for part in zip(*moved, strict=True))).reshape(-1, 3, *value.shape)
        change = np.abs(values - value)
        slope, step = np.maximum(slope, change[:, 0].max(0)), np.maximum(step, change[:, 1:].max((0, 1)))
    return np.where(step > 4.0 * ALLOWED * slope, step, ALLOWED * slope)


def beyond_rounding(
    a: np.ndarray,
    b: np.ndarray,
    function: Callable[..., np.ndarray],
    wo: np.ndarray,
    wi: np.ndarray,
    floor: float | np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """The relative difference of a and b, (N, channels), beyond the effect of rounding the directions on `function`.

    Rounding is not considered for pairs whose difference is below a hundredth of the tolerance. Pairs above the
    tolerance are examined again with more changes of direction, because four may miss the steepest change of a value.

    floor  smallest value by which differences are divided
    """
    error = relative(a, b, 0.0, floor)
    for seed, times, least in ((0, ROUNDINGS, MINOR * tolerance), (1, CLOSER, tolerance)):
        over = np.flatnonzero(error.max(1) > least)
        if not len(over) or (times == CLOSER and len(over) >= len(error) // 100):
            break
        noise = rounding(function, wo[over], wi[over], seed, times)
        there = floor[over] if isinstance(floor, np.ndarray) else floor
        error[over] = np.minimum(error[over], relative(a[over], b[over], noise, there))
    return error


def relative(
    a: np.ndarray, b: np.ndarray, noise: np.ndarray | float = 0.0, floor: np.ndarray | float = 0.0
) -> np.ndarray:
    """(|a - b| - noise) / max(|a|, |b|, floor), clamped to >= 0."""
    size = np.maximum(np.maximum(np.abs(a), np.abs(b)), floor)
    return np.maximum(np.abs(a - b) - noise, 0.0) / np.where(size > 0.0, size, 1.0)


def worst_of(error: np.ndarray) -> tuple[int, float]:
    """The index and the size of the largest error in an array (N,) or (N, channels), where NaN counts as infinite."""
    flat = np.where(np.isfinite(error), error, np.inf)
    flat = flat if flat.ndim == 1 else flat.max(1)
    row = int(np.argmax(flat)) if len(flat) else 0
    return row, float(flat[row]) if len(flat) else 0.0


def angles(w: np.ndarray) -> str:
    """theta and phi of a direction in degrees, as text."""
    theta, phi = directions.angles(w)
    return f"{theta:.4g}, {phi:.4g}"


def pair_in_words(wo: np.ndarray, wi: np.ndarray) -> str:
    """The angles of both directions in degrees, as text."""
    return f"wo at {angles(wo)}; wi at {angles(wi)} degrees"
