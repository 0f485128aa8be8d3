"""Networks of 675 weights, trained on tables."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...ops import backend
from ..tables.base import Measurement, in_rgb
from ..tables.half_difference import HalfDifference
from ..tables.network import SHAPES, Network
from .base import Method, over_half_vectors

Floats32 = NDArray[np.float32]

OFFSET = 0.3  # fraction of the median of f: differences are absolute below and relative above
LOWEST = 0.01  # minimum cosine of both directions in training: within 0.6 degrees of the horizon
STEPS, BATCH, RATE = 9000, 2048, 1e-2  # for Adam; the rate decreases linearly to 0
ROUNDS, PAIRS = 40, 5000  # for Gauss-Newton, with as many pairs each
LARGEST = 60.0  # largest log(1 + f), within the range of exp in float32


class NetworkMethod(Method):
    """network: 675 weights of a neural network, 6 -> 21 -> 21 -> 3 (Sztrajman2021), trained on the table."""

    name: ClassVar[str] = "network"

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        return [trained(table) for table in tables]


def trained(table: Measurement, seed: int = 1) -> Network:
    """A network that is trained on a table, first with Adam in Dr.Jit, then with Levenberg-Marquardt.

    The training takes about half a minute. The loss is the mean of |log(f + c) - log(f' + c)| over the cells of a
    half-difference table, where f' is the value of the network and c is a fraction of the median of f.

    seed  seed of the initial weights and of the batches
    """
    data = Data.of(over_half_vectors(table))
    rng = np.random.default_rng([seed, 97])
    weights = _refined(_descended(_started(data, rng), data, rng), data, rng)
    return Network(
        {name: array.T if name.startswith("kernel") else array[:, 0] for name, array in weights.items()},
        title=table.title,
        source=table.source,
    )


@dataclass(frozen=True)
class Data:
    """The training data.

    inputs  (6, N), half and difference vectors of pairs of directions: hx, hy, hz, dx, dy, dz
    logs    (3, N), log(f + offset)
    """

    inputs: Floats32
    logs: Floats32
    offset: float

    @classmethod
    def of(cls, table: HalfDifference) -> Data:
        n, m, count = table.values.shape[:3]
        theta_h = ((np.arange(n) + 0.5) / n) ** 2 * (0.5 * np.pi)
        theta_d = (np.arange(m) + 0.5) / m * (0.5 * np.pi)
        phi_d = (np.arange(count) + 0.5) / count * table.turn
        h, d, p = (a.ravel() for a in np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))
        along, side = np.sin(d) * np.cos(p), np.sin(d) * np.sin(p)
        flip = np.where(side < 0.0, -1.0, 1.0)  # reduces a full turn to half a turn, because f is reciprocal
        both = np.stack([np.sin(h), 0.0 * h, np.cos(h), along * flip, side * flip, np.cos(d)]).astype(np.float32)
        lowest = np.cos(d) * np.cos(h) - np.abs(np.sin(h) * along)
        usable = table.valid.ravel() & (lowest > LOWEST)
        f = in_rgb(table.values, table.wavelengths).reshape(-1, 3)[usable]
        offset = OFFSET * max(float(np.median(f)), 1e-6)
        return cls(both[:, usable], np.log(np.maximum(f, 0.0) + offset).T.astype(np.float32), offset)


Weights = dict[str, Floats32]


def _started(data: Data, rng: np.random.Generator) -> Weights:
    """Random initial weights (Glorot2010); the output biases give the median color."""
    weights: Weights = {}
    for name, shape in SHAPES.items():
        if name.startswith("kernel"):
            reach = np.sqrt(6.0 / sum(shape))
            weights[name] = rng.uniform(-reach, reach, shape[::-1]).astype(np.float32)
        else:
            weights[name] = np.zeros((*shape, 1), np.float32)
    median = np.exp(np.median(data.logs, axis=1)) - data.offset
    weights["bias2"] = np.log1p(np.maximum(median, 0.0))[:, None].astype(np.float32)
    return weights


def _descended(weights: Weights, data: Data, rng: np.random.Generator) -> Weights:
    """The weights after training with Adam on batches of pairs."""
    dr, types = backend.drjit(), backend.types("float32")
    Tensor = types.module.TensorXf
    opt = importlib.import_module("drjit.opt").Adam(lr=RATE, params={n: Tensor(w) for n, w in weights.items()})
    mixed = rng.permutation(data.inputs.shape[1])
    count = max(len(mixed) // BATCH, 1)
    batches = [mixed[i * BATCH : (i + 1) * BATCH] for i in range(count)]
    inputs = [Tensor(np.ascontiguousarray(data.inputs[:, batch])) for batch in batches]
    wanted = [Tensor(np.ascontiguousarray(data.logs[:, batch])) for batch in batches]
    dr.eval(inputs, wanted)
    for step in range(STEPS):
        opt.set_learning_rate(RATE * max(1.0 - step / STEPS, 1e-3))
        one = int(rng.integers(count))
        units = dr.maximum(opt["kernel0"] @ inputs[one] + opt["bias0"], 0.0)
        units = dr.maximum(opt["kernel1"] @ units + opt["bias1"], 0.0)
        f = dr.exp(opt["kernel2"] @ units + opt["bias2"]) - 1.0
        # linear below 0, so that the gradient of a value that is too small does not vanish
        log = dr.select(
            f > 0.0, dr.log(dr.maximum(f, 0.0) + data.offset), f * (1.0 / data.offset) + float(np.log(data.offset))
        )
        dr.backward(dr.mean(dr.abs(log - wanted[one]), axis=None))
        opt.step()
    return {name: np.array(opt[name]) for name in weights}


def _refined(weights: Weights, data: Data, rng: np.random.Generator) -> Weights:
    """The weights after Levenberg-Marquardt iterations; for 675 weights, the normal equations are small."""
    damping = 1e-2
    for _ in range(ROUNDS):
        pick = rng.choice(data.inputs.shape[1], min(PAIRS, data.inputs.shape[1]), replace=False)
        part = Data(data.inputs[:, pick], data.logs[:, pick], data.offset)
        normal, slope, before = _normal_equations(weights, part)
        diagonal = np.diag(normal)
        diagonal = np.maximum(diagonal, 1e-6 * diagonal.max())
        for _ in range(6):
            step = np.linalg.solve(normal + np.diag(damping * diagonal), -slope).astype(np.float32)
            tried, at = {}, 0
            for name, array in weights.items():
                tried[name] = array + step[at : at + array.size].reshape(array.shape)
                at += array.size
            if np.mean(_differences(tried, part)[0] ** 2) < before:
                weights, damping = tried, max(damping / 3.0, 1e-7)
                break
            damping *= 4.0
    return weights


def _units(weights: Weights, inputs: Floats32) -> tuple[Floats32, Floats32, Floats32]:
    first = np.maximum(weights["kernel0"] @ inputs + weights["bias0"], 0.0)
    second = np.maximum(weights["kernel1"] @ first + weights["bias1"], 0.0)
    return first, second, np.minimum(weights["kernel2"] @ second + weights["bias2"], LARGEST)


def _differences(weights: Weights, data: Data) -> tuple[Floats32, Floats32]:
    """The differences of the logarithms, (3, N), and their derivatives with respect to the outputs of the network."""
    said = _units(weights, data.inputs)[2]
    f = np.expm1(said)
    lit = f > 0.0
    log = np.where(lit, np.log(np.maximum(f, 0.0) + data.offset), float(np.log(data.offset)) + f / data.offset)
    return log - data.logs, ((f + 1.0) / np.where(lit, f + data.offset, data.offset)).astype(np.float32)


def _normal_equations(weights: Weights, data: Data) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """J J^T, J r and the mean of r^2, where r are the differences and J their Jacobian matrix.

    J is computed by explicit backpropagation for each channel.
    """
    first, second, _ = _units(weights, data.inputs)
    rest, derivative = _differences(weights, data)
    sizes = [weights[name].size for name in SHAPES]
    inner, pairs = sum(sizes[:4]), data.inputs.shape[1]
    normal, slope = np.zeros((sum(sizes), sum(sizes))), np.zeros(sum(sizes))
    for channel in range(3):
        through = weights["kernel2"][channel][:, None] * (second > 0.0) * derivative[channel]
        under = (weights["kernel1"].T @ through) * (first > 0.0)
        rows = np.concatenate([
            (under[:, None] * data.inputs).reshape(-1, pairs),
            under,
            (through[:, None] * first).reshape(-1, pairs),
            through,
            second * derivative[channel],
            derivative[channel][None],
        ]).astype(np.float32)  # fmt: skip
        units = len(second)
        own = np.concatenate(
            [np.arange(inner + units * channel, inner + units * (channel + 1)), [len(slope) - 3 + channel]]
        )
        at = np.concatenate([np.arange(inner), own])
        normal[np.ix_(at, at)] += rows @ rows.T
        slope[at] += rows @ rest[channel]
    return normal, slope, float(np.mean(rest**2))
