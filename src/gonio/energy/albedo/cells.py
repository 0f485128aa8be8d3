"""What adaptive cubature knows of one cell: Gauss-Legendre nodes inside, and the rim, where a step hides from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...optics.special import gauss

OUTSIDE = 0.07  # the share of a cell's width beyond the first of four nodes


class Nodes(NamedTuple):
    """Places in [0, 1]^2 of a cell, and their weights, (K,) each."""

    s: np.ndarray
    t: np.ndarray
    weight: np.ndarray


class Seen(NamedTuple):
    """Of each cell: the integral by the nodes' weights, (cells, ...), and the least and the most at them, (cells,)."""

    integral: np.ndarray
    least: np.ndarray
    most: np.ndarray


def product(order: int) -> Nodes:
    """Gauss-Legendre in both directions, `order` nodes each."""
    x, w = gauss(order)
    s, t = np.meshgrid(x, x, indexing="ij")
    return Nodes(s.ravel(), t.ravel(), np.outer(w, w).ravel())


def rim(inset: float) -> Nodes:
    """The corners and the middles of the sides, a share of the width inside; no rule for an integral, so with even
    weights, to compare with the nodes'."""
    ends = (inset, 0.5, 1.0 - inset)
    near = np.array([(a, b) for a in ends for b in ends if (a, b) != (0.5, 0.5)])
    return Nodes(near[:, 0], near[:, 1], np.full(len(near), 1.0 / len(near)))


def step_aside(inside: Seen, rim: Seen, times: float = 4.0) -> np.ndarray:
    """What is lost, or taken for lit, between the nodes and the rim where the rim is quite another, (cells,): a step
    that runs there, such as the horizon's or total reflection's, is seen by no rule.

    In the units of `least` and `most`.

    times  by how much another: what a cell's own slope does not make of it
    """
    with np.errstate(invalid="ignore"):  # values that are no numbers are for others to find
        more = np.where(rim.most > times * inside.most, rim.most - inside.most, 0.0)
        less = np.where(times * rim.least < inside.least, inside.least - rim.least, 0.0)
    return OUTSIDE * np.maximum(more, less)
