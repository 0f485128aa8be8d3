"""Directions and integrals over the sphere for tests, in NumPy float64."""

from __future__ import annotations

import numpy as np
from scipy.special import roots_legendre

SEED = 20130731  # the one seed of the suite


def random_directions(count: int, stream: int = 0, upper: bool = False) -> np.ndarray:
    """Uniform unit vectors (count, 3), on the upper side only where asked; `stream` tells draws apart."""
    v = np.random.default_rng([SEED, stream]).normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    if upper:
        v[:, 2] = np.abs(v[:, 2])
    return v


def random_numbers(count: int, stream: int = 0) -> np.ndarray:
    """Uniform (count, 3) in [0, 1) that float32 holds exactly, so no rounding reaches 1."""
    return np.random.default_rng([SEED, 1, stream]).random((count, 3), dtype=np.float32).astype(np.float64)


def at(degrees: float, azimuth: float = 0.0) -> np.ndarray:
    """The unit vector at an angle to +z, and an azimuth, in degrees."""
    t, p = np.radians(degrees), np.radians(azimuth)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def joined(mu: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors from cosines and azimuths, stacked along a new last axis."""
    s = np.sqrt(np.maximum((1.0 - mu) * (1.0 + mu), 0.0))
    return np.stack([s * np.cos(phi), s * np.sin(phi), mu + 0.0 * phi], -1)


def hemisphere(n_mu: int, n_phi: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) of the upper hemisphere and their weights, which add up to 2 pi.

    Gauss-Legendre in the angle theta, so that directions gather at the pole and at the horizon, and equal steps in
    azimuth, exact for every trigonometric polynomial below n_phi.
    """
    x, w = roots_legendre(n_mu)  # NumPy's rule takes seconds for a thousand nodes
    theta = 0.25 * np.pi * (x + 1.0)
    weights = 0.25 * np.pi * w * np.sin(theta)
    phi = 2.0 * np.pi * (np.arange(n_phi) + 0.5) / n_phi
    directions = joined(np.cos(theta)[:, None], phi[None, :]).reshape(-1, 3)
    return directions, np.repeat(weights * 2.0 * np.pi / n_phi, n_phi)


def relative(a: np.ndarray, b: np.ndarray, floor: float = 0.0) -> np.ndarray:
    """|a - b| / max(|b|, floor), 0 where both are equal."""
    difference = np.abs(a - b)
    return np.where(difference == 0, 0.0, difference / np.maximum(np.maximum(np.abs(b), floor), 1e-300))
