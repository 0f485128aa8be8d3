"""The angles at which the values of a material are known: all angles, except for measured tables that cover fewer."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

Ends: TypeAlias = "tuple[float, float]"
SLACK = 0.1  # degrees by which the last node of a table may lie above the horizon


class AngularRange(NamedTuple):
    """The smallest and largest value of each angle, in degrees.

    view     angle between wo and the normal, 0 to 90
    light    angle between wi and the normal or its opposite, 0 to 90
    azimuth  difference between the azimuths of wo and wi, 0 to 180
    """

    view: Ends = (0.0, 90.0)
    light: Ends = (0.0, 90.0)
    azimuth: Ends = (0.0, 180.0)

    @property
    def everything(self) -> bool:
        """Whether the range includes all angles."""
        return self == EVERYWHERE

    def within(self, other: AngularRange) -> AngularRange:
        """The intersection with another range."""
        ends = [(max(a[0], b[0]), min(a[1], b[1])) for a, b in zip(self, other, strict=True)]
        return AngularRange(*ends)

    def holds(self, wo: NDArray[np.floating], wi: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Whether each pair of unit vectors, (N, 3) each, lies in the range."""
        known = np.ones(len(wi), bool)
        azimuth = np.abs(np.arctan2(wo[:, 0] * wi[:, 1] - wo[:, 1] * wi[:, 0], np.sum(wo[:, :2] * wi[:, :2], axis=1)))
        angles = (
            (_from_normal(wo), self.view, EVERYWHERE.view),
            (_from_normal(wi), self.light, EVERYWHERE.light),
            (np.degrees(azimuth), self.azimuth, EVERYWHERE.azimuth),
        )
        for angle, (low, high), (lowest, highest) in angles:
            if low > lowest:
                known &= angle >= low - 1e-4
            if high < highest:
                known &= angle <= high + 1e-4
        return known

    def __str__(self) -> str:
        names = ("θo", "θi", "Δφ")
        parts = [
            f"{name} from {low:.3g}° to {high:.3g}°"
            for name, (low, high), ends in zip(names, self, EVERYWHERE, strict=True)
            if (low, high) != ends
        ]
        return " and ".join(parts) or "everywhere"


EVERYWHERE = AngularRange()


def of_nodes(view: NDArray[np.floating], light: NDArray[np.floating], azimuth: NDArray[np.floating]) -> AngularRange:
    """The range that a table covers, from its sorted nodes in radians.

    view, light, azimuth  nodes of the angles as in `AngularRange`; an axis without nodes has the full range
    """
    ranges = []
    for nodes, (lowest, highest) in zip((view, light, azimuth), EVERYWHERE, strict=True):
        low, high = (np.degrees(nodes[0]), np.degrees(nodes[-1])) if len(nodes) else (lowest, highest)
        low = lowest if low < lowest + SLACK else round(float(low), 4)  # files hold radians converted from degrees
        high = highest if high > highest - SLACK else round(float(high), 4)
        ranges.append((low, high))
    return AngularRange(*ranges)


def _from_normal(w: NDArray[np.floating]) -> NDArray[np.float64]:
    """The angle to the normal or to its opposite, whichever is smaller, in degrees."""
    return np.degrees(np.arctan2(np.hypot(w[:, 0], w[:, 1]), np.abs(w[:, 2])))
