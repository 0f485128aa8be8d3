"""Random surfaces with a Gaussian distribution of heights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .base import Floats, Patch, Surface, of_heights, parameter


@dataclass(frozen=True)
class Gaussian(Surface):
    """Gaussian heights with the autocorrelation exp(-(d / length)^2), whose slopes have Beckmann's distribution.

    The slope of a triangle is a difference of heights and therefore Gaussian on any grid. The heights are scaled to a
    mean square slope of alpha^2 / 2 along each axis, so alpha is the width of the Beckmann distribution (Walter2007).
    The correlation affects only the masking, because Smith's G assumes independent heights and slopes. The periodic
    heights are white noise filtered by FFT.
    """

    name: ClassVar[str] = "gaussian"
    random: ClassVar[bool] = True

    alpha: float = parameter(0.3, "width of Beckmann's distribution, sqrt(2) times the rms slope", 0.0, 3.0)
    length: float = parameter(3.0, "length over which heights are correlated, in squares of the grid", 1.5, 64.0)
    squares: int = parameter(512, "number of grid squares along each side of the period", 16, 2048)

    def patch(self, rng: np.random.Generator) -> Patch:
        heights = heights_of(rng.standard_normal((self.squares, self.squares)), self.length)
        rises = [np.mean(np.square(np.roll(heights, -1, axis) - heights)) for axis in (0, 1)]
        return of_heights(heights * (self.alpha / np.sqrt(sum(rises))))


def heights_of(noise: Floats, length: float) -> Floats:
    """Filter white noise to an autocorrelation of exp(-(d / length)^2)."""
    k = [2.0 * np.pi * np.fft.fftfreq(count) for count in noise.shape]
    square = k[0][:, None] ** 2 + k[1][: noise.shape[1] // 2 + 1] ** 2
    spectrum = np.fft.rfft2(noise) * np.exp(-0.125 * length**2 * square)
    return np.fft.irfft2(spectrum, noise.shape)
