"""A cell of adaptive cubature: Gauss-Legendre nodes inside, and points at its rim, which detect steps between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...optics.special import gauss

OUTSIDE = 0.07  # fraction of a cell's width outside the first of four nodes


class Nodes(NamedTuple):
    """Positions in [0, 1]^2 of a cell, and their weights, (K,) each."""

    s: np.ndarray
    t: np.ndarray
    weight: np.ndarray


class Seen(NamedTuple):
    """Per cell: the weighted sum over the nodes, (cells, ...), and the smallest and largest value, (cells,)."""

    integral: np.ndarray
    least: np.ndarray
    most: np.ndarray


def product(order: int) -> Nodes:
    """Gauss-Legendre in both directions, `order` nodes each."""
    x, w = gauss(order)
    s, t = np.meshgrid(x, x, indexing="ij")
    return Nodes(s.ravel(), t.ravel(), np.outer(w, w).ravel())


def rim(inset: float) -> Nodes:
    """The corners and the midpoints of the sides, moved inward by a fraction of the width; not an integration rule, so
    they have equal weights, for comparison with the nodes."""
    ends = (inset, 0.5, 1.0 - inset)
    near = np.array([(a, b) for a in ends for b in ends if (a, b) != (0.5, 0.5)])
    return Nodes(near[:, 0], near[:, 1], np.full(len(near), 1.0 / len(near)))


def rimmed(inset: float) -> Nodes:
    """A rule of four nodes per direction that is exact to degree 5, as Lobatto's, with the outer ones at a fraction of
    the width from the rim: a step between the rim and the first node of Gauss's rules, which these miss, changes it.
    """
    outer = (1.0 - 2.0 * inset) ** 2
    inner = (0.2 - outer / 3.0) / (1.0 / 3.0 - outer)
    share = 0.5 * (1.0 / 3.0 - inner) / (outer - inner)
    x = 0.5 + 0.5 * np.array([-np.sqrt(outer), -np.sqrt(inner), np.sqrt(inner), np.sqrt(outer)])
    w = np.array([share, 0.5 - share, 0.5 - share, share])
    s, t = np.meshgrid(x, x, indexing="ij")
    return Nodes(s.ravel(), t.ravel(), np.outer(w, w).ravel())


def step_aside(inside: Seen, rim: Seen, times: float = 4.0) -> np.ndarray:
    """Bound on the integral missed between the nodes and the rim if the values at the rim differ strongly, (cells,): no
    rule resolves a step there, such as the horizon or the critical angle.

    In the units of `least` and `most`.

    times  the ratio above which a difference is not explained by the cell's own slope
    """
    with np.errstate(invalid="ignore"):  # NaN is reported elsewhere
        more = np.where(rim.most > times * inside.most, rim.most - inside.most, 0.0)
        less = np.where(times * rim.least < inside.least, inside.least - rim.least, 0.0)
    return OUTSIDE * np.maximum(more, less)
