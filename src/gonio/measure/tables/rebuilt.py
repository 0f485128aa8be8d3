"""Adaptive tables stored without the densities of their visible normals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from .adaptive import Adaptive
from .base import Floats, axis, finite

LARGEST = 1 << 23  # maximum number of values of a rebuilt `vndf`: six times the largest in the RGL's files
ROUNDS = 12  # rounds, each of which solves for the normals and for the scale of each view


class Rebuilt(Adaptive):
    """An adaptive table whose `vndf` is not stored but computed as D max(0, wo.m) d omega_m / du (Dupuy2018, eq. 5).

    The array `normals` holds D over (phi_m, theta_m), or over theta_m only; in most files it equals `ndf`. The density
    for each view direction is normalized when it is computed, so the projected area is not needed.
    """

    name = "adaptive-rebuilt"
    axes: ClassVar[Mapping[str, str]] = {**Adaptive.axes, "normals": "D over the unit square, up to a factor"}

    def __init__(self, arrays: Mapping[str, NDArray[np.generic]], where: str = "", **about: ops.Value) -> None:
        self.normals = finite(arrays["normals"], "normals", where)
        phi, theta = (axis(arrays[name], name, where, -np.pi, 2.0 * np.pi) for name in ("phi_i", "theta_i"))
        rows, columns = (int(x) for x in np.asarray(arrays["shape"]).ravel())
        if min(rows, columns) < 2 or rows * columns * len(phi) * len(theta) > LARGEST:
            what = f"visible normals of {rows} x {columns} for {len(phi)} x {len(theta)} views"
            raise InputError(f"{what}, at most {LARGEST} values expected", where, "the file is damaged")
        if self.normals.shape not in ((columns,), (rows, columns)) or self.normals.min() < 0.0:
            what = f"normals of shape {self.normals.shape}, ({rows}, {columns}) and not negative expected"
            raise InputError(what, where, "the file is damaged")
        cosines = facing(phi, theta, rows, columns)
        own = {**arrays, "vndf": scaled(cosines * self.normals)}
        super().__init__(own, bool(arrays["jacobian"].ravel()[0]), where=where, **about)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        own = {name: array for name, array in super().arrays().items() if name != "vndf"}
        arrays: dict[str, NDArray[np.generic]] = {
            name: array.astype(np.float32) if array.dtype.kind == "f" else array for name, array in own.items()
        }
        shape = np.array(self.vndf.shape[2:], np.int32)
        return {**arrays, "normals": self.normals.astype(np.float32), "shape": shape}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Rebuilt:
        return cls(arrays, **about)


def facing(phi: Floats, theta: Floats, rows: int, columns: int) -> Floats:
    """max(0, wo.m) d omega_m / du at the nodes of the unit square, (phi_i, theta_i, phi_m, theta_m).

    For an isotropic table, phi_m is relative to the azimuth of the view direction.
    """
    x = np.linspace(0.0, 1.0, columns)
    theta_m, phi_m = x * x * (0.5 * np.pi), np.linspace(-np.pi, np.pi, rows)
    turn = phi_m if len(phi) <= 2 else phi_m - phi[:, None]
    turn = np.broadcast_to(turn, (len(phi), rows))[:, None, :, None]
    o = theta[None, :, None, None]
    cosine = np.sin(o) * np.sin(theta_m) * np.cos(turn) + np.cos(o) * np.cos(theta_m)
    return np.maximum(cosine, 0.0) * (2.0 * np.pi**2 * x * np.sin(theta_m))


def scaled(densities: Floats) -> Floats:
    """Densities, scaled to a mean of 1 for each view direction."""
    mean = densities.mean(axis=(2, 3), keepdims=True)
    return densities / np.where(mean > 0.0, mean, 1.0)


def normals_of(table: Adaptive) -> Floats:
    """D over the unit square, fitted so that D max(0, wo.m) d omega_m / du approximates `vndf`.

    The fit is a least-squares fit over all view directions, each with a free scale factor. D depends on theta_m only if
    the table is isotropic.
    """
    rows, columns = table.vndf.shape[2:]
    cosines = facing(table.phi, table.theta, rows, columns)
    over = (0, 1, 2) if table.isotropic else (0, 1)
    wanted = scaled(table.vndf)
    # start from `ndf`, which in most files is the solution
    normals = np.stack([np.interp(_places(columns), _places(table.ndf.shape[1]), row) for row in table.ndf])
    normals = np.stack([np.interp(_places(rows), _places(len(normals)), column) for column in normals.T], axis=1)
    normals = normals.mean(axis=0) if table.isotropic else normals
    for _ in range(ROUNDS):
        projected = cosines * normals
        below = (projected * projected).sum(axis=(2, 3), keepdims=True)
        weight = cosines * (projected * wanted).sum(axis=(2, 3), keepdims=True) / np.where(below > 0.0, below, 1.0)
        below = (weight * weight).sum(axis=over)
        normals = np.where(below > 0.0, (weight * wanted).sum(axis=over) / np.where(below > 0.0, below, 1.0), normals)
    return np.maximum(normals, 0.0)


def rebuilding(table: Adaptive) -> dict[str, NDArray[np.generic]]:
    """The arrays that `Rebuilt` requires instead of `vndf`."""
    return {"normals": normals_of(table), "shape": np.array(table.vndf.shape[2:], np.int32)}


def _places(count: int) -> Floats:
    return np.linspace(0.0, 1.0, count)
