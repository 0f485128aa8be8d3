"""Fit a material to measurements."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import renamed
from ..catalog import notation
from ..catalog.material import MaterialLike
from ..errors import InputError, MachineError
from ..files import write_whole
from ..material import BSDF
from ..materials.measured.measured import Measured
from ..measure import read
from ..measure.tables.base import Floats, Measurement
from ..measure.tables.samples import Samples
from ..owner import public
from .certainty import certainty, connected, degrees_of_freedom, information
from .data import GRAZING, Data, data_of
from .models import modeled as modeled
from .models import moving_of as moving_of
from .models import moving_with_notes
from .parameters import NAMES, Free, ranges, with_values
from .profiles import LARGE, profiles
from .solver import METRICS, Problem, Solution, solve
from .starts import between, starts_of

FEW = 6000  # number of values on which starting points are compared
SOME = 60_000  # number of values on which the best solutions are refined
SOLVED = 8  # number of starting points that are refined with the metric itself on few values
TABULATED = 4  # number of starting points for a material that computes tables in each step
ENDS = 3  # number of solutions that are refined to convergence
SAME = 1e-4  # relative difference of costs above which two solutions count as distinct
INSIDE = (0.1, 0.5)  # fractions of a range to which numbers at its ends are moved
NORMAL_95 = 1.96
MANY = 1e6  # degrees of freedom above which the distribution is treated as normal
COLUMNS = ("value", "error", "low", "high")  # columns of a fit as a table
TIED = 0.98  # correlation above which two parameters are reported

Pairs = tuple[ArrayLike, ArrayLike, ArrayLike]  # wo, wi, f


@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    material     the material with the fitted values
    names        names of the fitted numbers: "alpha", "eta.r", ...
    values       fitted numbers, (K,)
    errors       standard errors, (K,); inf for numbers that the data do not determine
    correlation  (K, K)
    metric       name of the loss
    error        root mean square residual in that metric; for "relative", of the deviance
    relative     mean |difference| divided by the mean value of f cos theta_i
    criterion    Bayesian information criterion: lower is better; it penalizes additional parameters
    count        number of fitted values
    notes        remarks on the quality of the fit
    seconds      duration of the fit
    ranges       (K, 2), the smallest and the largest allowed value of each number; None if unbounded
    degrees      (K,), effective degrees of freedom of the standard errors; None for many
    profiles     (K, 2), ends of the 95 % intervals from the profile of the loss where value +- error is not valid, NaN
                 elsewhere; None if value +- error is valid for all numbers
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
    ranges: Floats | None = None
    degrees: Floats | None = None
    profiles: Floats | None = None

    @property
    def half_widths(self) -> Floats:
        """Half widths of the symmetric 95 % intervals, (K,), from Student's t distribution if few runs of neighbors
        determine a number."""
        return quantiles(self.degrees) * self.errors

    @property
    def interval(self) -> Floats:
        """95 % intervals within the parameters' ranges, (K, 2); infinite for numbers that the data do not determine."""
        ends = np.stack([self.values - self.half_widths, self.values + self.half_widths], axis=1)
        if self.profiles is not None:
            ends = np.where(np.isfinite(self.profiles), self.profiles, ends)
        return ends if self.ranges is None else np.clip(ends, self.ranges[:, :1], self.ranges[:, 1:])

    @property
    def determined(self) -> NDArray[np.bool_]:
        """Whether the data constrain each number to a finite interval, (K,)."""
        told = np.isfinite(self.errors)
        return told if self.profiles is None else told | np.isfinite(self.profiles).all(axis=1)

    @property
    def text(self) -> str:
        """Notation of the material, accepted by every command: "sum(a=lambert(albedo=...),b=conductor(...))"."""
        return notation.written(self.material)

    def as_dict(self) -> dict[str, Any]:
        """Dictionary for JSON; unknown errors are null. `notation` is the material as written in scene files, or null
        if it cannot be written there."""
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
                name: {
                    "value": float(v),
                    "error": float(e) if np.isfinite(e) else None,
                    "interval": [float(x) for x in ends] if told else None,
                }
                for name, v, e, ends, told in zip(
                    self.names, self.values, self.errors, self.interval, self.determined, strict=True
                )
            },
            "correlation": [[round(float(x), 4) for x in row] for row in self.correlation],
            "notes": list(self.notes),
        }

    def to_frame(self) -> Any:
        """The fitted numbers as a pandas DataFrame: value, error, low and high of the 95 % interval, by name.

        Raises MachineError if pandas is not installed; `to_csv` does not need it.
        """
        try:
            import pandas
        except ImportError:
            raise MachineError("pandas is not installed", "Fit.to_frame", "pip install pandas, or use to_csv") from None
        columns = dict(zip(COLUMNS, (self.values, self.errors, *self.interval.T), strict=True))
        return pandas.DataFrame(columns, index=list(self.names))

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """The table of `to_frame` as comma-separated text, which is also written to a file if one is given."""
        rows = zip(self.names, self.values, self.errors, *self.interval.T, strict=True)
        lines = [",".join((name, *(repr(float(x)) for x in numbers))) for name, *numbers in rows]
        text = "\n".join([",".join(("name", *COLUMNS)), *lines]) + "\n"
        if path is not None:
            write_whole(Path(path), text.encode())
        return text

    def __str__(self) -> str:
        lines = [f"{self.text}: {self.error:.4g} ({self.metric}), {100.0 * self.relative:.3g} % off"]
        lines += [
            f"  {n} = {v:.5g}, {low:.5g} to {high:.5g}" if told else f"  {n} = {v:.5g}, not determined by the data"
            for n, v, (low, high), told in zip(self.names, self.values, self.interval, self.determined, strict=True)
        ]
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


def quantiles(degrees: Floats | None) -> Floats:
    """Quantile of Student's t distribution for 95 % intervals, (K,) or ()."""
    from scipy import special  # imported here because most runs do not fit anything

    return np.asarray(special.stdtrit(MANY if degrees is None else np.minimum(degrees, MANY), 0.975))


@renamed(metric="loss", fixed="param")
@public
def fit(
    data: str | os.PathLike[str] | Measurement | Measured | Data | Pairs,
    model: MaterialLike = "conductor",
    *,
    lobes: int = 1,
    loss: str = "relative",
    param: Mapping[str, object] | None = None,
    free: Sequence[str] = (),
    grazing: float = GRAZING,
    progress: Callable[[str], None] = lambda text: None,
) -> Fit:
    """Fit the parameters of a material to measured values.

        result = go.fit("gold.binary", "lambert+ggx")
        result.material, result.values, result.errors

    data      a measurement file, a table, a `go.Measured`, `Data`, or three arrays (wo, wi, f): unit vectors (N, 3)
              above the surface, z up, and the BRDF (N,) or (N, 3) in 1/sr without the cosine
    model     anything that `go.material` accepts, such as the sum "lambert+ggx"; the fit starts from its parameter
              values
    lobes     number of copies of the last term of the sum
    loss      "relative", "log", "log1p" (Low2012), "cuberoot" or "linear" (Ngan2005)
    param     path -> value of parameters that stay fixed
    free      paths of additional parameters to fit that are fixed by default: scale factors of 1
    grazing   degrees; values with a direction beyond this angle from the normal are excluded
    progress  called with a message that states the loss, after each start and at the end
    The solver applies the Levenberg-Marquardt method from several starting points with different lobe widths, first to
    subsets and finally to all values. Raises InputError for invalid files, models and paths.
    """
    started = time.perf_counter()
    if loss not in METRICS:
        raise InputError(f"unknown metric '{loss}'", "loss", " | ".join(METRICS))
    material, moving, notes = moving_with_notes(model, lobes, param, free)
    where = os.fspath(data) if isinstance(data, (str, os.PathLike)) else "fit: data"
    cells = data if isinstance(data, Data) else data_of(_table_of(data), grazing, where)
    middle = Problem(material, moving, cells.some(SOME), loss)
    best = _best(middle, starts_of(material, moving), progress)
    full = middle
    if len(cells) > SOME:
        full = Problem(material, moving, cells, loss, middle.floor, middle.floors)
        best = solve(full, best.numbers, steps=2)
    progress(f"all {len(cells)} values: {np.sqrt(best.cost / (3 * len(cells))):.4g}")
    return _result(full, best, loss, time.perf_counter() - started, notes)


def _table_of(data: object) -> Measurement:
    """The table in a file, or of a material. Raises InputError for anything else."""
    if isinstance(data, Measurement):
        return data
    if isinstance(data, Measured):
        return data.table
    if isinstance(data, (str, os.PathLike)):
        return read(data)
    if isinstance(data, (tuple, list)) and len(data) == 3:
        wo, wi, f = data
        return Samples.of_pairs(wo, wi, f, "fit: data")
    what = f"{type(data).__name__} given, a file of measured values, a table or three arrays expected"
    raise InputError(what, "fit: data", 'such as go.fit("gold.binary") or go.fit((wo, wi, f))')


def _best(problem: Problem, starts: Sequence[Floats], progress: Callable[[str], None]) -> Solution:
    """The solution with the lowest cost over all starts. All starts are refined on few values with the logarithmic
    metric, which is smooth everywhere; the best of these are refined with the metric itself, and the best distinct
    solutions are then refined on all values."""
    data = problem.data.some(FEW)
    few = _with_data(problem, data, problem.name)
    rough = _with_data(problem, data, "log") if problem.name == "relative" else few
    if problem.tabulated:
        starts = sorted(starts, key=few.cost)[:TABULATED]
    begins: list[Floats] = []
    for start in starts:
        end = solve(rough, start, steps=12, tolerance=1e-3).numbers
        # the logarithm ignores values below its floor, so its solution may be worse than the start
        begins.append(min((end, start), key=few.cost))
        progress(f"start {len(begins)}: {np.sqrt(few.cost(begins[-1]) / max(3 * len(data), 1)):.4g}")
    begins.sort(key=few.cost)
    tried = sorted((solve(few, one, steps=12, tolerance=1e-3) for one in begins[:SOLVED]), key=lambda one: one.cost)
    different = [tried[0]]
    for one in tried[1:]:
        if all(abs(one.cost / max(other.cost, 1e-300) - 1.0) > SAME for other in different):
            different.append(one)
    ends = [solve(problem, one.numbers, steps=40) for one in different[:ENDS]]
    return _off_bounds(problem, few, min(ends, key=lambda one: one.cost))


def _off_bounds(problem: Problem, few: Problem, best: Solution) -> Solution:
    """A better solution whose numbers are not at the ends of their ranges, if there is one.

    The derivative with respect to an index of refraction is 0 at an index of 1, so a number that a step sets to 1 never
    changes again. The numbers at an end are moved inside, one at a time and all together, and the fit is repeated,
    first on few values.
    """
    low, high, _ = ranges(problem.free)
    stuck: list[int] = np.flatnonzero((best.numbers <= low) | (best.numbers >= high)).tolist()
    if not stuck:
        return best
    begun = best.numbers
    cost = solve(few, begun, steps=12, tolerance=1e-3).cost * (1.0 - SAME)
    for group, share in itertools.product([*([k] for k in stuck), stuck], INSIDE):
        moved = begun.copy()
        moved[group] = between(problem.free, share)[group]
        rough = solve(few, moved, steps=12, tolerance=1e-3)
        if rough.cost < cost:
            cost = rough.cost * (1.0 - SAME)
            best = min(best, solve(problem, rough.numbers, steps=40), key=lambda one: one.cost)
    return best


def _with_data(problem: Problem, data: Data, metric: str) -> Problem:
    """The same problem on other data, with unchanged floors."""
    return Problem(problem.material, problem.free, data, metric, problem.floor, problem.floors)


def _result(problem: Problem, best: Solution, metric: str, seconds: float, notes: Sequence[str]) -> Fit:
    data, numbers, cost = problem.data, best.numbers, best.cost
    parts = problem.linearized(numbers)
    hessian, scores = information(parts, data.row, problem.count)
    runs = max(int(np.count_nonzero(np.bincount(data.row))), 1)
    sure = certainty(hessian, scores * np.sqrt(runs / max(runs - problem.count, 1)))
    names = tuple(name for one in problem.free for name in one.names)
    material = with_values(problem.material, problem.free, numbers)
    value = material.eval(data.wo, data.wi)
    relative = float(np.abs(value - data.value).mean() / max(float(np.abs(data.value).mean()), 1e-30))
    mean = cost / max(3 * len(data), 1)
    degrees = degrees_of_freedom(parts, data.row, sure.inverse)
    large = problem.tabulated or 3 * len(data) * len(numbers) > LARGE
    ends = profiles(problem, numbers, cost, sure, quantiles(degrees), mean, large)
    unknown = ~(np.isfinite(sure.errors) | np.isfinite(ends).all(axis=1))
    told = notes_on(problem.free, numbers, unknown, sure.coupling, names, sure.undetermined)
    return Fit(
        material,
        names,
        numbers,
        sure.errors,
        sure.correlation,
        metric,
        float(np.sqrt(mean)),
        relative,
        float(3 * runs * np.log(max(mean, 1e-300)) + len(numbers) * np.log(3 * runs)),
        len(data),
        (
            *notes,
            *told,
            *_notes_on_data(data),
        ),
        seconds,
        data,
        np.array([(one.low, one.high) for one in problem.free for _ in range(one.count)]).reshape(-1, 2),
        degrees,
        ends,
    )


def notes_on(
    free: Sequence[Free],
    numbers: Floats,
    unknown: NDArray[np.bool_],
    coupling: Floats,
    names: tuple[str, ...],
    undetermined: Sequence[Sequence[int]] = (),
) -> list[str]:
    """Remarks that help to assess the fitted values.

    unknown       whether the data do not determine a parameter, (K,)
    coupling      correlations of the parameters for independent errors
    undetermined  groups of parameter indices of which the data determine at most a combination
    """
    notes, at = [], 0
    for group in undetermined:
        if len(group) > 1:
            notes.append(f"the data determine only a combination of {_listed(names, group)}: fix one of them")
    together = {k for group in undetermined if len(group) > 1 for k in group}
    for one in free:
        for k in range(at, at + one.count):
            if unknown[k] and k not in together:
                notes.append(f"the data do not determine {names[k]}")
            elif numbers[k] <= one.low or numbers[k] >= one.high:
                notes.append(f"{names[k]} ends at {numbers[k]:.4g}, a bound of its range")
        at += one.count
    size = np.where(unknown[:, None] | unknown, 0.0, np.abs(coupling))
    for group in (one for one in connected(size > TIED) if len(one) > 1):
        pair = max(itertools.combinations(group, 2), key=lambda two: size[two])
        which = "correlation" if len(group) == 2 else "largest correlation"
        notes.append(f"{_listed(names, group)} are strongly correlated ({which} {coupling[pair]:.3f}): fix one of them")
    return notes


def _listed(names: Sequence[str], group: Sequence[int]) -> str:
    return ", ".join(names[k] for k in group[:-1]) + f" and {names[group[-1]]}"


def _notes_on_data(data: Data) -> list[str]:
    """Remarks on the measured values."""
    notes = []
    if data.negative.any():
        share = ", ".join(f"{name} {100.0 * n / len(data):.2g} %" for name, n in zip(NAMES, data.negative, strict=True))
        notes.append(f"{int(data.negative.sum())} of {3 * len(data)} values are negative ({share})")
    dark = [name for name, largest in zip(NAMES, data.value.max(axis=0), strict=True) if largest <= 0.0]
    if dark and len(dark) < len(NAMES):
        notes.append(
            f"no value of {' and '.join(dark)} is positive: shared parameters are determined by the other channels"
        )
    for why in ("saturated", "not finite"):
        if why in data.out:
            notes.append(f"{data.out[why]} of {len(data) + sum(data.out.values())} values are {why} and excluded")
    return notes


def ranked(fits: Sequence[Fit]) -> list[Fit]:
    """The fits sorted by the criterion, best first."""
    return sorted(fits, key=lambda one: one.criterion)
