"""Confidence intervals from the profile of the sum of squares, for use where the profile is not a parabola, as standard
errors assume.

The profile of a parameter at x is the smallest sum of squares of all fits in which the parameter is x (Venzon1988). Its
95 % interval is the set of x at which the profile is less than

    t^2 s

above the minimum, where t is the quantile of Student's distribution, J is the Jacobian of the residuals, V is the
covariance of the parameters and s = V_kk / (J^T J)^-1_kk for parameter k. s is the variance of correlated residuals of
unequal size, relative to that of independent residuals of size 1: for a parabola, the ends are value +- t sqrt(V_kk),
as for the standard error. Profiles that are not parabolas arise in three cases: an index of refraction of 1, where the
derivative of the reflectance is 0, so that J^T J does not constrain the index; a value at a bound of its range; and a
lobe width for which the data determine only one bound.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..measure.tables.base import Floats
from .certainty import Certainty, connected
from .parameters import ranges
from .solver import Residuals, solve

STEPS = 6  # solver steps per point of a profile, starting at the solution for the previous point
POINTS = 14  # points of a profile on each side
NEAR = 0.005  # relative error of the square root of the rise at which an end is accepted
UNEQUAL = 0.3  # relative difference of the rises at the two ends above which a profile is computed
FIRST = 0.02  # first step from a value with an infinite standard error, relative to its range, or to itself
ALIKE = 0.999  # correlation above which parameters count as one: a profile along their valley is slow and useless
EXACT = 1e-3  # RMS residual below which 32-bit rounding hides the rise of a sum over many values
LARGE = 4e6  # number of derivatives above which only parameters with an infinite standard error have a profile
SPAN = 100.0  # range of a parameter whose bounds are far apart, in units of the larger of 1 and its value


class Costs(Residuals, Protocol):
    """A least-squares problem whose sum of squares can be evaluated without derivatives."""

    def cost(self, numbers: Floats) -> float: ...


def profiles(
    problem: Costs, numbers: Floats, cost: float, sure: Certainty, quantiles: Floats, scale: float, large: bool
) -> Floats:
    """Ends of the 95 % intervals of parameters for which value +- t error is not valid, (K, 2); NaN for the others.

    Parameters of which the data determine only a combination, or nearly so, have no profile (NaN). In a large problem,
    only parameters with an infinite standard error have one, because each profile solves the problem about fifty times.

    numbers    solution, (K,)
    cost       its sum of squares
    sure       standard errors and the pseudoinverse of J^T J
    quantiles  quantiles of Student's distribution, (K,)
    large      whether the problem is large: more than `LARGE` derivatives, or tables to compute in each step
    scale      mean squared residual, used as s if the data determine no parameter; otherwise, the median s is used for
               an undetermined parameter
    """
    low, high, ratio = ranges(problem.free)
    ends = np.full((len(numbers), 2), np.nan)
    if scale < EXACT**2:
        return ends
    known = np.isfinite(sure.errors) & (np.diag(sure.inverse) > 0.0)
    alike = connected(np.abs(sure.coupling) > ALIKE)
    tied = {k for group in (*sure.undetermined, *alike) if len(group) > 1 for k in group}
    own = np.divide(np.diag(sure.covariance), np.diag(sure.inverse), where=known, out=np.full(len(numbers), scale))
    own[~known] = np.median(own[known]) if known.any() else scale
    for k in range(len(numbers)):
        if k in tied:
            continue
        rise = quantiles[k] ** 2 * own[k]
        half = quantiles[k] * sure.errors[k]
        if not 0.0 < rise < np.inf or (known[k] and (large or _is_even(problem, numbers, k, half, sure.inverse, cost))):
            continue
        step = half if known[k] else FIRST * (numbers[k] if ratio[k] else _span(numbers[k], low[k], high[k]))
        for side, bound in ((0, low[k]), (1, high[k])):
            ends[k, side] = _end(problem, numbers, k, bound, step, cost + rise, cost)
    return ends


def _span(value: float, low: float, high: float) -> float:
    """Unit of length for a parameter: the length of its range, or a multiple of its value if the bounds are far
    apart."""
    return float(min(high - low, SPAN * max(1.0, abs(value))))


def _is_even(problem: Costs, numbers: Floats, k: int, half: float, inverse: Floats, cost: float) -> bool:
    """Whether the ends of value +- half lie within the range and the sum of squares rises equally toward both; the
    other parameters are moved along the valley of the parabola."""
    low, high, _ = ranges(problem.free)
    direction = inverse[:, k] / inverse[k, k]
    ends = [numbers - half * direction, numbers + half * direction]
    if any(not low[k] <= end[k] <= high[k] for end in ends):
        return False
    below, above = (problem.cost(np.clip(end, low, high)) - cost for end in ends)
    return bool(abs(above - below) <= UNEQUAL * abs(above + below) / 2.0)


def _end(problem: Costs, numbers: Floats, k: int, bound: float, step: float, level: float, cost: float) -> float:
    """Value of parameter k on the side of `bound` at which the profile reaches `level`; the bound if it does not."""
    if numbers[k] == bound:
        return bound
    sign = np.sign(bound - numbers[k])
    rise = level - cost
    inside, start, outside = 0.0, numbers, np.inf
    roots = [(0.0, 0.0)]  # distances, and sqrt(rise / required rise), which is nearly linear and 1 at the end
    distance = min(step, abs(bound - numbers[k]))
    for _ in range(POINTS):
        at = start.copy()
        at[k] = numbers[k] + sign * distance
        solution = solve(problem, at, steps=STEPS, tolerance=1e-3 * rise / max(cost, rise), held=(k,))
        root = float(np.sqrt(max(solution.cost - cost, 0.0) / rise))
        if abs(root - 1.0) < NEAR or (root < 1.0 and at[k] == bound):
            return float(at[k])
        roots.append((distance, root))
        if root < 1.0:
            inside, start = distance, solution.numbers
        else:
            outside = distance
        distance = _next(roots, inside, outside, abs(bound - numbers[k]))
    return float(numbers[k] + sign * distance)


def _next(roots: list[tuple[float, float]], inside: float, outside: float, most: float) -> float:
    """The next distance, from the secant through the last two points, limited to the interval that contains the end."""
    (a, fa), (b, fb) = sorted(roots)[-2:] if not np.isfinite(outside) else _bracket(roots, inside, outside)
    guess = b + (1.0 - fb) * (b - a) / (fb - fa) if fb > fa else np.inf
    if not np.isfinite(outside):
        return float(min(np.clip(guess, 1.2 * b, 4.0 * b), most))
    margin = 0.05 * (outside - inside)
    return float(np.clip(guess, inside + margin, outside - margin))


def _bracket(roots: list[tuple[float, float]], inside: float, outside: float) -> list[tuple[float, float]]:
    return [one for one in roots if one[0] == inside][-1:] + [one for one in roots if one[0] == outside][-1:]
