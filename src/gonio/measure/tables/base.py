"""The base class of all kinds of tables."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import ops
from ...errors import InputError
from ...material.angular_range import EVERYWHERE, AngularRange
from ...members import Family, subclasses_of
from ...ops import Direction, Mask, Scalar, Spectrum, backend, vec3
from ...optics.lattice import r_sequence
from .. import colours

Floats = NDArray[np.float64]


class Measurement:
    """Tabulated values of a BRDF at pairs of directions, with their metadata. Each subclass is a kind of table.

    name         name of the kind, such as "half-difference"
    title        title of the measured material, from the file
    source       format and other metadata of the file
    wavelengths  one wavelength per channel, nm; None if the channels are red, green and blue, or a single gray channel
    beside       further arrays that an instrument has measured, of the same shape as the values, stored in `.gonio`
                 files: "error", the standard error of each value, and "first", its single-bounce part

    A kind defines `value`, `pdf` and `draw` with the functions of `gonio.ops`, so they can be used in renders and in
    shaders.
    """

    family: ClassVar[Family[type[Measurement]]]
    name: ClassVar[str] = ""
    axes: ClassVar[Mapping[str, str]] = {}  # axes of its arrays: name -> description with unit

    def __init__(
        self, title: str = "", source: Mapping[str, str] | None = None, wavelengths: Floats | None = None
    ) -> None:
        self.title, self.source = title, dict(source or {})
        self.wavelengths = None if wavelengths is None else np.asarray(wavelengths, np.float64)
        self.beside: dict[str, NDArray[np.generic]] = {}

    # ------------------------------------------------------------------ as formulas

    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        """f(wo, wi) cos theta_i for two directions above the surface, linear sRGB."""
        raise NotImplementedError

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The probability density with which `draw` returns wi, 1/sr."""
        raise NotImplementedError

    def draw(self, wo: Direction, u: Direction) -> tuple[Direction, Scalar]:
        """A sampled direction and its density. A direction below the surface is a failed sample."""
        raise NotImplementedError

    @property
    def reciprocal(self) -> bool:
        """Whether swapping wo and wi leaves f unchanged, also where f is interpolated."""
        return False

    @property
    def mirrored(self) -> bool:
        """Whether f is exactly mirror-symmetric, also where it is interpolated."""
        return False

    sums: ClassVar[bool] = False  # whether lookups search cumulative sums

    @cached_property
    def _albedos(self) -> Floats:
        return albedo(self, np.radians(ANGLES))

    def albedos(self) -> Floats:
        """The directional albedo at the viewing angles `ANGLES`, (N, 3), from 4096 samples each.

        The error is a few 0.001.
        """
        return self._albedos

    @property
    def angular_range(self) -> AngularRange:
        """The range of measured angles; outside it, the nearest values are used."""
        return EVERYWHERE

    def prepare(self) -> None:
        """Compute data that the formulas need and that cannot be computed while a renderer records its kernels."""

    @property
    def isotropic(self) -> bool:
        return True

    # ------------------------------------------------------------------ as numbers

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """The arrays of the table, as stored in `.gonio` files: axes in radians, values in 1/sr."""
        raise NotImplementedError

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: object) -> Measurement:
        """A table from its arrays, the inverse of `arrays`. Raises InputError if the arrays are inconsistent."""
        raise NotImplementedError

    @property
    def flaws(self) -> dict[str, float]:
        """The fractions of the values that are "negative" or "invalid"; these values are not changed."""
        return {}

    @property
    def shape(self) -> dict[str, int]:
        """The number of values along each axis, by the name of the axis."""
        raise NotImplementedError

    @property
    def range(self) -> tuple[float, float]:
        """The lowest and the highest of the valid stored values."""
        raise NotImplementedError

    def rgb(self, wo: Floats, wi: Floats) -> Floats:
        """f cos theta_i for pairs of directions, (N, 3), computed in float64; 0 below the surface."""
        types = backend.types("float64")
        rgb = np.empty((len(wo), 3))
        for start in range(0, len(wo), CHUNK):
            part = slice(start, start + CHUNK)
            o, i = (backend.vector_of(w[part], 3, types) for w in (wo, wi))
            above = (o.z > 0.0) & (i.z > 0.0)
            rgb[part] = backend.to_numpy(ops.where(above, self.value(o, i), 0.0), len(wo[part]))
        return rgb


ANGLES = np.array([0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0])  # degrees
POINTS = 4096  # samples per albedo


def albedo(table: Measurement, theta: Floats) -> Floats:
    """The directional albedo, int f cos theta_i d omega_i, at viewing angles theta [rad], (N, 3).

    It is estimated from samples of the table at the points of a lattice.
    """
    types = backend.types("float64")
    lattice = r_sequence(POINTS, 3, shift=0.5)
    albedos = []
    for angle in theta:
        wo = np.broadcast_to([np.sin(angle), 0.0, np.cos(angle)], (POINTS, 3))
        drawn = table.draw(backend.vector_of(wo, 3, types), backend.vector_of(lattice, 3, types))
        backend.drjit().eval(drawn)
        wi, pdf = (backend.to_numpy(part, POINTS) for part in drawn)
        upper = (pdf > 0.0) & (wi[:, 2] > 0.0)
        albedos.append((table.rgb(wo[upper], wi[upper]) / pdf[upper, None]).sum(axis=0) / POINTS)
    return np.array(albedos)


CHUNK = 1 << 19  # number of pairs evaluated at once, which bounds memory


def _named(thing: object) -> tuple[str, type[Measurement]] | None:
    return subclasses_of(Measurement)(thing)


Measurement.family = Family("kind of table", "gonio.tables", ["gonio.measure.tables"], _named)


def above(wo: Direction, wi: Direction) -> Mask:
    """Whether both directions lie above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def in_rgb(values: Floats, wavelengths: Floats | None, where: str = "") -> Floats:
    """Convert values, channels last, to linear sRGB: spectra under D65, a single channel to gray.

    wavelengths  one wavelength per channel, nm; None for values without wavelengths
    where        name of the file in errors
    """
    channels = values.shape[-1]
    if wavelengths is not None:
        return values @ colours.to_rgb(wavelengths)
    if channels == 1:
        return np.repeat(values, 3, axis=-1)
    if channels != 3:
        raise InputError(f"{channels} channels without wavelengths, 1 or 3 expected", where)
    return values


def of_channels(channels: tuple[Scalar, ...]) -> Spectrum:
    """The first three of a texel's channels, as a color."""
    colour: ops.Value = vec3(*channels[:3])
    return colour


def padded(values: Floats) -> Floats:
    """Append a fourth channel of 0 to colors, because a fetch reads four channels at once."""
    return np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)


def axis(values: NDArray[np.generic], name: str, where: str, low: float, high: float) -> Floats:
    """Convert an axis to float64.

    Raises InputError, which names `where` and the axis, unless the numbers are finite, increasing and within [low,
    high] up to rounding.
    """
    nodes = np.asarray(values, np.float64)
    if nodes.ndim != 1 or len(nodes) < 1 or not np.all(np.isfinite(nodes)):
        raise InputError(f"the axis {name} is not a list of finite numbers", where)
    if np.any(np.diff(nodes) <= 0.0):
        raise InputError(f"the axis {name} does not increase", where)
    if nodes[0] < low - 1e-4 or nodes[-1] > high + 1e-4:
        raise InputError(f"the axis {name} leaves [{low:.5g}, {high:.5g}]", where)
    return nodes


def finite(values: ArrayLike, name: str, where: str, hint: str = "the file is damaged") -> Floats:
    """Convert values to float64. Raises InputError, which names `where` and `name`, unless all are finite numbers."""
    try:
        array = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of numbers", where, hint) from None
    if np.ma.is_masked(values):
        raise InputError(f"{name} has masked values", where, "give only the unmasked rows")
    bad = int(np.size(array) - np.count_nonzero(np.isfinite(array)))
    if bad:
        raise InputError(f"{bad} of {array.size} values of {name} are not finite", where, hint)
    return array
