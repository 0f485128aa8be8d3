"""Surfaces of long symmetric V-grooves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .base import Floats, Patch, Surface, parameter

GROOVES = 256
STEEPEST = np.radians(89.0)


@dataclass(frozen=True)
class VGroove(Surface):
    """Long symmetric V-grooves whose upper edges lie in one plane (Torrance1967, OrenNayar1994).

    The two sides of a groove have the same slope angle theta_a. The fraction of the surface that grooves with a given
    slope angle cover is Oren and Nayar's slope-area distribution, exp(-theta_a^2 / (2 sigma^2)) sin theta_a. If `slope`
    is given, all grooves have this slope angle. The sample rotates during the measurement, so the result is an average
    over all directions of the grooves.
    """

    name: ClassVar[str] = "vgroove"

    sigma: float = parameter(0.3, "standard deviation of the slope angle", 0.0, 1.5, "rad")
    slope: float | None = parameter(None, "slope angle of all grooves, instead of a distribution", 0.0, 1.5, "rad")

    def patch(self, rng: np.random.Generator) -> Patch:
        depth = 0.5 * np.tan(self.slopes(GROOVES) if self.slope is None else np.full(GROOVES, self.slope))
        depth = np.concatenate([depth[-1:], depth, depth[:1]])  # one additional groove on each side
        x = np.arange(2 * len(depth) + 1) * 0.5 - 1.0 - 0.5 * GROOVES
        z = np.zeros(len(x))
        z[1::2] = -depth
        y = np.array([-1.0, 1.0]) * (0.5 * GROOVES + 1.0)
        vertices = np.stack([np.tile(x, 2), np.repeat(y, len(x)), np.tile(z, 2)], -1)
        a = np.arange(len(x) - 1, dtype=np.uint32)
        b, c, d = a + 1, a + 1 + len(x), a + len(x)
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).astype(np.uint32)
        return Patch(vertices, faces, (float(GROOVES), float(GROOVES)), 0.0)

    def slopes(self, count: int) -> Floats:
        """The slope angles of `count` grooves, which divide the distribution into equal fractions."""
        theta = np.linspace(0.0, STEEPEST, 1 << 14)
        density = np.exp(-0.5 * np.square(theta / max(self.sigma, 1e-9))) * np.sin(theta)
        total = np.cumsum(density)
        if total[-1] <= 0.0:
            return np.zeros(count)
        return np.interp((np.arange(count) + 0.5) / count, total / total[-1], theta)
