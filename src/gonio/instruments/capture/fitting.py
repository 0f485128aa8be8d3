"""Fit a material to pixels, together with the errors of the calibration.

These are the errors of the position of the ball, and of the directions and intensities of the lamps. Their priors are
the standard deviations that the calibration states.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...catalog.material import MaterialLike
from ...fitting import fit as tables
from ...fitting.certainty import undetermined_groups
from ...fitting.data import Data
from ...fitting.fit import Fit
from ...fitting.parameters import ranges, start_of, with_values
from ...fitting.solver import solve
from .calibration import Floats, Uncertainty
from .pixels import Chosen, Pixels, Scene, directions
from .problem import Faults, Problem, across, inverse_of, middle_of

FEW = 12_000  # number of pixels for the first steps; the last steps use all pixels
LEAST_NOISE = 1e-4  # lower bound of the relative noise, which avoids a division by 0
CERTAIN = 20.0  # signal-to-noise ratio above which a pixel is used for estimating the remaining noise
MEDIAN_CHI2 = 0.454936  # median of a squared standard normal variable

__all__ = ["Faults", "Fitted", "Problem", "across", "fitted", "inverse_of", "middle_of"]


@dataclass(frozen=True)
class Fitted:
    """A material fitted to photographs.

    fit      the fit, of the same type as the result of `go.fit`
    faults   calibration errors by name: (estimate, standard error), in units of the stated standard deviations
    noise    mean standard deviation of the pixels from the fit, divided by their mean
    problem  the solved problem
    numbers  the solution of the problem, as numbers
    """

    fit: Fit
    faults: Mapping[str, tuple[float, float]]
    noise: float
    problem: Problem
    numbers: Floats


def fitted(
    scene: Scene,
    chosen: Chosen,
    model: MaterialLike,
    stated: Uncertainty,
    *,
    fixed: Mapping[str, object] | None = None,
    free: Sequence[str] = (),
) -> Fitted:
    """Fit a model to the chosen pixels together with the calibration errors.

    stated  standard deviations of the calibration
    fixed   values of parameters that stay fixed, by path
    free    paths of parameters to fit that are fixed by default
    """
    started = time.perf_counter()
    few = _some(chosen, FEW)
    plain, moving = tables.moving_of(model, fixed=fixed, free=free)
    material = tables.fit(_data(scene, few), model, param=fixed, free=free).material
    faults = Faults.of(stated, scene)

    problem = Problem(material, moving, scene, few, faults)
    numbers = np.concatenate([start_of(material, moving), np.zeros(len(problem.open))])
    numbers = _solve_reweighted(problem, numbers)
    low, high, _ = ranges(problem.free)
    ended = (numbers <= low) | (numbers >= high)
    if ended.any():  # the slope may be 0 at a bound, such as an index of 1, so start again from the values of the model
        other = np.where(ended, np.concatenate([start_of(plain, moving), np.zeros(len(problem.open))]), numbers)
        problem.reweigh(numbers)
        other = solve(problem, other, steps=20).numbers
        if solve(problem, other, steps=0).cost < solve(problem, numbers, steps=0).cost:
            numbers = _solve_reweighted(problem, other)
    full = Problem(material, moving, scene, chosen.parts, faults, problem.noise)
    full.reweigh(numbers)
    full.alike = _alike(full, numbers)
    full.reweigh(numbers)
    # a change by one standard error changes the sum of squares by 1, which is little compared to the total
    numbers = solve(full, numbers, steps=6, tolerance=1e-10).numbers
    full.noise = _noise(full, numbers)
    full.reweigh(numbers)
    return _result(full, numbers, started)


def _solve_reweighted(problem: Problem, numbers: Floats) -> Floats:
    """Minimize the sum of squares, and repeatedly update the weights from the predicted values and the noise from the
    residuals."""
    for _ in range(3):
        problem.reweigh(numbers)
        numbers = solve(problem, numbers, steps=12).numbers
        problem.noise = _noise(problem, numbers)
    return numbers


def _some(chosen: Chosen, count: int) -> list[Pixels]:
    """A uniformly random subset of about `count` pixels, in their original order."""
    share = count / max(len(chosen), 1)
    rng = np.random.default_rng(17)
    return [part.at(np.flatnonzero(rng.random(len(part)) < share)) if share < 1.0 else part for part in chosen.parts]


def _data(scene: Scene, parts: Sequence[Pixels]) -> Data:
    """Convert pixels to pairs of directions and values of f cos theta_i."""
    views = [directions(scene, part.kind, part.place, part.lamp) for part in parts]
    value = [
        part.value * square[:, None] / scene.intensities[part.lamp]
        for part, (_, _, square) in zip(parts, views, strict=True)
    ]
    tiles = np.unique(np.concatenate([part.tile for part in parts]), return_inverse=True)[1]
    return Data(
        np.concatenate([wo for wo, _, _ in views]),
        np.concatenate([wi for _, wi, _ in views]),
        np.concatenate(value),
        tiles,
    )


def _noise(problem: Problem, numbers: Floats) -> float:
    """The relative standard deviation of pixels from the prediction, without photon, read and quantization noise.

    It is chosen so that half of the bright pixels lie within the quartiles of their predicted distribution.
    """
    squares, variances = [], []
    for part, off, predicted in problem.off(numbers):
        bright = predicted > 1e-3 * float(np.percentile(predicted, 99.0))
        squares.append((off / np.where(bright, predicted, 1.0))[bright] ** 2)
        variances.append(part.variance(predicted)[bright] / predicted[bright] ** 2)
    square, variance = np.concatenate(squares), np.concatenate(variances)
    if not len(square):
        return LEAST_NOISE
    # the most precise pixels, if there are enough of them
    told = variance <= max(1.0 / CERTAIN**2, float(np.quantile(variance, 0.1)))
    square, variance = square[told], variance[told]
    low, high = LEAST_NOISE**2, max(float(square.max()), LEAST_NOISE**2) * 4.0
    if np.median(square / (low + variance)) <= MEDIAN_CHI2:
        return LEAST_NOISE
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if np.median(square / (middle + variance)) > MEDIAN_CHI2 else (low, middle)
    return float(np.sqrt(high))


def _alike(problem: Problem, numbers: Floats) -> float:
    """The variance of the scores of tiles, divided by the variance for independent errors of pixels; at least 1."""
    hessian, spread = problem.information(numbers)
    hessian, spread = hessian[: problem.own, : problem.own], spread[: problem.own, : problem.own]
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    inverse = np.linalg.pinv(hessian / np.outer(scale, scale), rcond=1e-9)
    return max(1.0, float(np.trace(inverse @ (spread / np.outer(scale, scale)))) / problem.own)


def _result(problem: Problem, numbers: Floats, started: float) -> Fitted:
    hessian, spread = problem.information(numbers)
    prior = problem.prior()
    inverse = inverse_of(hessian + prior)
    # the sandwich estimator (Liang1986) with the priors
    covariance = inverse @ (spread + prior) @ inverse
    # if there are few tiles per parameter, residuals are too small, so the pixel noise is a lower bound
    variance = np.maximum(np.diag(covariance), np.diag(inverse))
    undetermined = undetermined_groups(hessian + prior)
    variance[[number for group in undetermined for number in group]] = np.inf
    errors = np.sqrt(variance)
    own = slice(0, problem.own)
    correlation = _correlation(covariance[own, own])
    material = with_values(problem.material, problem.moving, numbers[own])
    names = tuple(name for one in problem.moving for name in one.names)
    shown = problem.off(numbers)
    off = np.concatenate([difference for _, difference, _ in shown])
    size = np.concatenate([np.abs(part.value) for part, _, _ in shown])
    mean = float(np.mean((off / np.maximum(np.concatenate([p for _, _, p in shown]), 1e-12)) ** 2))
    runs = int(np.count_nonzero(np.bincount(np.concatenate([part.tile for part, _, _ in shown]))))
    unknown = ~np.isfinite(errors[own])
    notes = tables.notes_on(problem.moving, numbers[own], unknown, _apart(problem, hessian), names, undetermined)
    fit = Fit(
        material,
        names,
        numbers[own],
        errors[own],
        correlation,
        "relative",
        float(np.sqrt(mean)),
        float(np.abs(off).sum() / max(float(size.sum()), 1e-30)),
        float(3 * runs * np.log(max(mean, 1e-300)) + problem.own * np.log(3 * runs)),
        len(off),
        tuple(notes),
        time.perf_counter() - started,
        _data(problem.scene, _some(Chosen(tuple(problem.parts), {}), FEW)),
    )
    faults = zip(problem.open, numbers[problem.own :], errors[problem.own :], strict=True)
    of_faults = {name: (float(v), float(e)) for name, v, e in faults}
    return Fitted(fit, of_faults, problem.relative_spread(numbers), problem, numbers)


def _correlation(covariance: Floats) -> Floats:
    size = np.sqrt(np.where(np.diag(covariance) > 0.0, np.diag(covariance), 1.0))
    matrix = covariance / np.outer(size, size)
    np.fill_diagonal(matrix, 1.0)
    return np.asarray(matrix)


def _apart(problem: Problem, hessian: Floats) -> Floats:
    """The correlations of the material's parameters for exact intensities.

    Errors of the intensities would correlate all parameters that affect brightness.
    """
    bright = ["intensity" in name or name == "scale" for name in problem.open]
    columns = np.flatnonzero([True] * problem.own + [not one for one in bright])
    inverse = inverse_of((hessian + problem.prior())[np.ix_(columns, columns)])
    return _correlation(inverse[: problem.own, : problem.own])
