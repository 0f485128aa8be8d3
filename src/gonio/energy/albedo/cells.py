"""A cell of adaptive cubature: Gauss-Legendre nodes inside the cell, and points at its rim, which detect
discontinuities between the nodes and the rim."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...optics.special import gauss

UNSEEN = 0.25  # fraction of a sample's density; if all nodes of its cell are below it, they have missed a lobe
FAINT = 0.01  # fraction of the missed light: nodes detect less only by chance, and nothing in the next cell
OUTSIDE = 0.07  # distance of the first of four nodes from the rim, as a fraction of a cell's width


class Nodes(NamedTuple):
    """Positions (s, t) in the unit square of a cell, and their weights, (K,) each."""

    s: np.ndarray
    t: np.ndarray
    weight: np.ndarray


class Seen(NamedTuple):
    """Values of the integrand in cells.

    integral     weighted sum over the nodes, (cells, ...)
    least, most  smallest and largest value at the nodes, (cells,)
    """

    integral: np.ndarray
    least: np.ndarray
    most: np.ndarray


class Points(NamedTuple):
    """Samples inside cells, which reveal lobes that are narrower than a cell.

    cell     index of each sample's cell, (N,)
    at       the two coordinates of each sample, (N, 2)
    density  the integrand per unit area in these coordinates, (N,)
    light    contribution of the sample to an estimate of the integral, (N,)
    """

    cell: np.ndarray
    at: np.ndarray
    density: np.ndarray
    light: np.ndarray

    def single(self, count: int) -> np.ndarray:
        """Whether each of `count` cells contains exactly one sample."""
        return np.bincount(self.cell, minlength=count) == 1

    def light_in(self, count: int) -> np.ndarray:
        """The sum of the samples' light in each of `count` cells."""
        return np.bincount(self.cell, self.light, count)

    def missed_by(self, area: np.ndarray, most: np.ndarray) -> np.ndarray:
        """An estimate of the light that the nodes of each cell miss, (cells,); 0 unless a sample in the cell is bright
        and all nodes are dark.

        area  area of each cell
        most  largest density at the nodes of each cell, times its area
        """
        bright = np.zeros(len(area))
        np.maximum.at(bright, self.cell, self.density)
        bright *= area
        return np.where(most < UNSEEN * bright, np.minimum(bright, self.light_in(len(area))), 0.0)


def product(order: int) -> Nodes:
    """The product of two Gauss-Legendre rules of `order` nodes."""
    x, w = gauss(order)
    s, t = np.meshgrid(x, x, indexing="ij")
    return Nodes(s.ravel(), t.ravel(), np.outer(w, w).ravel())


def rim(inset: float) -> Nodes:
    """The corners and the midpoints of the sides, moved inward by a fraction `inset` of the width. They are compared
    with the nodes; they are not an integration rule, so their weights are equal."""
    ends = (inset, 0.5, 1.0 - inset)
    near = np.array([(a, b) for a in ends for b in ends if (a, b) != (0.5, 0.5)])
    return Nodes(near[:, 0], near[:, 1], np.full(len(near), 1.0 / len(near)))


def rimmed(inset: float) -> Nodes:
    """A rule with four nodes per direction that is exact to degree 5, like Lobatto's; its outer nodes are at a fraction
    `inset` of the width from the rim. It detects a step between the rim and the first node of a Gauss rule, which the
    Gauss rules miss."""
    outer = (1.0 - 2.0 * inset) ** 2
    inner = (0.2 - outer / 3.0) / (1.0 / 3.0 - outer)
    share = 0.5 * (1.0 / 3.0 - inner) / (outer - inner)
    x = 0.5 + 0.5 * np.array([-np.sqrt(outer), -np.sqrt(inner), np.sqrt(inner), np.sqrt(outer)])
    w = np.array([share, 0.5 - share, 0.5 - share, share])
    s, t = np.meshgrid(x, x, indexing="ij")
    return Nodes(s.ravel(), t.ravel(), np.outer(w, w).ravel())


def step_aside(inside: Seen, rim: Seen, times: float = 4.0) -> np.ndarray:
    """A bound on the part of the integral that is missed between the nodes and the rim, (cells,), if values at the rim
    differ strongly from those at the nodes. No rule resolves a step there, such as the horizon or the critical angle.
    The bound has the unit of `least` and `most`.

    times  ratio of the values above which a difference is not explained by the slope within the cell
    """
    with np.errstate(invalid="ignore"):  # NaN is reported elsewhere
        more = np.where(rim.most > times * inside.most, rim.most - inside.most, 0.0)
        less = np.where(times * rim.least < inside.least, inside.least - rim.least, 0.0)
    return OUTSIDE * np.maximum(more, less)
