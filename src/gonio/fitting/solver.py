"""Nonlinear least squares by the Levenberg-Marquardt method, with derivatives from Dr.Jit.

One kernel evaluates the residuals of all data and their derivatives, in forward mode; one derivative serves all three
channels of a color if the channels do not mix in `eval`. BLAS sums the normal equations over rows. A pass over 1.46
million cells and six parameters moves about 70 MB; its speed is limited by the memory bandwidth and by exp, log and
sqrt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..material import BSDF
from ..measure.tables.base import Floats
from ..ops import backend
from .data import Data
from .parameters import CHANNELS, Free, inner_of, ranges, start_of, with_drjit

Array = backend.Array
BLOCK = 1 << 13  # rows per BLAS call: larger blocks are split among threads, whose number changes the last bits
SMALL = 1e-3  # fraction of the largest value: "log" and "relative" are absolute below it, relative above
DARK = 1e3  # floor of a channel that is 0 everywhere, relative to the largest value of the other channels
NEAR = 0.1  # relative difference below which a series is more accurate than the logarithm in float32


# --------------------------------------------------------------------------- metrics

METRICS = {
    "relative": "difference divided by the model's value, unbiased by noise; logarithmic for ratios above 2",
    "log": "log(1 + f cos / c), where c is a thousandth of the 99 % quantile of the data: nearly relative",
    "log1p": "log(1 + f cos), as in Low2012",
    "cuberoot": "(f cos)^(1/3), close to perceived brightness",
    "linear": "f cos, as in Ngan2005",
}


def metric(name: str, value: Array, floor: Array) -> Array:
    """Transform a value of one channel to the scale of the metric; for "relative" see `deviance`.

    floor  value below which a "log" difference becomes an absolute one
    """
    dr = backend.drjit()
    if name in ("linear", "relative"):
        return value
    if name == "cuberoot":
        size = dr.maximum(dr.abs(value), 1e-9)
        return dr.copysign(dr.exp(dr.log(size) / 3.0), value)
    return dr.copysign(dr.log(1.0 + _size(value) / (1.0 if name == "log1p" else floor)), value)


def _size(value: Array) -> Array:
    """|value| with a derivative of 1 at 0. The derivative of `abs` at 0 is 0, so a color that reaches 0 would stay at
    0."""
    return backend.drjit().select(value < 0.0, -value, value)


def deviance(model: Array, value: Array, floor: Array) -> Array:
    """Residual r of a model f against a value v, r^2 = 2 rho, for the metric "relative".

    Iteratively reweighted least squares for (v - f) / (f + c) solve sum((v - f) / (f + c)^2 df) = 0. These are the
    quasi-likelihood equations for a standard deviation proportional to f + c (Wedderburn1974), for any distribution of
    the noise: the true model is a root if v is unbiased. However, they do not minimize a function, and 0 is also a
    root. The function with this derivative is the deviance of the gamma distribution,

        rho = u - log(1 + u),  u = (v - f) / (f + c),

    which is large for a model of 0. For u >= 1 (data at least twice the model, a difference that noise does not
    explain), rho is log(1 + u) plus a constant: its derivative is bounded there, as in Huber1964, and it is bounded at
    u = -1 in any case. Therefore, no value has more influence than 1 / (f + c). For values below -c / 2, the derivative
    uses v + c, clamped to 0, and the constant is that for -c / 2, because no model is negative. For values below -c, c
    is -v: with an error of this size, a model of 0 cannot be distinguished from one below |v|.
    """
    dr = backend.drjit()
    size = _size(model)
    floor = dr.maximum(floor, -value)
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

# residuals (N,), derivatives (N, K), and the indices of the K parameters
Linearized = tuple[NDArray[np.floating], NDArray[np.floating], list[int]]


class Residuals(Protocol):
    """A least-squares problem: its free parameters, and its residuals with their derivatives, divided into parts."""

    free: list[Free]

    @property
    def count(self) -> int: ...
    def linearized(self, numbers: Floats) -> list[Linearized]: ...


@dataclass
class Problem:
    """Residuals of a material with respect to data: metric(eval) - metric(value) for each channel.

    material  the material to fit
    free      its free parameters
    name      name of the metric
    floor     value below which a "log" difference becomes an absolute one
    floors    (3,), value per channel below which a "relative" difference becomes an absolute one
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
        """Groups of parameters that share one derivative: a single parameter, or the three channels of a color."""
        groups: list[list[int]] = []
        at = 0
        for one in self.free:
            together = list(range(at, at + one.count))
            at += one.count
            groups += [[column] for column in together] if self._mix(together) else [together]
        return groups

    def _mix(self, channels: list[int]) -> bool:
        """Whether the first channel of a color affects the other channels of `eval`, at the material's own values or at
        values inside all ranges, because a tint of 0 would conceal such a mixture."""
        if len(channels) == 1:
            return False
        dr, types = backend.drjit(), backend.types("float32")
        probe = self.data.some(64)
        wo, wi = (backend.vector_of(w, 3, types) for w in (probe.wo, probe.wi))
        start = start_of(self.material, self.free)
        for numbers in (start, inner_of(self.free, start)):
            values = [backend.float_of(float(x), types) for x in numbers]
            dr.enable_grad(values[channels[0]])
            f = with_drjit(self.material, self.free, values, types).eval(wo, wi)
            dr.forward_from(values[channels[0]])
            if np.abs([backend.to_numpy(dr.grad(f[c]), len(probe)) for c in (1, 2)]).max() > 0.0:
                return True
        return False

    @property
    def count(self) -> int:
        return sum(map(len, self.columns))

    @property
    def tabulated(self) -> bool:
        """Whether the material computes tables from a parameter (`BSDF.fixed`), so that each step takes longer."""
        return any(one.path in self.material.fixed for one in self.free)

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
            assert self.floors is not None, "set by __post_init__"
            floors = [backend.float_of(float(floor), types) for floor in self.floors]
            return [deviance(values[c], wanted[c], floors[c]) for c in range(CHANNELS)]
        return [metric(self.name, values[c], self._floor(types)) - wanted[c] for c in range(CHANNELS)]

    def cost(self, numbers: Floats) -> float:
        """Sum of the squared residuals; infinite if one is not finite."""
        total = sum(float(np.sum(r.astype(np.float64) ** 2)) for r in self.residuals(numbers))
        return total if np.isfinite(total) else np.inf

    def residuals(self, numbers: Floats) -> list[NDArray[np.float32]]:
        """Residuals of each channel, (N,)."""
        types = backend.types("float32")
        wo, wi, _ = self._loaded(types)
        values = [backend.float_of(float(x), types) for x in numbers]
        model = with_drjit(self.material, self.free, values, types)
        residuals = self._residual(model.eval(wo, wi), types)
        backend.drjit().eval(residuals)
        return [np.asarray(backend.to_numpy(r, len(self.data))) for r in residuals]

    def linearized(self, numbers: Floats) -> list[Linearized]:
        """Per channel: (residuals (N,), derivatives (N, K), indices of their parameters)."""
        dr = backend.drjit()
        types = backend.types("float32")
        wo, wi, _ = self._loaded(types)
        values = [backend.float_of(float(x), types) for x in numbers]
        for value in values:
            dr.enable_grad(value)
        model = with_drjit(self.material, self.free, values, types)
        f = model.eval(wo, wi)
        residual = self._residual(f, types)
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
        blocks: list[Linearized] = []
        for c in range(CHANNELS):
            which = [columns[c] if len(columns) > 1 else columns[0] for columns in self.columns]
            jacobian = np.stack([np.asarray(backend.to_numpy(d[c], rows)) for d in derivatives], axis=1)
            blocks.append((np.asarray(backend.to_numpy(residual[c], rows)), jacobian, which))
        return blocks


def floors_of(value: Floats) -> Floats:
    """Values per channel below which a "relative" difference becomes an absolute one, (3,): a thousandth of the
    brightest values in the data. Negative values are ignored: in measured files, they are in highlights whose color is
    out of gamut.

    In a channel without positive values, as for a defective detector or a black material, no difference is relative.
    Its floor is so large that the channel determines only its own parameters, not those shared with other channels.
    """
    brightest = np.percentile(np.maximum(value, 0.0), 99.0, axis=0)
    dark = value.max(axis=0) <= 0.0
    return np.maximum(np.where(dark, DARK * brightest.max(), SMALL * brightest), 1e-6)


def columns_of(material: BSDF, free: list[Free]) -> list[list[int]]:
    """Groups of parameters that share one derivative: a single parameter, or the three channels of a color if they do
    not mix, which is tested at a few directions."""
    w = np.random.default_rng(3).normal(size=(2, 64, CHANNELS))
    w[..., 2] = np.abs(w[..., 2]) + 0.1
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return Problem(material, free, Data(w[0], w[1], np.ones((64, CHANNELS)), np.zeros(64, np.int64)), "linear").columns


def normal_equations(problem: Residuals, numbers: Floats) -> tuple[float, Floats, Floats]:
    """(sum of squares, gradient J^T r, J^T J) at the given parameters."""
    count = problem.count
    cost, gradient, hessian = 0.0, np.zeros(count), np.zeros((count, count))
    for residual, jacobian, which in problem.linearized(numbers):
        for start in range(0, len(residual), BLOCK):
            r, j = residual[start : start + BLOCK], jacobian[start : start + BLOCK]
            cost += float(r @ r)
            gradient[which] += j.T @ r
            hessian[np.ix_(which, which)] += j.T @ j
    return cost, gradient, hessian


# --------------------------------------------------------------------------- Levenberg-Marquardt


@dataclass(frozen=True)
class Solution:
    """Result of `solve`.

    numbers  values of the free parameters
    cost     sum of squares
    steps    number of accepted steps
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
    held: Sequence[int] = (),
) -> Solution:
    """Minimize the sum of squares from `start` within the ranges of the parameters, in at most `steps` steps.

    tolerance  relative decrease of the cost below which the solver stops
    held       indices of parameters that stay fixed
    progress   called with the cost after each accepted step
    """
    low, high, ratio = ranges(problem.free)

    def inner(x: Floats) -> Floats:
        return np.where(ratio, np.log(np.maximum(x, 1e-12)), x)

    def outer(y: Floats) -> Floats:
        return np.clip(np.where(ratio, np.exp(np.minimum(y, 60.0)), y), low, high)

    numbers = np.clip(start, low, high)
    damping, accepted = 1e-3, 0
    cost, gradient, hessian = normal_equations(problem, numbers)
    for _ in range(steps):
        slope = np.where(ratio, numbers, 1.0)  # d number / d inner
        g, h = gradient * slope, hessian * np.outer(slope, slope)
        moves = np.flatnonzero(_moves(numbers, g, low, high, held) & (np.diag(h) > 0.0))
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
            equations = normal_equations(problem, tried)
            if np.isfinite(equations[0]) and equations[0] < cost:
                improved = True
                break
            damping = (damping if damping > 1e-6 else 1e-6) * 8.0
            if np.all(np.abs(tried - numbers) <= 1e-7 * np.maximum(np.abs(numbers), 1e-3)):
                break
        if not improved:
            break
        drop = (cost - equations[0]) / max(cost, 1e-300)
        moved = np.max(np.abs(tried - numbers) / np.maximum(np.abs(numbers), 1e-3))
        numbers, (cost, gradient, hessian) = tried, equations
        damping, accepted = max(damping * 0.1, 1e-12), accepted + 1
        progress(cost)
        if drop < tolerance and moved < 1e-4:
            break
    return Solution(numbers, cost, accepted)


def _moves(numbers: Floats, gradient: Floats, low: Floats, high: Floats, held: Sequence[int]) -> NDArray[np.bool_]:
    """Mask of the parameters that a step may change: neither held, nor at a bound with a step that would leave the
    range."""
    stuck = ((numbers <= low) & (gradient > 0.0)) | ((numbers >= high) & (gradient < 0.0))
    stuck[list(held)] = True
    return np.asarray(~stuck)
