"""Values at unordered pairs of directions, as a gonioreflectometer measures them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import ops
from ...errors import InputError
from ...material.angular_range import AngularRange, of_nodes
from ...ops import Direction, Spectrum
from ...optics.frame import angles_of_array, spherical_array
from .base import Floats, Measurement, finite, in_rgb
from .guided import Guided
from .half_difference import HalfDifference, centres

CELLS = (45, 30, 30)  # number of cells of the table that interpolates the samples
NEIGHBORS = 24  # number of samples from which a cell is interpolated
DARK = 1e-3  # fraction of the median value: differences are absolute below and relative above
AROUND = np.radians(10.0)  # if the smallest measured angle is less, measured directions surround the normal
UNIT = 1e-3  # largest deviation of a direction's length from 1
SAME = 1e-6  # distance of coordinates below which samples count as repeated measurements


class Samples(Guided, Measurement):
    """f at unordered pairs of directions, (theta_i, phi_i, theta_r, phi_r).

    The logarithm of f is interpolated from the 24 nearest samples by linear radial basis functions of the distance in
    sqrt(theta_h), theta_d and phi_d. The interpolation is computed once, at the cell centers of a half-difference
    table, which is then evaluated in place of the samples. Isotropy and reciprocity are assumed: a pair has the same
    value as its mirror image and as its swapped pair.
    """

    name = "samples"
    reciprocal, mirrored = True, True  # ensured by the interpolation
    axes: ClassVar[Mapping[str, str]] = {"directions": "theta_i, phi_i, theta_r, phi_r of a sample, rad"}

    def __init__(
        self,
        directions: NDArray[np.generic],
        values: NDArray[np.generic],
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
        wavelengths: Floats | None = None,
    ) -> None:
        """A table of samples.

        directions  (N, 4), theta and phi of the light (i) and of the view (r), rad
        values      (N, channel), f in 1/sr
        where       name of the file in errors
        """
        super().__init__(title, source, wavelengths)
        self.directions, self.values = finite(directions, "the directions", where), finite(values, "the values", where)
        if self.directions.ndim != 2 or self.directions.shape[1] != 4 or self.values.ndim != 2:
            what = f"directions {self.directions.shape} and values {self.values.shape}"
            raise InputError(f"{what}, (N, 4) and (N, channel) expected", where)
        if len(self.directions) != len(self.values) or len(self.values) < 8:
            what = f"{len(self.directions)} directions for {len(self.values)} values, 8 or more of both expected"
            raise InputError(what, where)
        theta = self.directions[:, [0, 2]]
        if theta.min() < -1e-6 or theta.max() > 0.5 * np.pi + 1e-4:
            row = int(np.argmax(np.abs(theta - 0.5).max(axis=1)))
            what = f"sample {row + 1} has angles {np.degrees(theta[row])} degrees, 0 to 90 expected"
            raise InputError(what, where, "reflection is above the surface; are the angles in radians?")
        if wavelengths is not None and len(wavelengths) != self.values.shape[1]:
            raise InputError(f"{self.values.shape[1]} values per sample for {len(wavelengths)} wavelengths", where)

    @classmethod
    def of_pairs(
        cls,
        wo: ArrayLike,
        wi: ArrayLike,
        f: ArrayLike,
        where: str = "",
        title: str = "",
        source: Mapping[str, str] | None = None,
    ) -> Samples:
        """A table of samples from pairs of unit vectors.

        wo, wi  (N, 3), unit vectors above the surface, z up
        f       (N,) or (N, channel), the BRDF in 1/sr, without the cosine
        Raises InputError for other shapes, directions below the surface, and vectors that are not normalized.
        """
        hint = "give finite numbers"
        o, i, values = (finite(array, name, where, hint) for array, name in ((wo, "wo"), (wi, "wi"), (f, "f")))
        values = values[:, None] if values.ndim == 1 else values
        if o.ndim != 2 or o.shape[1] != 3 or i.shape != o.shape or values.shape[:1] != o.shape[:1]:
            what = f"wo {o.shape}, wi {i.shape} and f {values.shape}"
            raise InputError(f"{what}, (N, 3), (N, 3) and (N, channel) expected", where)
        for name, w in (("wo", o), ("wi", i)):
            off = np.abs(np.linalg.norm(w, axis=1) - 1.0)
            if off.max(initial=0.0) > UNIT:
                row = int(np.argmax(off))
                raise InputError(
                    f"{name}[{row}] is {w[row]}, a unit vector expected", where, "normalize the directions"
                )
            if w[:, 2].min(initial=1.0) <= 0.0:
                what = f"{name}[{int(np.argmin(w[:, 2]))}] is below the surface"
                raise InputError(what, where, "give reflected light only, with the normal along z")
        return cls(np.stack([*angles_of_array(i), *angles_of_array(o)], -1), values, where, title, source)

    def pairs(self) -> tuple[Floats, Floats]:
        """wo and wi of every sample, (N, 3) each."""
        theta_i, phi_i, theta_r, phi_r = self.directions.T
        wo, wi = (
            spherical_array(np.sin(theta), np.cos(theta), phi) for theta, phi in ((theta_r, phi_r), (theta_i, phi_i))
        )
        return wo, wi

    @property
    def angular_range(self) -> AngularRange:
        """The range of measured angles, combined for wo and wi, because reciprocity also gives the swapped pair.

        The range includes the normal if measured directions surround it.
        """
        ends = np.sort(self.directions[:, [0, 2]], axis=None)
        ends[0] = 0.0 if ends[0] < AROUND else ends[0]
        return of_nodes(ends, ends, np.zeros(0))

    # ------------------------------------------------------------------ as formulas

    @cached_property
    def table(self) -> HalfDifference:
        """The table that interpolates the samples."""
        from scipy.interpolate import RBFInterpolator

        features = _features(*self.pairs())
        rgb = np.maximum(in_rgb(self.values, self.wavelengths), 0.0)
        _, first = np.unique(np.round(features / SAME), axis=0, return_index=True)
        features, rgb = features[first], rgb[first]
        dark = DARK * max(float(np.median(rgb)), 1e-12)
        wo, wi = centres(CELLS)
        lit = np.minimum(wo[:, 2], wi[:, 2]) > 1e-9
        at = _features(wo[lit], wi[lit])
        count = min(NEIGHBORS, len(rgb))
        logs = RBFInterpolator(features, np.log(rgb + dark), kernel="linear", degree=0, neighbors=count)(at)
        low, high = np.log(rgb.min(axis=0) + dark), np.log(rgb.max(axis=0) + dark)
        values = np.full((len(wo), 3), -1.0)
        values[lit] = np.maximum(np.exp(np.clip(logs, low, high)) - dark, 0.0)
        return HalfDifference(values.reshape(*CELLS, 3), title=self.title, source=self.source)

    def prepare(self) -> None:
        self.table.prepare()
        super().prepare()

    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        return self.table.value(wo, wi)

    # ------------------------------------------------------------------ as numbers

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return {"directions": self.directions, "values": self.values}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> Samples:
        return cls(arrays["directions"], arrays["values"], **about)

    @property
    def flaws(self) -> dict[str, float]:
        return {"negative": float(np.mean(self.values < 0.0))}

    @property
    def shape(self) -> dict[str, int]:
        return {"sample": len(self.values), "channel": self.values.shape[1]}

    @property
    def range(self) -> tuple[float, float]:
        return float(self.values.min()), float(self.values.max())


def _features(wo: Floats, wi: Floats) -> Floats:
    """Coordinates of pairs for the interpolation, (N, 4): sqrt(theta_h), theta_d, and two functions of phi_d.

    These functions, cos 2 phi_d and |sin 2 phi_d|, are weighted by sin theta_d. They are the same for a pair, its
    mirror image and its swapped pair.
    """
    h, d = wo + wi, wi - wo
    flat, length = np.hypot(h[:, 0], h[:, 1]), np.linalg.norm(h, axis=1)
    theta_h, theta_d = np.arctan2(flat, h[:, 2]), np.arctan2(np.linalg.norm(d, axis=1), length)
    safe = np.where(flat > 0.0, flat, 1.0)
    c, s = np.where(flat > 0.0, h[:, 0] / safe, 1.0), np.where(flat > 0.0, h[:, 1] / safe, 0.0)
    along = (h[:, 2] * (c * d[:, 0] + s * d[:, 1]) - flat * d[:, 2]) / np.where(length > 0.0, length, 1.0)
    twice = 2.0 * np.arctan2(c * d[:, 1] - s * d[:, 0], along)
    reach = 0.25 * np.sin(theta_d)
    root = np.sqrt(theta_h * (2.0 / np.pi))
    return np.stack([2.0 * root, theta_d * (2.0 / np.pi), reach * np.cos(twice), reach * np.abs(np.sin(twice))], -1)


def plan() -> Floats:
    """Directions at which a goniometer measures an isotropic material, (N, 4): theta_i, phi_i, theta_r, phi_r.

    The light is at 10 to 80 degrees from the normal, and the view directions cover the hemisphere.
    """
    theta_i = np.radians(np.arange(10.0, 81.0, 10.0))
    theta_r = np.radians(np.concatenate([np.arange(0.0, 76.0, 5.0), [79.0]]))
    phi = np.radians(np.arange(-170.0, 181.0, 10.0))
    i, r, p = (a.ravel() for a in np.meshgrid(theta_i, theta_r, phi, indexing="ij"))
    # finer steps around each mirror direction, where the lobes are
    steps = np.radians(np.arange(-8.0, 9.0, 1.0))
    near_i, step = (a.ravel() for a in np.meshgrid(theta_i, steps, indexing="ij"))
    near_mirror = np.stack([near_i, 0.0 * near_i, np.abs(near_i + step), np.full(near_i.shape, np.pi)], -1)
    rows = np.concatenate([np.stack([i, 0.0 * i, r, p], -1), near_mirror])
    return rows[rows[:, 2] <= np.radians(85.0)]


def sampled(value: ops.Value, directions: Floats | None = None, **about: ops.Value) -> Samples:
    """Samples of a function value(wo, wi) = f cos theta_i, (N, 3), at given directions, by default those of `plan`."""
    directions = plan() if directions is None else directions
    blank = Samples(directions, np.zeros((len(directions), 3)))
    wo, wi = blank.pairs()
    return Samples(directions, value(wo, wi) / wi[:, 2:], **about)
