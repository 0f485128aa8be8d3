"""The conversion of spectra to colors: CIE observer, daylight (D65) and linear sRGB."""

from __future__ import annotations

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
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def observer(nm: Floats) -> Floats:
    """The CIE 1931 color-matching functions x, y, z at wavelengths in nm, (3, N), as fitted in Wyman2013, table 1."""

    def bell(center: float, low: float, high: float) -> Floats:
        return np.exp(-0.5 * ((nm - center) * np.where(nm < center, low, high)) ** 2)

    x = 0.362 * bell(442.0, 0.0624, 0.0374) + 1.056 * bell(599.8, 0.0264, 0.0323) - 0.065 * bell(501.1, 0.0490, 0.0382)
    y = 0.821 * bell(568.8, 0.0213, 0.0247) + 0.286 * bell(530.9, 0.0613, 0.0322)
    z = 1.217 * bell(437.0, 0.0845, 0.0278) + 0.681 * bell(459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])


WAVELENGTHS = np.arange(380.0, 781.0, 10.0)  # nm, of D65


def weights(nm: Floats) -> Floats:
    """Weights, (N, 3), for the values of a reflectance at equally spaced wavelengths in nm. The weighted sum is its
    linear sRGB color under D65; a constant reflectance gives gray.
    """
    light = np.interp(nm, WAVELENGTHS, D65, left=0.0, right=0.0)
    rgb = (observer(nm) * light).T @ XYZ_TO_RGB.T
    chromaticity: Floats = rgb / rgb.sum(axis=0)
    return chromaticity
