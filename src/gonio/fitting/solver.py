"""Nonlinear least squares by Levenberg and Marquardt, with derivatives from Dr.Jit.

One kernel evaluates the residuals of all data and their derivatives, in forward mode; of a color whose channels do not
mix in `eval`, one derivative serves all three. The normal equations are then sums over rows, which BLAS makes. A pass
over 1.46 million cells and six numbers moves some 70 MB, and is bound by that and by exp, log and sqrt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..material import BSDF
from ..measure.tables.base import Floats
from ..ops import backend
from .data import Data
from .parameters import CHANNELS, Free, ranges, start_of, with_drjit

Array = backend.Array
BLOCK = 1 << 16  # rows that BLAS sums in float32 at a time
SMALL = 1e-3  # of the largest value: where "log" and "relative" turn from relative to absolute
NEAR = 0.1  # relative difference under which a series is more accurate than the logarithm in float32


# --------------------------------------------------------------------------- metrics

METRICS = {
    "relative": "difference over the model's own value, which noise of the data cannot bias; its logarithm from 2 on",
    "log": "log(1 + f cos / c), c a thousandth of the brightest value in the data's median channel: nearly relative",
    "log1p": "log(1 + f cos), as Low2012",
    "cuberoot": "(f cos)^(1/3), near to what eyes see",
    "linear": "f cos itself, as Ngan2005",
}


def metric(name: str, value: Array, floor: Array) -> Array:
    """A value on the scale on which differences are measured, of one channel; for "relative" see `deviance`."""
    dr = backend.drjit()
    if name in ("linear", "relative"):
        return value
    if name == "cuberoot":
        size = dr.maximum(dr.abs(value), 1e-9)
        return dr.copysign(dr.exp(dr.log(size) / 3.0), value)
    return dr.copysign(dr.log(1.0 + dr.abs(value) / (1.0 if name == "log1p" else floor)), value)


def deviance(model: Array, value: Array, floor: Array) -> Array:
    """Residual r of a model f against a value v, r^2 = 2 rho, of the metric "relative".

    Least squares of (v - f) / (f + c), weighed by the model where it stands, solve sum((v - f) / (f + c)^2 df) = 0.
    These are the quasi-likelihood's equations for a standard deviation in proportion to f + c (Wedderburn1974), however
    the noise is distributed: they have the truth for a root if v is right in the mean. But nothing is minimized by
    them: a model of 0 has as good a root. What has that derivative is the deviance of the gamma distribution,

        rho = u - log(1 + u),  u = (v - f) / (f + c),

    which a model of 0 makes large. From u = 1 on (data twice the model, which noise does not make) rho is log(1 + u)
    plus a constant: its derivative stops there, as Huber's does (Huber1964), and as it stops at u = -1 by itself. So no
    value counts more than 1 / (f + c). A value under -c / 2 has v + c, at least 0, in the derivative as it is; the
    constant is that of -c / 2, since no model is negative.
    """
    dr = backend.drjit()
    size = dr.abs(model)
    nearest = dr.maximum(value, -0.5 * floor)
    share = dr.maximum(value + floor, 0.0) / (nearest + floor)
    u = (nearest - size) / (size + floor)
    small = dr.abs(u) < NEAR
    # 2 rho / u^2 = 2 sum of (-u)^k / (k + 2)
    s = dr.select(small, u, 0.0)
    series = 1.0 + s * (-2 / 3 + s * (1 / 2 + s * (-2 / 5 + s * (1 / 3 + s * (-2 / 7 + s / 4)))))
    b = dr.select(small, 1.0, u)
    logarithm = dr.log(1.0 + b)
    rho = dr.select(b > 1.0, logarithm + (1.0 - 2.0 * np.log(2.0)), share * b - logarithm)
    return dr.select(small, -s * dr.sqrt(series), -dr.copysign(dr.sqrt(2.0 * rho), b))


# --------------------------------------------------------------------------- residuals and their derivatives

# Residuals (N,), derivatives (N, K), and which numbers these are along
Linearized = tuple[NDArray[np.floating], NDArray[np.floating], list[int]]


class Residuals(Protocol):
    """What can be solved: numbers that move, and residuals with their derivatives, in parts."""

    free: list[Free]

    @property
    def count(self) -> int: ...
    def linearized(self, numbers: Floats) -> list[Linearized]: ...


@dataclass
class Problem:
    """Residuals of a material against data: metric(eval) - metric(value), channel by channel.

    material  what is fitted, free its parameters that move
    name      of the metric
    floor     value of "log" where it turns absolute; floors (3,) those of "relative", of each channel
    """

    material: BSDF
    free: list[Free]
    data: Data
    name: str = "log"
    floor: float = 0.0
    floors: Floats | None = None
    _given: tuple[Array, Array, list[Array]] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.name not in METRICS:
            raise InputError(f"unknown metric '{self.name}'", "metric", " | ".join(METRICS))
        if self.floor <= 0.0:
            self.floor = max(SMALL * float(np.percentile(np.abs(self.data.value), 99.0)), 1e-6)
        if self.floors is None:
            self.floors = floors_of(self.data.value)
        self.columns = self._of_parameters()

    def _of_parameters(self) -> list[list[int]]:
        """The numbers that one derivative is taken along: each alone, or the three of a color together."""
        dr, types = backend.drjit(), backend.types("float32")
        groups: list[list[int]] = []
        at = 0
        probe = self.data.some(64)
        wo, wi = (backend.vector_of(w, 3, types) for w in (probe.wo, probe.wi))
        for one in self.free:
            together = list(range(at, at + one.count))
            at += one.count
            if len(together) > 1:
                values = [backend.float_of(float(x), types) for x in start_of(self.material, self.free)]
                dr.enable_grad(values[together[0]])
                seen = with_drjit(self.material, self.free, values, types).eval(wo, wi)
                dr.forward_from(values[together[0]])
                others = np.abs([backend.to_numpy(dr.grad(seen[c]), len(probe)) for c in (1, 2)])
                if others.max() > 0.0:  # a color that acts as a whole, by its mean
                    groups += [[column] for column in together]
                    continue
            groups.append(together)
        return groups

    @property
    def count(self) -> int:
        return sum(map(len, self.columns))

    def _loaded(self, types: backend.Types) -> tuple[Array, Array, list[Array]]:
        if self._given is None:
            wo, wi = (backend.vector_of(w, 3, types) for w in (self.data.wo, self.data.wi))
            wanted = [
                metric(self.name, backend.float_of(self.data.value[:, c], types), self._floor(types))
                for c in range(CHANNELS)
            ]
            backend.drjit().eval(wo, wi, wanted)
            self._given = wo, wi, wanted
        return self._given

    def _floor(self, types: backend.Types) -> Any:
        return backend.float_of(self.floor, types)

    def _residual(self, values: Array, types: backend.Types) -> list[Array]:
        wanted = self._loaded(types)[2]
        if self.name == "relative":
            assert self.floors is not None, "set when it was made"
            floors = [backend.float_of(float(floor), types) for floor in self.floors]
            return [deviance(values[c], wanted[c], floors[c]) for c in range(CHANNELS)]
        return [metric(self.name, values[c], self._floor(types)) - wanted[c] for c in range(CHANNELS)]

    def cost(self, numbers: Floats) -> float:
        """Sum of the squared residuals; infinite where one is not finite."""
        total = sum(float(np.sum(r.astype(np.float64) ** 2)) for r in self.residuals(numbers))
        return total if np.isfinite(total) else np.inf

    def residuals(self, numbers: Floats) -> list[NDArray[np.float32]]:
        """Of each channel, (N,)."""
        types = backend.types("float32")
        wo, wi, _ = self._loaded(types)
        values = [backend.float_of(float(x), types) for x in numbers]
        model = with_drjit(self.material, self.free, values, types)
        found = self._residual(model.eval(wo, wi), types)
        backend.drjit().eval(found)
        return [np.asarray(backend.to_numpy(r, len(self.data))) for r in found]

    def linearized(self, numbers: Floats) -> list[Linearized]:
        """Of each channel (residuals (N,), derivatives (N, K), which numbers these are along)."""
        dr = backend.drjit()
        types = backend.types("float32")
        wo, wi, _ = self._loaded(types)
        values = [backend.float_of(float(x), types) for x in numbers]
        for value in values:
            dr.enable_grad(value)
        model = with_drjit(self.material, self.free, values, types)
        seen = model.eval(wo, wi)
        residual = self._residual(seen, types)
        derivatives: list[list[Array]] = []
        for columns in self.columns:
            dr.clear_grad(values)
            dr.clear_grad(residual)
            for column in columns:
                dr.set_grad(values[column], 1.0)
            for column in columns:
                dr.enqueue(dr.ADMode.Forward, values[column])
            dr.traverse(dr.ADMode.Forward, flags=dr.ADFlag.ClearInterior)
            derivatives.append([dr.grad(r) for r in residual])
        residual = [dr.detach(r) for r in residual]
        dr.eval(residual, derivatives)
        rows = len(self.data)
        found: list[Linearized] = []
        for c in range(CHANNELS):
            which = [columns[c] if len(columns) > 1 else columns[0] for columns in self.columns]
            jacobian = np.stack([np.asarray(backend.to_numpy(d[c], rows)) for d in derivatives], axis=1)
            found.append((np.asarray(backend.to_numpy(residual[c], rows)), jacobian, which))
        return found


def floors_of(value: Floats) -> Floats:
    """Where "relative" turns absolute, of each channel, (3,): by the data alone, a thousandth of its brightest values.
    Values under 0 do not count for it: in real files they lie in highlights whose color is out of gamut."""
    brightest = np.percentile(np.maximum(value, 0.0), 99.0, axis=0)
    return np.maximum(SMALL * brightest, 1e-6)


def columns_of(material: BSDF, free: list[Free]) -> list[list[int]]:
    """Which numbers of a material one derivative is taken along: each alone, or a color's three where its channels do
    not mix; found by asking a few directions."""
    w = np.random.default_rng(3).normal(size=(2, 64, CHANNELS))
    w[..., 2] = np.abs(w[..., 2]) + 0.1
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return Problem(material, free, Data(w[0], w[1], np.ones((64, CHANNELS)), np.zeros(64, np.int64)), "linear").columns


def normal_equations(problem: Residuals, numbers: Floats) -> tuple[float, Floats, Floats]:
    """(sum of squares, gradient J^T r, J^T J) at some numbers."""
    count = problem.count
    cost, gradient, hessian = 0.0, np.zeros(count), np.zeros((count, count))
    for residual, jacobian, which in problem.linearized(numbers):
        for start in range(0, len(residual), BLOCK):
            r, j = residual[start : start + BLOCK], jacobian[start : start + BLOCK]
            cost += float(r @ r)
            gradient[which] += j.T @ r
            hessian[np.ix_(which, which)] += j.T @ j
    return cost, gradient, hessian


# --------------------------------------------------------------------------- Levenberg and Marquardt


@dataclass(frozen=True)
class Solution:
    """Where the sum of squares is least, as far as it was followed.

    numbers  values of the free parameters
    cost     sum of squares
    steps    that were taken
    """

    numbers: Floats
    cost: float
    steps: int


def solve(
    problem: Residuals,
    start: Floats,
    steps: int = 30,
    tolerance: float = 1e-6,
    progress: Callable[[float], None] = lambda cost: None,
) -> Solution:
    """Follow the sum of squares down from `start`, within the ranges of the parameters.

    tolerance  relative decrease of the cost, and of all numbers, under which it ends
    """
    low, high, ratio = ranges(problem.free)

    def inner(x: Floats) -> Floats:
        return np.where(ratio, np.log(np.maximum(x, 1e-12)), x)

    def outer(y: Floats) -> Floats:
        return np.clip(np.where(ratio, np.exp(np.minimum(y, 60.0)), y), low, high)

    numbers = np.clip(start, low, high)
    damping, taken = 1e-3, 0
    cost, gradient, hessian = normal_equations(problem, numbers)
    for _ in range(steps):
        slope = np.where(ratio, numbers, 1.0)  # d number / d inner
        g, h = gradient * slope, hessian * np.outer(slope, slope)
        # at an end of its range, and pushed beyond: it stays for this step
        stuck = ((numbers <= low) & (g > 0.0)) | ((numbers >= high) & (g < 0.0))
        moves = np.flatnonzero(~stuck & (np.diag(h) > 0.0))
        if not len(moves):
            break
        scale = np.diag(h)[moves]
        improved = False
        for _ in range(8):
            a = h[np.ix_(moves, moves)] + damping * np.diag(scale)
            step = np.zeros(len(numbers))
            try:
                step[moves] = -np.linalg.solve(a, g[moves])
            except np.linalg.LinAlgError:
                damping *= 10.0
                continue
            step = np.where(ratio, np.clip(step, -1.5, 1.5), step)
            tried = outer(inner(numbers) + step)
            found = normal_equations(problem, tried)
            if np.isfinite(found[0]) and found[0] < cost:
                improved = True
                break
            damping = (damping if damping > 1e-6 else 1e-6) * 8.0
            if np.all(np.abs(tried - numbers) <= 1e-7 * np.maximum(np.abs(numbers), 1e-3)):
                break
        if not improved:
            break
        drop = (cost - found[0]) / max(cost, 1e-300)
        moved = np.max(np.abs(tried - numbers) / np.maximum(np.abs(numbers), 1e-3))
        numbers, (cost, gradient, hessian) = tried, found
        damping, taken = max(damping * 0.1, 1e-12), taken + 1
        progress(cost)
        if drop < tolerance and moved < 1e-4:
            break
    return Solution(numbers, cost, taken)
