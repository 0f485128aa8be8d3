"""The directions inside a coat for which `interior` computes its series, and samples distributed to them."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...optics import frame

Floats: TypeAlias = "NDArray[np.floating]"

HALF = 16  # steps for directions that leave, and for those that are totally reflected
EPSILON = 1e-9


def directions(mu: Floats, lattice: Floats) -> Floats:
    """Directions with each cosine at each azimuth of the lattice, (len(mu) * len(lattice), 3)."""
    phi, sin = np.tile(2.0 * np.pi * lattice[:, 3], len(mu)), np.repeat(np.sqrt(1.0 - mu**2), len(lattice))
    return frame.spherical_array(sin, np.repeat(mu, len(lattice)), phi)


def places(index: float) -> tuple[Floats, Floats]:
    """The positions of the nodes, and their cosines inside. For light that can leave, the position is the square root
    of the cosine outside, from 0 to 1, because the amount of this light varies rapidly at grazing angles; positions
    from -1 to 0 are for light that is totally reflected."""
    place = np.linspace(-1.0, 1.0, 2 * HALF + 1)
    critical = np.sqrt(max(1.0 - index**-2, 0.0))
    mu = np.where(place >= 0.0, np.sqrt(1.0 - (1.0 - place**4) / index**2), critical * (1.0 - place**2))
    return place, np.clip(mu, 1e-4, 1.0)


def place_of(cosine: Floats, index: float) -> Floats:
    """The positions that correspond to the cosines of directions inside."""
    outside2 = 1.0 - index**2 * (1.0 - cosine**2)
    critical = np.sqrt(max(1.0 - index**-2, 0.0))
    beyond = -np.sqrt(np.maximum(1.0 - cosine / max(critical, EPSILON), 0.0))
    place: Floats = np.clip(np.where(outside2 > 0.0, np.maximum(outside2, 0.0) ** 0.25, beyond), -1.0, 1.0)
    return place


class Spread(NamedTuple):
    """Samples of light inside the coat, each distributed to the two nodes next to its direction.

    weight   weight of each sample, (rows, samples)
    inverse  1 / cosine: the length of a crossing of the coat
    cell     index of the lower of the two nodes in a matrix with a row for each row of samples
    part     fraction of the weight that is assigned to the upper node
    """

    weight: Floats
    inverse: Floats
    cell: Floats
    part: Floats

    @classmethod
    def of(cls, weight: Floats, cosine: Floats, index: float) -> Spread:
        scaled = (place_of(cosine, index) + 1.0) * HALF
        low = np.minimum(scaled, 2 * HALF - EPSILON).astype(int)
        return cls(weight, 1.0 / cosine, low + np.arange(len(weight))[:, None] * (2 * HALF + 1), scaled - low)

    def left(self, u: float) -> Floats:
        """The weights after a crossing of a coat with the transmittance u at normal incidence."""
        return np.asarray(self.weight * u**self.inverse)

    def matrix(self, weight: Floats) -> Floats:
        """Weights of the samples, summed at the nodes, (rows, nodes)."""
        count = 2 * HALF + 1
        size = count * len(weight)
        sums = np.bincount(self.cell.ravel(), (weight * (1.0 - self.part)).ravel(), size)
        sums += np.bincount((self.cell + 1).ravel(), (weight * self.part).ravel(), size)
        return np.asarray(sums, float).reshape(len(weight), count)


def at_nodes(x: Floats, nodes: Floats) -> Floats:
    """The matrix that interpolates linearly between values at nodes."""
    return np.stack([np.interp(x, nodes, one) for one in np.eye(len(nodes))], -1)
