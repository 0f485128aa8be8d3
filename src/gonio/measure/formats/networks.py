"""Small neural networks that represent materials in the MERL database (Sztrajman2021)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, did_you_mean
from ..tables.half_difference import HalfDifference
from .base import Format
from .npz import arrays

SHAPES = {"kernel0": (6, 21), "bias0": (21,), "kernel1": (21, 21), "bias1": (21,), "kernel2": (21, 3), "bias2": (3,)}
CELLS = (90, 90, 180)


class Networks(Format):
    """Neural networks of 675 weights (Sztrajman2021): half and difference vector -> 21 -> 21 -> exp(x) - 1 = RGB of f.

    A .npz file contains the arrays NAME/kernel0 to 2 and NAME/bias0 to 2 of one or more materials; FILE.npz:NAME
    selects one of these. The network is evaluated at the cells of a half-difference table of MERL's size. Its values
    below the horizon are extrapolations, so these cells are marked invalid.
    """

    name: ClassVar[str] = "networks"
    suffixes: ClassVar[tuple[str, ...]] = (".npz",)
    several: ClassVar[bool] = True

    def items(self, data: bytes, where: str) -> list[str]:
        names = sorted({name.rpartition("/")[0] for name in arrays(data, where) if "/" in name})
        if not names:
            raise InputError("no networks in this file: no array is named NAME/kernel0", where)
        return names

    def read(self, data: bytes, where: str, item: str = "") -> HalfDifference:
        names = self.items(data, where)
        if not item and len(names) == 1:
            item = names[0]
        if item not in names:
            what = f"no material '{item}' in this file" if item else f"it has {len(names)} materials, one expected"
            hint = did_you_mean(item, names) if item else f"give {where}:{names[0]}, or another of " + ", ".join(names)
            raise InputError(what, where, hint)
        stored = arrays(data, where)
        weights = {}
        for part, shape in SHAPES.items():
            array = stored.get(f"{item}/{part}")
            if array is None or array.shape != shape or array.dtype.kind != "f":
                given = "is missing" if array is None else f"has shape {array.shape} of {array.dtype}"
                raise InputError(f"{item}/{part} {given}, {shape} of floats expected", where)
            if not np.all(np.isfinite(array)):
                raise InputError(f"{item}/{part} has values that are not finite", where, "the file is damaged")
            weights[part] = array.astype(np.float32)
        values, lit = tabulated(weights)
        if not np.all(np.isfinite(values)):
            raise InputError(f"{item}'s values overflow", where, "the file is damaged")
        values[~lit] = -1.0
        return HalfDifference(
            np.maximum(values, np.where(lit[..., None], 0.0, -1.0)), where=where, title=item,
            source={"format": self.name, "item": item},
        )  # fmt: skip


def tabulated(weights: dict[str, NDArray[np.float32]]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The values of a network at the centers of MERL's cells, (90, 90, 180, 3), and a mask of those above the surface.

    The half vector of a cell is (sin theta_h, 0, cos theta_h), and its difference vector is the direction of the light
    in the frame of the half vector.
    """
    n, m, count = CELLS
    theta_h = ((np.arange(n) + 0.5) / n) ** 2 * (0.5 * np.pi)
    theta_d = (np.arange(m) + 0.5)[:, None] / m * (0.5 * np.pi)
    phi_d = (np.arange(count) + 0.5) / count * np.pi
    parts = (np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d) + 0.0 * phi_d)
    difference = np.stack([part.ravel() for part in parts], -1)
    from_difference = (difference @ weights["kernel0"][3:] + weights["bias0"]).astype(np.float32)
    values = np.empty((n, m * count, 3))
    lit = np.empty((n, m * count), bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for row, angle in enumerate(theta_h):
            half = np.array([np.sin(angle), 0.0, np.cos(angle)], np.float32)
            x = np.maximum(from_difference + half @ weights["kernel0"][:3], 0.0)
            x = np.maximum(x @ weights["kernel1"] + weights["bias1"], 0.0)
            values[row] = np.expm1(x @ weights["kernel2"] + weights["bias2"])
            up, along = np.cos(angle) * difference[:, 2], np.abs(np.sin(angle) * difference[:, 0])
            lit[row] = up > along + 1e-9  # both directions are above the surface
    return values.reshape(*CELLS, 3), lit.reshape(CELLS)
