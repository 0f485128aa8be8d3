"""Specimens of the goniometer, which are lit from one direction and measured by a detector in another direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...catalog.notation import written
from ...errors import InputError
from ...material import BSDF

Floats = NDArray[np.float64]
GROUPS = 8  # number of independent parts of a measurement, from whose spread the standard error is estimated
BOUNCES = {"all": "all light", "first": "light reflected once", "later": "light reflected twice or more"}
RINGS = (1, 6, 12, 18)  # points per ring of the detector's aperture; each point represents the same area


class Specimen:
    """An object that the goniometer measures.

    title  title to store in the file
    about  settings of the measurement to store in the file
    exact  whether readings have no statistical error; bounces are then not separated
    """

    title: str
    about: dict[str, str]
    exact: ClassVar[bool] = False

    def prepare(self, theta_i: Floats) -> None:
        """Prepare for measurements at the given angles of incidence [rad]; `f` is called for no other angles."""

    def f(self, wo: Floats, wi: Floats, part: int | None = None, bounces: str = "all") -> Floats:
        """f for light from wi, averaged over the aperture of a detector at wo, (N, 3), 1/sr.

        part     index of one of `GROUPS` independent measurements; None for the mean of all
        bounces  the light to measure, a key of `BOUNCES`
        """
        raise NotImplementedError


class Model(Specimen):
    """A material, whose model is evaluated instead of tracing rays."""

    exact: ClassVar[bool] = True

    def __init__(self, material: BSDF, solid_angle: float | None, title: str = "") -> None:
        if not material.isotropic:
            raise InputError("this material is anisotropic", material.name, "measurement files hold isotropic ones")
        if material.delta != "never":
            what = f"{material.name} is a mirror: a delta lobe has no finite value"
            raise InputError(what, "MODEL", "give it some roughness, such as --param alpha=0.05")
        self.material, self.title = material, title or written(material)
        self._opening = opening(solid_angle)
        size = "a point" if solid_angle is None else f"{solid_angle:g} sr"
        about = {"instrument": "a model, evaluated", "material": written(material), "detector": size}
        self.about = {"format": "gonio", **about}

    def f(self, wo: Floats, wi: Floats, part: int | None = None, bounces: str = "all") -> Floats:
        total, weight = np.zeros((len(wo), 3)), np.zeros((len(wo), 1))
        for direction in to_frame(wo, self._opening):
            cos = np.maximum(direction[:, 2:], 0.0) if len(self._opening) > 1 else np.ones((len(wo), 1))
            direction = np.where(direction[:, 2:] > 0.0, direction, wo)
            total += cos * np.asarray(self.material.eval(direction, wi, precision="float64"), np.float64)
            weight += cos
        return total / (weight * wi[:, 2:])


def half_angle(solid_angle: float) -> float:
    """The half angle of a cone [rad] from its solid angle [sr]."""
    return float(np.arccos(1.0 - solid_angle / (2.0 * np.pi)))


def opening(solid_angle: float | None) -> Floats:
    """Directions distributed evenly over a cone about z, (N, 3); only z if `solid_angle` is None."""
    if solid_angle is None:
        return np.array([[0.0, 0.0, 1.0]])
    directions, count = [], sum(RINGS)
    for index, points in enumerate(RINGS):
        before = sum(RINGS[:index])
        cos = 1.0 - (before + 0.5 * points) / count * solid_angle / (2.0 * np.pi) if index else 1.0
        phi = (np.arange(points) + 0.5 * index) * (2.0 * np.pi / points)
        sin = np.sqrt(1.0 - cos * cos)
        directions.append(np.stack([sin * np.cos(phi), sin * np.sin(phi), np.full(points, cos)], -1))
    return np.concatenate(directions)


def to_frame(w: Floats, offsets: Floats) -> Sequence[Floats]:
    """Rotate directions about z, given as `offsets`, to each of the axes w, (N, 3)."""
    if len(offsets) == 1:
        return [w]
    side = np.where(np.abs(w[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    x = np.cross(side, w)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(w, x)
    return [a * x + b * y + c * w for a, b, c in offsets]
