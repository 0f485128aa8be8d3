"""A material fitted to measurements."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..catalog import notation
from ..errors import InputError
from ..material import BSDF, tree
from ..materials.combined.sum import Sum
from ..measure import read
from ..measure.tables.base import Floats, Measurement
from ..owner import public
from .data import GRAZING, Data, data_of
from .parameters import NAMES, Free, free_of, ranges, start_of, with_values
from .solver import METRICS, Problem, Solution, covariance, solve

FEW = 6000  # values from which starts are judged
SOME = 60_000  # from which the best start goes on
WIDTHS = (0.03, 0.1, 0.3, 0.7)  # of lobes, tried as starts
COLOURS = (0.5, 2.0)  # of colours without an upper end, such as indices, whose default may be a place without a slope
STARTS = 24  # tried at most
RANDOM = 6  # more, drawn at random
OPEN = 4.0  # how far numbers without an upper end are drawn
SOLVED = 8  # of them that are followed by the metric itself on a few values
ENDS = 3  # of them that are followed to their end
SAME = 1e-4  # relative difference of two costs from which on two ends are two
NORMAL_95 = 1.96
TIED = 0.98  # correlation from which two numbers are called tied
SHORT = {
    "ggx": "conductor(fresnel=schlick,eta=1.5,k=0)",
    "beckmann": "conductor(fresnel=schlick,eta=1.5,k=0,ndf=beckmann)",
}
FIXED = {"ggx": ("k",), "beckmann": ("k",)}
AT_LEAST = {"ggx": {"eta": 1.0}, "beckmann": {"eta": 1.0}}  # 1 / eta reflects as much


@dataclass(frozen=True)
class Fit:
    """What came of a fit.

    material     with the fitted values
    names        of the numbers that moved: "alpha", "eta.r", ...
    values       theirs, (K,)
    errors       standard errors, (K,): inf where the data do not tell
    correlation  (K, K)
    metric       on which differences were measured, error the root of their mean square on it (of "relative" ones of
                 the deviance, which is the same where they are small)
    relative     mean |difference| over mean value of f cos theta_i
    criterion    Bayesian information criterion: lower is better; more parameters cost
    count        values that were fitted to
    notes        what is odd about it
    seconds      that it took
    """

    material: BSDF
    names: tuple[str, ...]
    values: Floats
    errors: Floats
    correlation: Floats
    metric: str
    error: float
    relative: float
    criterion: float
    count: int
    notes: tuple[str, ...]
    seconds: float
    data: Data

    @property
    def interval(self) -> Floats:
        """95 % intervals, (K, 2)."""
        return np.stack([self.values - NORMAL_95 * self.errors, self.values + NORMAL_95 * self.errors], axis=1)

    @property
    def text(self) -> str:
        """The material as every verb takes it: "sum(a=lambert(albedo=...),b=conductor(...))"."""
        return notation.written(self.material)

    def as_dict(self) -> dict[str, Any]:
        """For JSON; an error that is not known is null. `notation` is the material as scenes and other files hold it;
        null where no file can."""
        return {
            "material": self.text,
            "notation": notation.for_files(self.material),
            "metric": self.metric,
            "error": self.error,
            "relative": self.relative,
            "criterion": self.criterion,
            "values": self.count,
            "negative": [int(count) for count in self.data.negative],
            "left_out": dict(self.data.out),
            "seconds": round(self.seconds, 3),
            "parameters": {
                name: {"value": float(v), "error": float(e) if np.isfinite(e) else None}
                for name, v, e in zip(self.names, self.values, self.errors, strict=True)
            },
            "correlation": [[round(float(x), 4) for x in row] for row in self.correlation],
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        lines = [f"{self.text}: {self.error:.4g} ({self.metric}), {100.0 * self.relative:.3g} % off"]
        lines += [
            f"  {n} = {v:.5g} +- {NORMAL_95 * e:.2g}"
            for n, v, e in zip(self.names, self.values, self.errors, strict=True)
        ]
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


class Model(NamedTuple):
    """What is fitted: a material, the paths that stay as they are, and others' least values."""

    material: BSDF
    fixed: tuple[str, ...] = ()
    least: Mapping[str, float] = {}


def modelled(text: str, lobes: int = 1) -> Model:
    """A model by name: "conductor", "lambert+ggx", "oren-nayar(sigma=.2)".

    lobes  how many of the last one are added up. "ggx" and "beckmann" are a microfacet lobe of that distribution with
    Schlick's Fresnel term of an index without absorption, so that colour is all in eta.
    """
    if lobes < 1:
        raise InputError(f"{lobes} lobes given, at least 1 expected", "lobes")
    parts = [part.strip() for part in text.split("+")]
    if not all(parts):
        raise InputError(f"'{text}' is no sum of materials", "model", 'such as "lambert+ggx"')
    parts += parts[-1:] * (lobes - 1)
    made: list[Model] = []
    for part in parts:
        head, bracket, rest = part.partition("(")
        spelled = SHORT.get(head, head)
        if bracket:
            own = spelled.partition("(")[2].rstrip(")")
            spelled = f"{spelled.partition('(')[0]}({','.join(filter(None, [own, rest.removesuffix(')')]))})"
        material = notation.named(spelled)[0]
        given = [name.partition("=")[0] for name in rest.removesuffix(")").split(",") if "=" in name]
        made.append(Model(material, (*FIXED.get(head, ()), *given), AT_LEAST.get(head, {})))
    whole = made[0]
    for other in made[1:]:
        fixed = (*(f"a.{path}" for path in whole.fixed), *(f"b.{path}" for path in other.fixed))
        least = {f"a.{p}": v for p, v in whole.least.items()} | {f"b.{p}": v for p, v in other.least.items()}
        whole = Model(Sum(whole.material, other.material), fixed, least)
    return whole


def moving_of(
    model: str | BSDF, lobes: int = 1, fixed: Mapping[str, object] | None = None, free: Sequence[str] = ()
) -> tuple[BSDF, list[Free]]:
    """A model with the values that `fixed` holds, and its parameters that move; as `fit` takes them."""
    material, stays, least = Model(model) if isinstance(model, BSDF) else modelled(model, lobes)
    given = dict(fixed or {})
    if given:
        texts = {path: value for path, value in given.items() if isinstance(value, str)}
        others = {path: value for path, value in given.items() if path not in texts}
        material = tree.replace(notation.changed(material, texts), others)
    moving = free_of(material, {**given, **dict.fromkeys(stays)}, tuple(free))
    return material, [replace(one, low=max(one.low, least.get(one.path, one.low))) for one in moving]


@public
def fit(
    data: str | os.PathLike[str] | Measurement | Data,
    model: str | BSDF = "conductor",
    *,
    lobes: int = 1,
    metric: str = "relative",
    fixed: Mapping[str, object] | None = None,
    free: Sequence[str] = (),
    grazing: float = GRAZING,
    progress: Callable[[str], None] = lambda text: None,
) -> Fit:
    """Fit a material's parameters to measured values.

        found = go.fit("gold.binary", "lambert+ggx")
        found.material, found.values, found.errors

    data     a file of measurements, a table, or `Data`
    model    a material, or its name, or a sum of names such as "lambert+ggx"; what it is set to is where the fit starts
    lobes    how many of the last part are added up
    metric   "relative", "log", "log1p" (Low2012), "cuberoot" or "linear" (Ngan2005)
    fixed    path -> value of parameters that stay
    free     paths of parameters that move although they stay by themselves: factors that are 1
    grazing  degrees: values beyond, of either direction, are left out
    Levenberg and Marquardt from several starts: the widths of lobes, ever more values as it goes on, at last all.
    Raises InputError for files, models and paths that are none.
    """
    started = time.perf_counter()
    if metric not in METRICS:
        raise InputError(f"unknown metric '{metric}'", "metric", " | ".join(METRICS))
    material, moving = moving_of(model, lobes, fixed, free)
    cells = (
        data if isinstance(data, Data) else data_of(read(data) if not isinstance(data, Measurement) else data, grazing)
    )
    middle = Problem(material, moving, cells.some(SOME), metric)
    best = _best(middle, _starts(material, moving), progress)
    whole = middle
    if len(cells) > SOME:
        whole = Problem(material, moving, cells, metric, middle.floor, middle.floors)
        best = solve(whole, best.numbers, steps=2)
    progress(f"all {len(cells)} values: {np.sqrt(best.cost / (3 * len(cells))):.4g}")
    return _result(whole, best, metric, time.perf_counter() - started)


def _best(problem: Problem, starts: Sequence[Floats], progress: Callable[[str], None]) -> Solution:
    """The least cost that starts lead to. All are followed on a few values by the logarithm, which is smooth from
    anywhere, then the best by the metric itself, at last the best that differ on all values."""
    data = problem.data.some(FEW)
    few = _with_data(problem, data, problem.name)
    rough = _with_data(problem, data, "log") if problem.name == "relative" else few
    begins: list[Floats] = []
    for start in starts:
        end = solve(rough, start, steps=12, tolerance=1e-3).numbers
        # the logarithm is blind to what its floor hides: where it leads is no better than its start at times
        begins.append(min((end, start), key=few.cost))
        progress(f"start {len(begins)}: {np.sqrt(few.cost(begins[-1]) / max(3 * len(data), 1)):.4g}")
    begins.sort(key=few.cost)
    tried = sorted((solve(few, one, steps=12, tolerance=1e-3) for one in begins[:SOLVED]), key=lambda one: one.cost)
    different = [tried[0]]
    for one in tried[1:]:
        if all(abs(one.cost / max(other.cost, 1e-300) - 1.0) > SAME for other in different):
            different.append(one)
    ends = [solve(problem, one.numbers, steps=40) for one in different[:ENDS]]
    return min(ends, key=lambda one: one.cost)


def _with_data(problem: Problem, data: Data, metric: str) -> Problem:
    """The same problem on other data, its floors as they are."""
    return Problem(problem.material, problem.free, data, metric, problem.floor, problem.floors)


def _starts(material: BSDF, free: list[Free]) -> list[Floats]:
    """Where to begin: as the material is, and at other widths of its lobes, each lobe its own, and other indices."""
    first = start_of(material, free)
    found = [first]
    open_ended = np.repeat([one.kind == "spectrum" and one.high > 1e5 for one in free], [one.count for one in free])
    firsts = [first, *(np.where(open_ended, value, first) for value in COLOURS if open_ended.any())]
    places = np.cumsum([0, *(one.count for one in free)])
    lobes = [int(at) for at, one in zip(places, free, strict=False) if one.kind == "alpha" or _exponent(one)]
    for widths in itertools.combinations_with_replacement(WIDTHS, len(lobes)):
        for begin in firsts:
            other = begin.copy()
            for at, width in zip(lobes, widths, strict=True):
                one = free[int(np.searchsorted(places, at, side="right")) - 1]
                value = width if one.kind == "alpha" else 2.0 / (width * width)  # a cosine's power of that width
                other[at] = np.clip(value, one.low, one.high)
            found.append(other)
    return found[:STARTS] + _random_starts(first, free)


def _random_starts(first: Floats, free: list[Free]) -> list[Floats]:
    """Where to begin beside: anywhere in the ranges of the numbers, those that are open as far as `OPEN`."""
    low, high, ratio = ranges(free)
    high = np.where(high > 1e5, np.maximum(OPEN, 2.0 * np.abs(first)), high)
    low = np.where(low < -1e5, -high, low)
    rng = np.random.default_rng(23)
    found = []
    for _ in range(RANDOM):
        share = rng.random(len(first))
        with np.errstate(divide="ignore", invalid="ignore"):
            found.append(np.where(ratio, low ** (1.0 - share) * high**share, low + share * (high - low)))
    return found


def _exponent(one: Free) -> bool:
    return one.kind == "float" and one.ratio and one.high >= 1e3


def _result(problem: Problem, best: Solution, metric: str, seconds: float) -> Fit:
    data, numbers, cost = problem.data, best.numbers, best.cost
    matrix = covariance(problem, numbers)
    errors = np.sqrt(np.diag(matrix))
    told = np.isfinite(errors) & (errors > 0.0)
    correlation = np.eye(len(numbers))
    correlation[np.ix_(told, told)] = matrix[np.ix_(told, told)] / np.outer(errors[told], errors[told])
    names = tuple(name for one in problem.free for name in one.names)
    material = with_values(problem.material, problem.free, numbers)
    value = material.eval(data.wo, data.wi)
    relative = float(np.abs(value - data.value).mean() / max(float(np.abs(data.value).mean()), 1e-30))
    runs = max(int(np.count_nonzero(np.bincount(data.row))), 1)
    mean = cost / max(3 * len(data), 1)
    return Fit(
        material,
        names,
        numbers,
        errors,
        correlation,
        metric,
        float(np.sqrt(mean)),
        relative,
        float(3 * runs * np.log(max(mean, 1e-300)) + len(numbers) * np.log(3 * runs)),
        len(data),
        (*notes_on(problem.free, numbers, errors, correlation, names), *_notes_on_data(data)),
        seconds,
        data,
    )


def notes_on(
    free: Sequence[Free], numbers: Floats, errors: Floats, correlation: Floats, names: tuple[str, ...]
) -> list[str]:
    """What a reader must know before the values are trusted."""
    notes, at = [], 0
    for one in free:
        for k in range(at, at + one.count):
            if not np.isfinite(errors[k]):
                notes.append(f"the data do not tell {names[k]}")
            elif numbers[k] <= one.low or numbers[k] >= one.high:
                notes.append(f"{names[k]} ends at {numbers[k]:.4g}, an end of its range")
        at += one.count
    size = np.abs(correlation)
    for i, j in itertools.combinations(range(len(names)), 2):
        if size[i, j] > TIED:
            notes.append(
                f"{names[i]} and {names[j]} are tied (correlation {correlation[i, j]:.3f}): fix one to tell the other"
            )
    return notes


def _notes_on_data(data: Data) -> list[str]:
    """What is odd about the values themselves."""
    notes = []
    if data.negative.any():
        share = ", ".join(f"{name} {100.0 * n / len(data):.2g} %" for name, n in zip(NAMES, data.negative, strict=True))
        notes.append(f"{int(data.negative.sum())} of {3 * len(data)} values are negative ({share})")
    for why in ("saturated", "not finite"):
        if why in data.out:
            notes.append(f"{data.out[why]} of {len(data) + sum(data.out.values())} places are {why} and left out")
    return notes


def ranked(fits: Sequence[Fit]) -> list[Fit]:
    """The best first, by the criterion."""
    return sorted(fits, key=lambda one: one.criterion)
