"""The values of `eval` at test directions for a guide: the sides on which a material is lit, and its symmetries."""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..ops import backend

Grid: TypeAlias = "NDArray[np.float64]"

PROBES = 768  # pairs of directions
SAME = 0.02  # relative difference below which two sides, or two azimuths, count as equal


class Guided(Protocol):
    """The members of a material that a guide needs."""

    @property
    def transmits(self) -> bool: ...

    def eval(self, wo: Any, wi: Any) -> Any: ...


def direction(angle: Grid, azimuth: float, side: float) -> tuple[Grid, Grid, Grid]:
    sine = np.sin(angle)
    return sine * np.cos(azimuth), sine * np.sin(azimuth), side * np.cos(angle)


def mean_light(material: Guided, wo: tuple[Grid, ...], wi: tuple[Grid, ...]) -> Grid:
    """Mean of |eval| over the channels; 0 where it is not finite."""
    types = backend.types("float32")
    shape = np.broadcast_shapes(*(np.shape(x) for x in (*wo, *wi)))

    def vector(w: tuple[Grid, ...]) -> Any:
        return types.vec3(*(types.float(backend.aligned(np.broadcast_to(x, shape).ravel(), np.float32)) for x in w))

    value = material.eval(vector(wo), vector(wi))
    channels = backend.to_numpy(value, int(np.prod(shape))).astype(float)
    mean = np.abs(channels).mean(-1) if channels.ndim == 2 else np.abs(channels)
    return np.where(np.isfinite(mean), mean, 0.0).reshape(shape)


def _pairs(side: float) -> tuple[Grid, Grid]:
    """Pairs of test directions with wo on one side: wi is near reflection, retro-reflection or transmission, or
    arbitrary."""
    rng = np.random.default_rng(7)
    wo, wi = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in rng.normal(size=(2, PROBES, 3)))
    wo[:, 2] = side * np.abs(wo[:, 2])
    kind, width = np.arange(PROBES) % 4, 0.3 ** (np.arange(PROBES) // 4 % 6)
    about = np.array([[-1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]])[np.minimum(kind, 2)] * wo
    near = about + width[:, None] * rng.normal(size=(PROBES, 3))
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    return wo, np.where((kind < 3)[:, None], near, wi)


def probe(material: Guided, side: float) -> Grid:
    """The mean of |eval| at the test pairs.

    side  1 for wo above the surface; -1 for wo below, where the pairs are mirror images of those above
    """
    wo, wi = _pairs(1.0)
    flip = np.array([1.0, 1.0, side])
    return mean_light(material, tuple((wo * flip).T), tuple((wi * flip).T))


def _differ(a: Grid, b: Grid) -> bool:
    """Whether the values of more than 2 % of the pairs differ."""
    largest = np.maximum(a, b)
    lit = largest > 1e-6 * float(np.max(largest, initial=0.0))
    return bool(np.mean(np.abs(a - b)[lit] > SAME * largest[lit]) > 0.02) if np.any(lit) else False


def alike(above: Grid, below: Grid) -> bool:
    return not _differ(above, below)


def depends_on_azimuth(material: Guided, side: float) -> bool:
    """Whether `eval` changes under rotation about the normal."""
    wo, wi = _pairs(side)
    turn = np.random.default_rng(8).uniform(0.0, 2.0 * np.pi, PROBES)
    cos, sin = np.cos(turn), np.sin(turn)

    def rotated(w: Grid) -> tuple[Grid, ...]:
        return cos * w[:, 0] - sin * w[:, 1], sin * w[:, 0] + cos * w[:, 1], w[:, 2]

    return _differ(mean_light(material, tuple(wo.T), tuple(wi.T)), mean_light(material, rotated(wo), rotated(wi)))
