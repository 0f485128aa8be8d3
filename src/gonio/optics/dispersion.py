"""The dependence of a refractive index on the wavelength: formulas and tables.

Formulas take the wavelength in micrometers, as published; the public interface uses nanometers. A formula is valid only
in the range in which it was fitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Floats: TypeAlias = NDArray[np.float64]

SODIUM = 589.3  # nm, the mean of the D lines, at which the index of a glass is quoted
VISIBLE = (400.0, 700.0)  # nm; other wavelengths contribute 0.3 % of the luminance of daylight
ALL = (0.0, np.inf)


class RefractiveIndex(NamedTuple):
    """The complex index eta + i k at the requested wavelengths; k is 0 if the source states none."""

    eta: Floats
    k: Floats


@dataclass(frozen=True)
class Dispersion:
    """A refractive index as a function of the wavelength.

    low, high  range of validity, nm
    """

    low: float
    high: float

    def at(self, wavelength: Floats) -> RefractiveIndex:
        """The complex index at wavelengths in nm, all of which must lie within the range of validity."""
        eta = np.asarray(self.eta(wavelength / 1000.0), float)
        return RefractiveIndex(eta, np.zeros_like(eta))

    def eta(self, wavelength: Floats) -> Floats:
        """The real part of the index at wavelengths in micrometers."""
        raise NotImplementedError


@dataclass(frozen=True)
class Constant(Dispersion):
    """The same index at all wavelengths."""

    value: float

    def eta(self, wavelength: Floats) -> Floats:
        return np.full_like(wavelength, self.value)


@dataclass(frozen=True)
class Powers(Dispersion):
    """sum_i c_i lambda^e_i: n itself (Cauchy's formula) or n^2 (Schott's old catalogs).

    terms    pairs (c_i, e_i), for lambda in micrometers
    squared  whether the sum is n^2
    """

    terms: tuple[tuple[float, float], ...]
    squared: bool = False

    def eta(self, wavelength: Floats) -> Floats:
        total = sum(c * wavelength**e for c, e in self.terms)
        return np.sqrt(total) if self.squared else np.asarray(total, float)


@dataclass(frozen=True)
class Sellmeier(Dispersion):
    """n^2 = constant + sum_i b_i lambda^2 / (lambda^2 - c_i), with lambda^2 and c_i in square micrometers.

    terms  pairs (b_i, c_i)
    """

    terms: tuple[tuple[float, float], ...]
    constant: float = 1.0

    def eta(self, wavelength: Floats) -> Floats:
        square = wavelength**2
        return np.sqrt(self.constant + sum(b * square / (square - c) for b, c in self.terms))


@dataclass(frozen=True)
class Gas(Dispersion):
    """n = 1 + constant + density sum_i b_i / (c_i - 1 / lambda^2) (Ciddor1996, eq. 1), with lambda in micrometers.

    terms  pairs (b_i, c_i)
    """

    terms: tuple[tuple[float, float], ...]
    density: float = 1.0
    constant: float = 0.0

    def eta(self, wavelength: Floats) -> Floats:
        inverse = wavelength**-2.0
        refractivity = self.constant + self.density * sum(b / (c - inverse) for b, c in self.terms)
        return np.asarray(1.0 + refractivity, float)


@dataclass(frozen=True)
class Table(Dispersion):
    """Measured values, interpolated linearly in the wavelength.

    wavelengths  wavelengths in nm, ascending
    etas, ks     real and imaginary part of the index at these wavelengths
    """

    wavelengths: tuple[float, ...]
    etas: tuple[float, ...]
    ks: tuple[float, ...]

    def at(self, wavelength: Floats) -> RefractiveIndex:
        eta, k = (np.interp(wavelength, self.wavelengths, column) for column in (self.etas, self.ks))
        return RefractiveIndex(np.asarray(eta, float), np.asarray(k, float))


@dataclass(frozen=True)
class Absorbing(Dispersion):
    """A formula for eta and a table for k."""

    real: Dispersion
    imaginary: Table

    def at(self, wavelength: Floats) -> RefractiveIndex:
        return RefractiveIndex(self.real.at(wavelength).eta, self.imaginary.at(wavelength).k)


@dataclass(frozen=True)
class OpticalConstants:
    """The refractive index of a substance with its description.

    name    the name by which it is selected
    title   its description
    curve   the index as a function of the wavelength
    source  the reference for the values
    """

    name: str
    title: str
    curve: Dispersion
    source: str

    @property
    def range(self) -> tuple[float, float]:
        """Range of wavelengths in which the index is known, nm."""
        return self.curve.low, self.curve.high

    @property
    def disperses(self) -> bool:
        """Whether the index depends on the wavelength."""
        return not isinstance(self.curve, Constant)

    def at(self, wavelength: float | list[float] | Floats, outside: str = "refuse") -> RefractiveIndex:
        """The index, as arrays of the shape of `wavelength`.

        wavelength  vacuum wavelength, nm; a number or an array
        outside     treatment of wavelengths out of range: "refuse" raises an error, "level" uses the value at the
                    nearer end of the range
        Raises InputError for wavelengths that are refused or not positive, and if the formula gives no real index.
        """
        given = np.asarray(wavelength, np.float64)
        low, high = self.range
        if outside not in ("refuse", "level"):
            raise InputError(f"'{outside}' given, refuse or level expected", "outside")
        if given.size and not np.all(np.isfinite(given) & (given > 0.0)):
            raise InputError("a wavelength is not a positive number", "wavelength", "give nanometers")
        wrong = given[(given < low) | (given > high)]
        if wrong.size and outside == "refuse":
            hint = "in nanometers" if high >= 20.0 * wrong.flat[0] else 'outside="level" uses the value at the end'
            what = f"{wrong.flat[0]:g} nm is outside the range of {self.name}, which is {low:g} to {high:g} nm"
            raise InputError(what, "wavelength", hint)
        with np.errstate(all="ignore"):
            constants = self.curve.at(np.clip(given, low, high))
        missing = given[~np.isfinite(constants.eta)]
        if missing.size:
            what = f"{self.name} has no index at {missing.flat[0]:g} nm: the formula gives n^2 < 0 or diverges"
            raise InputError(what, "wavelength", "formulas take lambda in micrometers")
        return constants

    @property
    def sodium(self) -> float:
        """eta at 589.3 nm, or at the nearest known wavelength, for use as a single number."""
        return float(self.at(SODIUM, "level").eta)


class DispersiveIndex(float):
    """A dielectric's index together with its dispersion. As a number, it is the index at 589.3 nm."""

    constants: OpticalConstants

    def __new__(cls, constants: OpticalConstants) -> DispersiveIndex:
        made = super().__new__(cls, constants.sodium)
        made.constants = constants
        return made

    def __repr__(self) -> str:
        return repr(self.constants.name)

    __str__ = __repr__

    def __eq__(self, other: object) -> bool:
        if isinstance(other, DispersiveIndex):
            return self.constants == other.constants
        return float(self) == other

    __hash__ = float.__hash__

    def __reduce__(self) -> tuple[object, ...]:
        return DispersiveIndex, (self.constants,)
