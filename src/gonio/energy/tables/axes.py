"""The axes of baked tables: the positions of the nodes in each layout.

    linear     nodes at texel centers, (j + 1/2) / N, of roughness, mu and, if anisotropic, phi within a quarter turn:
               the layout of shaders and of the homework
    stretched  nodes at both ends, j / (N - 1), of roughness and of s(mu) / s(1), in which E is smooth (see `stretch`):
               the error of bilinear interpolation is a hundredth of that on a linear axis

If the alphas differ, the larger is roughness^2, and the table defines their ratio. E is symmetric in phi about both
axes of the surface, so a quarter turn suffices, and mirroring at its ends is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...optics.masking import term
from ...optics.ndf import distribution
from .. import bend
from ..albedo import normals
from ..albedo.quadrature import Points

LAYOUTS = ("linear", "stretched")


@dataclass(frozen=True)
class Axes:
    """The axes of a table over ([phi,] roughness, mu).

    layout    "linear" or "stretched"
    ndf, masking  names of the distribution and the masking term
    size      number of nodes of roughness, and of mu
    aspect    alpha_y / alpha_x
    azimuths  number of nodes of phi; 0 if the alphas are equal, because such tables have no axis for phi
    """

    layout: str
    ndf: str
    masking: str
    size: int
    aspect: float = 1.0
    azimuths: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the axes, slowest first."""
        return ("phi", "roughness", "mu") if self.azimuths else ("roughness", "mu")

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of nodes along each axis."""
        return (self.azimuths, self.size, self.size) if self.azimuths else (self.size, self.size)

    def at(self, *index: Any) -> Points:
        """The points at given indices.

        index  one array per axis, broadcast against each other; integers are nodes, other values lie between nodes
        """
        roughness = self.roughness(index[-2])
        if not self.azimuths:
            mu, alpha = np.broadcast_arrays(self.mu(index[-1], roughness), roughness**2)
            return Points(mu, alpha, None, 0.0)
        phi = self.phi(index[0])
        return Points(*np.broadcast_arrays(self.mu(index[-1], roughness, phi), *self.widths(roughness), phi))

    def nodes(self) -> Points:
        """All nodes of the table, in the shape of its axes."""
        return self.at(*np.ix_(*map(np.arange, self.shape)))

    def roughness(self, index: Any) -> np.ndarray:
        """Roughness at an index."""
        return self._unit(index, self.size)

    def phi(self, index: Any) -> np.ndarray:
        """Azimuth at an index. In the stretched layout, the steps of the azimuth are equal after slopes have been
        divided by the alphas."""
        turn = self._unit(index, self.azimuths) * (0.5 * np.pi)
        return turn if self.layout == "linear" else np.arctan2(np.sin(turn), self.aspect * np.cos(turn))

    def mu(self, index: Any, roughness: Any, phi: Any = 0.0) -> np.ndarray:
        """Cosine at an index, for a given roughness and azimuth."""
        x = self._unit(index, self.size)
        if self.layout == "linear":
            return x + 0.0 * roughness + 0.0 * phi
        alpha_x, alpha_y = self.widths(roughness)
        return stretched_mu(self.ndf, self.masking, np.hypot(alpha_x * np.cos(phi), alpha_y * np.sin(phi)), x)

    def widths(self, roughness: Any) -> tuple[np.ndarray, np.ndarray]:
        """(alpha_x, alpha_y); the larger is roughness^2."""
        alpha = np.asarray(roughness) ** 2
        return alpha * min(1.0, 1.0 / self.aspect), alpha * min(1.0, self.aspect)

    def arrays(self) -> dict[str, np.ndarray]:
        """The nodes of each axis by name. In the stretched layout, the nodes of mu are given per row (and slice)."""
        index = np.ix_(*map(np.arange, self.shape))
        nodes = self.at(*index)
        mu = nodes.mu if self.layout == "stretched" else nodes.mu[(0,) * (len(self.shape) - 1)]
        ends = {"mu": np.array(mu), "roughness": self.roughness(np.arange(self.size))}
        return {**ends, "phi": self.phi(np.arange(self.azimuths))} if self.azimuths else ends

    def texts(self) -> dict[str, str]:
        """Descriptions of the axes for readers of a table."""
        if self.layout == "linear":
            text = {"roughness": "row j at (j + 1/2) / N", "mu": "column j at (j + 1/2) / N"}
            return {**text, "phi": "slice j at (j + 1/2) / N of 90 degrees from x"} if self.azimuths else text
        _, form = stretch(self.ndf, self.masking)
        text = {"roughness": "row j at j / (N - 1)", "mu": f"column j at s(mu) / s(1) = j / (N - 1), s = {form}"}
        if self.azimuths:
            text["mu"] += ", alpha = |(alpha_x cos phi, alpha_y sin phi)|"
            text["phi"] = "slice j at tan(phi) = (alpha_x / alpha_y) tan(j / (N - 1) of 90 degrees)"
        return text

    def _unit(self, index: Any, count: int) -> np.ndarray:
        if self.layout == "linear":
            return (np.asarray(index) + 0.5) / count
        return np.asarray(index) / (count - 1) if count > 1 else np.asarray(index) * 0.0 + 1.0


def stretch(ndf: str, masking: str) -> tuple[bend.Form, str]:
    """The transform of mu to the s of the stretched axis, and its description."""
    if not term(masking).smith:
        return bend.Form(0, 1, 2.0), "sqrt(mu / (mu + 4 k)), k of the masking"
    if distribution(ndf).falls_slowly:
        return bend.Form(0, 1, 4.0), "sqrt(mu / (mu + 4 alpha))"
    return bend.Form(1, 2, 4.0), "sqrt(mu / sqrt(mu^2 + (4 alpha)^2))"


def stretched_mu(ndf: str, masking: str, alpha: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The cosine at a position x in [0, 1] of the stretched axis, for a given alpha."""
    form, _ = stretch(ndf, masking)
    knee = bend.numpy_knee(form, masking, np.maximum(alpha, normals.SMALLEST_ALPHA))
    return bend.cosine(form, x, knee)
