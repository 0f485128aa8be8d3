"""From spectra to linear sRGB and back, for tables that were measured by wavelength.

A reflectance is seen under D65 by the CIE 1931 observer, whose curves are the sums of Gaussians of Wyman2013 (they err
by 1 % of the peak at most, the white of a flat reflectance is exact by normalization). Back: the smoothest spectrum of
a colour, a linear map, so that colour -> spectrum -> colour changes nothing.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# CIE standard illuminant D65 at 380, 390, ... 780 nm, relative to 560 nm (CIE 15).
D65 = np.array([
    49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354,
    107.802, 104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
    83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040, 69.8856, 75.0870, 63.5927, 46.4182,
    66.8054, 63.3828,
])  # fmt: skip
XYZ_TO_RGB = np.array([
    [3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252],
])  # fmt: skip
STEPS = 4  # points between two wavelengths, over which what was measured is taken as linear
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def observer(nm: Floats) -> Floats:
    """The curves x, y, z of the CIE 1931 observer, (3, N) (Wyman2013, table 1)."""

    def bell(centre: float, low: float, high: float) -> Floats:
        return np.exp(-0.5 * ((nm - centre) * np.where(nm < centre, low, high)) ** 2)

    x = 0.362 * bell(442.0, 0.0624, 0.0374) + 1.056 * bell(599.8, 0.0264, 0.0323) - 0.065 * bell(501.1, 0.0490, 0.0382)
    y = 0.821 * bell(568.8, 0.0213, 0.0247) + 0.286 * bell(530.9, 0.0613, 0.0322)
    z = 1.217 * bell(437.0, 0.0845, 0.0278) + 0.681 * bell(459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])


@lru_cache
def _to_rgb(wavelengths: tuple[float, ...]) -> Floats:
    nm = np.array(wavelengths)
    if len(nm) == 1:
        return np.ones((1, 3))
    fine = np.unique(np.concatenate([np.linspace(a, b, STEPS + 1) for a, b in pairwise(nm)]))
    hats = np.stack([np.interp(fine, nm, row) for row in np.eye(len(nm))])  # what one measured value stands for
    light = np.interp(fine, np.arange(380.0, 781.0, 10.0), D65, left=0.0, right=0.0)
    width = np.gradient(fine)
    rgb = hats @ (observer(fine) * light * width).T @ XYZ_TO_RGB.T
    total = rgb.sum(axis=0)
    if np.any(np.abs(total) < 1e-3 * np.abs(rgb).sum(axis=0).max()):  # too few wavelengths to tell a colour
        return np.full((len(nm), 3), 1.0 / len(nm))
    return rgb / total


def to_rgb(wavelengths: Floats) -> Floats:
    """The matrix (N, 3) that turns values at increasing wavelengths [nm] into linear sRGB; flat ones give grey."""
    return _to_rgb(tuple(map(float, wavelengths)))


def to_spectrum(wavelengths: Floats) -> Floats:
    """The matrix (3, N) that turns linear sRGB into the smoothest values at these wavelengths which look that way."""
    weights = to_rgb(wavelengths)
    count = len(weights)
    if np.linalg.matrix_rank(weights) < 3:
        return np.full((3, count), 1.0 / 3.0)
    bend = np.diff(np.eye(count), axis=0)
    system = np.block([[bend.T @ bend, weights], [weights.T, np.zeros((3, 3))]])
    return np.linalg.solve(system, np.vstack([np.zeros((count, 3)), np.eye(3)]))[:count].T
