"""Directions: conversion from and to angles, uniform sampling, rounding and rotation."""

from __future__ import annotations

import numpy as np

from ..errors import InputError


def at(theta: float | np.ndarray, phi: float | np.ndarray = 0.0) -> np.ndarray:
    """Unit vectors (..., 3) at theta from +z and azimuth phi, both in degrees; exactly (0, 0, 1) at theta = 0."""
    t, p = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    # measured from the nearer pole: sin(pi) is not 0 in floating point
    below = t > 0.5 * np.pi
    from_pole = np.where(below, np.radians(180.0 - np.asarray(theta, float)), t)
    z = np.where(below, -np.cos(from_pole), np.cos(from_pole))
    return np.stack([np.sin(from_pole) * np.cos(p), np.sin(from_pole) * np.sin(p), z], axis=-1)


def angles(w: np.ndarray) -> np.ndarray:
    """(theta, phi) of unit vectors (..., 3) in degrees, phi in [0, 360)."""
    w = np.asarray(w, float)
    theta = np.degrees(np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2]))
    return np.stack([theta, np.degrees(np.arctan2(w[..., 1], w[..., 0])) % 360.0], axis=-1)


def text(w: np.ndarray) -> str:
    """A direction as a string "theta,phi" in degrees, the form that `--at` accepts."""
    theta, phi = angles(w)
    return f"{theta:.9g},{phi:.9g}"


def parse(pair: str) -> tuple[np.ndarray, np.ndarray]:
    """(wo, wi) from a string "theta_o,phi_o/theta_i,phi_i" in degrees. Raises InputError if it is malformed."""
    try:
        (to, po), (ti, pi) = ([float(x) for x in part.split(",")] for part in pair.split("/"))
    except ValueError:
        hint = "give theta_o,phi_o/theta_i,phi_i in degrees, such as 30,0/45,180"
        raise InputError(f"'{pair}' is not a pair of directions", "--at", hint) from None
    return at(to, po), at(ti, pi)


def uniform(rng: np.random.Generator, count: int) -> np.ndarray:
    """Uniform unit vectors (count, 3) on the whole sphere."""
    z = rng.uniform(-1.0, 1.0, count)
    phi = rng.uniform(0.0, 2.0 * np.pi, count)
    r = np.sqrt((1.0 - z) * (1.0 + z))
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def on_side(w: np.ndarray, side: int) -> np.ndarray:
    """The directions mirrored to one side of the surface: +1 above, -1 below."""
    w = w.copy()
    w[:, 2] = side * np.abs(w[:, 2])
    return w


def numbers(rng: np.random.Generator, count: int) -> np.ndarray:
    """Uniform random numbers (count, 3) in [0, 1) that are exact in float32, so that none is rounded up to 1."""
    return rng.random((count, 3), dtype=np.float32).astype(np.float64)


def single(w: np.ndarray) -> np.ndarray:
    """The directions rounded to float32, as float64 arrays, so that both precisions get the same input."""
    return w.astype(np.float32).astype(np.float64)


def rotated(w: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Directions (N, 3) rotated about the normal by angles (N,), radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * w[:, 0] - s * w[:, 1], s * w[:, 0] + c * w[:, 1], w[:, 2]], -1)
