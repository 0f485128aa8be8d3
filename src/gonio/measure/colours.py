"""Convert spectra to linear sRGB and back, for tables that are measured by wavelength.

The color of a reflectance is computed for illuminant D65 and the CIE 1931 observer, whose color matching functions are
the Gaussian fits of Wyman2013 (with errors of at most 1 % of the peak). By normalization, a constant reflectance is
exactly gray. The inverse is a linear map that gives the smoothest spectrum with a given color, so the color of this
spectrum is the original color.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from ..optics.colour import D65, LUMINANCE, XYZ_TO_RGB, Floats, observer

__all__ = ["D65", "LUMINANCE", "XYZ_TO_RGB", "observer", "to_rgb", "to_spectrum"]

STEPS = 4  # integration steps between two measured wavelengths; values are interpolated linearly


@lru_cache
def _to_rgb(wavelengths: tuple[float, ...]) -> Floats:
    nm = np.array(wavelengths)
    if len(nm) == 1:
        return np.ones((1, 3))
    fine = np.unique(np.concatenate([np.linspace(a, b, STEPS + 1) for a, b in pairwise(nm)]))
    hats = np.stack([np.interp(fine, nm, row) for row in np.eye(len(nm))])  # the basis function of one measured value
    light = np.interp(fine, np.arange(380.0, 781.0, 10.0), D65, left=0.0, right=0.0)
    width = np.gradient(fine)
    rgb = hats @ (observer(fine) * light * width).T @ XYZ_TO_RGB.T
    total = rgb.sum(axis=0)
    if np.any(np.abs(total) < 1e-3 * np.abs(rgb).sum(axis=0).max()):  # too few wavelengths to determine a color
        return np.full((len(nm), 3), 1.0 / len(nm))
    return rgb / total


def to_rgb(wavelengths: Floats) -> Floats:
    """The (N, 3) matrix from values at increasing wavelengths [nm] to linear sRGB; constant values give gray."""
    return _to_rgb(tuple(map(float, wavelengths)))


def to_spectrum(wavelengths: Floats) -> Floats:
    """The (3, N) matrix that converts linear sRGB to the smoothest spectrum of this color at the given wavelengths."""
    weights = to_rgb(wavelengths)
    count = len(weights)
    if np.linalg.matrix_rank(weights) < 3:
        return np.full((3, count), 1.0 / 3.0)
    bend = np.diff(np.eye(count), axis=0)
    system = np.block([[bend.T @ bend, weights], [weights.T, np.zeros((3, 3))]])
    return np.linalg.solve(system, np.vstack([np.zeros((count, 3)), np.eye(3)]))[:count].T
