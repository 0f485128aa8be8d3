"""The least-squares problem of a fit to photographs, in which calibration errors are additional parameters."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...fitting.parameters import CHANNELS, Free, with_drjit
from ...fitting.solver import Linearized, columns_of
from ...material import BSDF
from ...ops import backend
from . import geometry
from .calibration import Floats, Uncertainty
from .geometry import Array
from .pixels import GAUSS, Pixels, Scene, constant, observe

CHUNK = 1 << 17  # pixels per kernel launch, which bounds memory
FARTHEST = 8.0  # upper bound of a calibration error, in standard deviations
BALL = ("ball.x", "ball.y", "ball.radius")
LAMP = ("right", "down", "intensity")


class Rows(NamedTuple):
    """The pixels of one lamp and channel: residuals (N,), derivatives (N, K), indices of the parameters, and tiles."""

    residual: NDArray[np.floating]
    slope: NDArray[np.floating]
    which: list[int]
    tile: NDArray[np.int64]
    lamp: int


@dataclass(frozen=True)
class Faults:
    """The standard deviations of the calibration errors, which are the units of the corresponding parameters.

    ball       standard deviations of the ball's position, horizontal and vertical, pixels, and of its radius, relative
    scale      standard deviation of a scale factor common to all intensities, relative
    direction  standard deviation of each lamp's direction, horizontal and vertical as seen from the sample, radians
    intensity  standard deviation of each lamp's intensity, relative
    """

    ball: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: float = 0.0
    direction: float = 0.0
    intensity: float = 0.0

    @classmethod
    def of(cls, stated: Uncertainty, scene: Scene) -> Faults:
        center, radius = scene.ball.off if scene.ball is not None else (0.0, 0.0)
        center = center if stated.center is None else stated.center
        radius = radius if stated.radius is None else stated.radius
        return cls((center, center, radius), stated.scale, float(np.radians(stated.light)), stated.intensity)

    def names(self, lamps: Sequence[str], ball: bool) -> list[str]:
        """The names of the uncertain quantities; those common to all lamps come first."""
        names = [name for name, sd in zip(BALL, self.ball, strict=True) if sd > 0.0 and ball]
        names += ["scale"] if self.scale > 0.0 else []
        return names + [f"{lamp}.{name}" for lamp in lamps for name in self.of_lamp]

    def slack(self, scene: Scene) -> tuple[float, float]:
        """Three standard deviations of the ball's outline, relative to its radius, and of a lamp's direction, rad."""
        ball = (
            0.0
            if scene.ball is None
            else float(np.hypot(self.ball[0] * scene.ball.pixel / scene.ball.radius, self.ball[2]))
        )
        return 3.0 * ball, 3.0 * self.direction

    @property
    def of_lamp(self) -> tuple[str, ...]:
        return (*(LAMP[:2] if self.direction > 0.0 else ()), *(LAMP[2:] if self.intensity > 0.0 else ()))


@dataclass
class Problem:
    """A least-squares problem.

    The residual of a pixel is (predicted - measured) / standard deviation. The residual of a calibration error is its
    parameter, in units of the stated standard deviation.

    material  the material to fit
    moving    free parameters of the material
    scene     camera, sample and lamps
    parts     groups of pixels
    faults    standard deviations of the calibration errors
    noise     relative standard deviation of a pixel
    alike     number of neighboring pixels that count as one, because their errors are correlated
    """

    material: BSDF
    moving: list[Free]
    scene: Scene
    parts: Sequence[Pixels]
    faults: Faults
    noise: float = 0.01
    alike: float = 1.0
    free: list[Free] = field(init=False)
    _weights: list[Floats] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        with_ball = any(part.kind == "ball" for part in self.parts)
        self.open = self.faults.names(self.scene.names, with_ball)
        self.free = [*self.moving, *(Free(name, "float", -FARTHEST, FARTHEST, False) for name in self.open)]
        self.own = sum(one.count for one in self.moving)

    @property
    def count(self) -> int:
        return self.own + len(self.open)

    # ------------------------------------------------------------------ columns

    @cached_property
    def columns(self) -> list[list[int]]:
        """Groups of material parameters with a common derivative: single numbers, and the three channels of colors."""
        return columns_of(self.material, self.moving)

    def of_row(self, lamp: int, channel: int) -> list[int]:
        """The indices of the parameters of a lamp and channel, in the order of the derivatives from `_radiance`."""
        shared = [columns[channel] if len(columns) > 1 else columns[0] for columns in self.columns]
        names = [*BALL, "scale", *(f"{self.scene.names[lamp]}.{name}" for name in LAMP)]
        return shared + [self.own + self.open.index(name) for name in names if name in self.open]

    # ------------------------------------------------------------------ prediction

    def predicted(self, part: Pixels, numbers: Floats, derive: bool) -> tuple[Floats, Floats | None]:
        """The expected values of pixels, (N, 3), averaged over four points per pixel; their derivatives, (N, 3, K)."""
        values, derivatives = [], []
        for start in range(0, len(part), CHUNK):
            some = part.at(np.arange(start, min(start + CHUNK, len(part))))
            radiance, slope = self._radiance(some, numbers, derive)
            mean, gain = some.expected(radiance)
            values.append(mean)
            derivatives.append(None if slope is None else slope * gain[..., None])
        together = np.concatenate([d for d in derivatives if d is not None]) if derive else None
        return np.concatenate(values), together

    def _radiance(self, part: Pixels, numbers: Floats, derive: bool) -> tuple[Floats, Floats | None]:
        """The radiance of pixels, (N, 3), and its derivatives, (N, 3, K)."""
        dr, types = backend.drjit(), backend.types("float32")
        scene, faults = self.scene, self.faults
        rows = len(part)
        corners = np.array([[x, y] for x in (-GAUSS, GAUSS) for y in (-GAUSS, GAUSS)])
        place = (corners[:, None] + part.place).reshape(-1, 2)
        ray = backend.vector_of(geometry.rays(scene.camera, *place.T), 3, types)
        which = types.module.UInt32(np.tile(part.lamp, len(corners)).astype(np.uint32))

        own = [backend.float_of(float(x), types) for x in numbers[: self.own]]
        at = dict(zip(self.open, numbers[self.own :], strict=True))
        ball = [backend.float_of(float(at.get(name, 0.0)), types) for name in BALL]
        turns = self._turns(at, types)
        groups = [[own[column] for column in columns] for columns in self.columns]
        with_ball = part.kind == "ball"
        groups += [[one] for name, one in zip(BALL, ball, strict=True) if name in self.open]
        groups += [[one] for one in turns if faults.direction > 0.0]
        if derive:
            for group in groups:
                dr.enable_grad(group)
        lamps = self._lamps(turns, types)
        lamp = types.vec3(*(dr.gather(types.float, component, which) for component in lamps))
        view = observe(scene, part.kind, ray, lamp, self._ball(ball, types) if with_ball else None)
        value = with_drjit(self.material, self.moving, own, types).eval(view.wo, view.wi)
        light = [dr.gather(types.float, backend.float_of(c, types), which) for c in self._brightness(at).T]
        radiance = [light[c] * value[c] / view.square for c in range(CHANNELS)]
        slopes: list[list[Array]] = []
        if derive:
            everything = [one for group in groups for one in group]
            for group in groups:
                dr.clear_grad(everything)
                dr.clear_grad(radiance)
                for one in group:
                    dr.set_grad(one, 1.0)
                for one in group:
                    dr.enqueue(dr.ADMode.Forward, one)
                dr.traverse(dr.ADMode.Forward, flags=dr.ADFlag.ClearInterior)
                slopes.append([dr.grad(r) for r in radiance])
        radiance = [dr.detach(r) for r in radiance]
        dr.eval(radiance, slopes)

        def mean(x: Array) -> Floats:
            return np.asarray(backend.to_numpy(x, rows * len(corners)).reshape(-1, rows).mean(axis=0), np.float64)

        shown = np.stack([mean(r) for r in radiance], -1)
        if not derive:
            return shown, None
        slope = [np.stack([mean(d) for d in group], -1) for group in slopes]
        # in the order of `of_row`: material, ball, scale, lamp's direction, lamp's intensity
        before = len(slope) - (2 if faults.direction > 0.0 else 0)
        slope[before:before] = [faults.scale * shown] if faults.scale > 0.0 else []
        slope += [faults.intensity * shown] if faults.intensity > 0.0 else []
        return shown, np.stack(slope, -1)

    def _ball(self, off: list[Array], types: backend.Types) -> tuple[Array, Array]:
        """The center and radius of the ball, including their errors."""
        placed = self.scene.ball
        assert placed is not None, "a photograph shows it"
        right, down = across(placed.center)
        sd = self.faults.ball
        center = constant(placed.center, types)
        for axis, one, amount in ((right, off[0], sd[0]), (down, off[1], sd[1])):
            center = center + constant(axis * placed.pixel * amount, types) * one
        larger = 1.0 + backend.float_of(sd[2], types) * off[2]
        radius = backend.float_of(placed.radius, types)
        # if the outline is too large, the assumed position of the ball is too near
        return (center, radius * larger) if placed.given else (center / larger, radius)

    def _lamps(self, turns: list[Array], types: backend.Types) -> Array:
        """The positions of the lamps, including the errors of their directions."""
        middle = middle_of(self.scene)
        away = self.scene.lamps - middle
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        axes = [across(one) for one in away]
        toward = backend.vector_of(away / distance, 3, types)
        sd = backend.float_of(self.faults.direction, types)
        for number, one in enumerate(turns):
            toward = toward + backend.vector_of(np.array([axis[number] for axis in axes]), 3, types) * (one * sd)
        length = backend.drjit().rsqrt(toward.x * toward.x + toward.y * toward.y + toward.z * toward.z)
        return constant(middle, types) + toward * (length * backend.float_of(distance[:, 0], types))

    def corrected(self, numbers: Floats) -> Scene:
        """The scene corrected by the estimated calibration errors."""
        types = backend.types("float64")
        at = dict(zip(self.open, numbers[self.own :], strict=True))
        ball = self.scene.ball
        if ball is not None:
            center, radius = self._ball([backend.float_of(float(at.get(name, 0.0)), types) for name in BALL], types)
            ball = replace(ball, center=backend.to_numpy(center, 1)[0], radius=float(backend.to_numpy(radius, 1)[0]))
        lamps = backend.to_numpy(self._lamps(self._turns(at, types), types), len(self.scene.names))
        return replace(self.scene, ball=ball, lamps=lamps, intensities=self._brightness(at))

    def _turns(self, at: Mapping[str, float], types: backend.Types) -> list[Array]:
        return [
            backend.float_of(np.array([at.get(f"{lamp}.{name}", 0.0) for lamp in self.scene.names]), types)
            for name in LAMP[:2]
        ]

    def _brightness(self, at: Mapping[str, float]) -> Floats:
        own = np.array([[at.get(f"{lamp}.{LAMP[2]}", 0.0)] for lamp in self.scene.names])
        together = self.faults.scale * at.get("scale", 0.0)
        return np.asarray(self.scene.intensities * np.exp(together + self.faults.intensity * own))

    # ------------------------------------------------------------------ residuals

    def reweigh(self, numbers: Floats) -> None:
        """Update the weights of pixels from their predicted standard deviations."""
        self._weights = [self._weight(part, self.predicted(part, numbers, False)[0]) for part in self.parts]

    def _weight(self, part: Pixels, predicted: Floats) -> Floats:
        return np.asarray(1.0 / (self._spread(part, predicted) * np.sqrt(self.alike)))

    def _spread(self, part: Pixels, predicted: Floats) -> Floats:
        """The standard deviation of pixels, (N, 3).

        It is computed from the predicted values, because measured values that are low by chance would get more weight.
        """
        floor = 1e-6 * float(np.abs(part.value).max())
        # a lower bound for pixels that a calibration error moves into the dark
        size = np.maximum(np.abs(predicted), 0.1 * np.abs(part.value))
        return np.asarray(np.sqrt((self.noise * size) ** 2 + part.variance(size) + floor**2))

    def relative_spread(self, numbers: Floats) -> float:
        """The mean standard deviation of the pixels, divided by their mean."""
        predicted = [(part, self.predicted(part, numbers, False)[0]) for part in self.parts]
        total = sum(float(np.abs(values).sum()) for _, values in predicted)
        return sum(float(self._spread(part, values).sum()) for part, values in predicted) / max(total, 1e-300)

    def off(self, numbers: Floats) -> list[tuple[Pixels, Floats, Floats]]:
        """For each group of pixels: (pixels, predicted - measured, predicted)."""
        differences = []
        for part in self.parts:
            predicted, _ = self.predicted(part, numbers, False)
            differences.append((part, predicted - part.value, predicted))
        return differences

    def linearized(self, numbers: Floats) -> list[Linearized]:
        """The residuals of each lamp and channel, those of the priors, and their derivatives."""
        return [(one.residual, one.slope, one.which) for one in self.rows(numbers)] + self._priors(numbers)

    def _priors(self, numbers: Floats) -> list[Linearized]:
        if not self.open:
            return []
        faults = list(range(self.own, self.count))
        return [(numbers[self.own :], np.eye(len(faults)), faults)]

    def rows(self, numbers: Floats) -> list[Rows]:
        """The residuals, derivatives and tiles of each lamp and channel."""
        if self._weights is None:
            self.reweigh(numbers)
        assert self._weights is not None
        blocks: list[Rows] = []
        for part, weight in zip(self.parts, self._weights, strict=True):
            predicted, slope = self.predicted(part, numbers, True)
            assert slope is not None
            residual, slope = (predicted - part.value) * weight, slope * weight[..., None]
            edges = np.searchsorted(part.lamp, np.arange(len(self.scene.names) + 1))
            for lamp, (start, end) in enumerate(itertools.pairwise(edges)):
                if start == end:
                    continue
                for channel in range(CHANNELS):
                    which = self.of_row(lamp, channel)
                    rows = slice(int(start), int(end))
                    blocks.append(Rows(residual[rows, channel], slope[rows, channel], which, part.tile[rows], lamp))
        return blocks

    # ------------------------------------------------------------------ uncertainty

    def information(self, numbers: Floats) -> tuple[Floats, Floats]:
        """J^T J, and the sum over tiles of the outer products of their scores J^T r, for the pixels without priors."""
        hessian = np.zeros((self.count, self.count))
        tiles = 1 + max(int(part.tile.max()) for part in self.parts)
        gradients = np.zeros((tiles, self.count))
        for residual, slope, which, tile, _ in self.rows(numbers):
            hessian[np.ix_(which, which)] += slope.T @ slope
            for column, number in enumerate(which):
                gradients[:, number] += np.bincount(tile, weights=residual * slope[:, column], minlength=tiles)
        return hessian, gradients.T @ gradients

    def prior(self) -> Floats:
        """The information matrix of the calibration, with 1 on the diagonal for each uncertain quantity."""
        return np.diag(np.r_[np.zeros(self.own), np.ones(len(self.open))])


def middle_of(scene: Scene) -> Floats:
    """The point about which lamps are rotated: the center of the ball or of the flat sample."""
    if scene.ball is not None:
        return scene.ball.center
    flat = scene.flat
    assert flat is not None, "checked when it was read"
    return np.asarray(np.array(flat.base) + 0.5 * (np.array(flat.edge0) + np.array(flat.edge1)))


def across(direction: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors perpendicular to a direction and to each other."""
    aside = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.8 * np.linalg.norm(direction) else np.array([0, 1.0, 0])
    down = np.cross(direction, aside)
    down /= np.linalg.norm(down)
    right = np.cross(down, direction)
    return right / np.linalg.norm(right), down


def inverse_of(matrix: Floats) -> Floats:
    """The inverse of an information matrix, with 0 for parameters without information."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    told = np.diag(matrix) > 0.0
    inverse = np.zeros_like(matrix)
    s = scale[told]
    even = matrix[np.ix_(told, told)] / np.outer(s, s)
    inverse[np.ix_(told, told)] = np.linalg.pinv(even, rcond=1e-12) / np.outer(s, s)
    return inverse
