"""The differences between Mitsuba's variants: the representation of colors, and the type that a BSDF returns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TypeAlias

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...material.polarization import Polarized
from ...optics.dispersion import OpticalConstants
from ...optics.indices import RGB_WAVELENGTHS
from ..types import Float, Mask, Radiance, Texture, Vector

Floats: TypeAlias = NDArray[np.float64]

GRID = np.arange(360.0, 831.0)  # nm, the wavelengths of spectral variants


# BSDF flag: the index of refraction depends on the wavelength. Mitsuba uses bits up to 15 and preserves the others.
DISPERSES = 1 << 24

# Type mask of Gonio's integrators, which enables all lobes. Bits that are not used for types distinguish it from the
# masks of other callers: they indicate that a path continues with only its first wavelength where wavelengths refract
# differently. For other callers, all wavelengths have the index of refraction for sodium light.
SEPARATES = (1 << 31) - 1

# The same for an integrator that tracks the medium outside a surface. It passes the index of refraction of this medium,
# minus 1, in the field `duv_dx.x` of the hit, which Gonio does not use otherwise.
NESTS = SEPARATES - (1 << 30)


class Variant:
    """The variant of Mitsuba that is set when this object is constructed.

    spectrum  type of an unpolarized spectrum: one channel, three channels, or one channel per wavelength
    """

    def __init__(self, mi: ModuleType) -> None:
        self.mi = mi
        self.spectrum = mi.UnpolarizedSpectrum
        self.channels = dr.size_v(self.spectrum)
        self.spectral = bool(mi.is_spectral)  # colors then depend on the wavelengths of the ray, so they are textures

    def to_mitsuba(self, value: Radiance) -> Radiance:
        """Convert the value of a material to Mitsuba's type, as unpolarized light."""
        return self.mi.Spectrum(value)

    def mueller(
        self, value: Radiance, total: Radiance, parts: Sequence[Polarized], toward: Vector, away: Vector
    ) -> Radiance:
        """Convert the value of a material to a Mueller matrix: polarized parts due to microfacets, plus a depolarizer.

        value   the value for unpolarized light, or the weight of a sample
        total   the value of the BSDF, of which `parts` are parts
        parts   the polarized parts
        toward  direction toward the light source
        away    direction in which the light leaves. As in Mitsuba, the matrix maps the Stokes basis of the incident ray
                to that of the outgoing ray (`mi.mueller.stokes_basis`)
        """
        mi = self.mi
        matrix, rest = dr.zeros(mi.Spectrum), self.spectrum(value)
        for part in parts:
            size = dr.select(total != 0.0, value * part.value / total, 0.0)
            rest -= size
            d, c, s = (size * self.spectrum(x) for x in part.matrix)
            zero = dr.zeros(self.spectrum)
            own = mi.Spectrum(size, d, zero, zero, d, size, zero, zero, zero, zero, c, -s, zero, zero, s, c)
            axes = [self._across(part.normal, ray) for ray in (-toward, away)]
            bases = [mi.mueller.stokes_basis(ray) for ray in (-toward, away)]
            matrix += mi.mueller.rotate_mueller_basis(own, -toward, axes[0], bases[0], away, axes[1], bases[1])
        matrix[0, 0] = matrix[0, 0] + rest
        return matrix

    def _across(self, normal: Vector, ray: Vector) -> Vector:
        """The s direction of a ray, which is perpendicular to the plane of incidence; arbitrary at normal incidence."""
        across = dr.cross(self.mi.Vector3f(normal), ray)
        length2 = dr.squared_norm(across)
        any_ = self.mi.coordinate_system(ray)[0]
        return dr.select(length2 > 1e-12, across * dr.rsqrt(dr.maximum(length2, 1e-30)), any_)

    def constant(self, value: float | Sequence[float]) -> Radiance:
        """Convert a number (gray) or a color (r, g, b) to kernel values; not for spectral variants.

        In monochrome variants, a color is converted to its luminance.
        """
        if np.ndim(value) == 0:
            return self.spectrum(float(value))  # type: ignore[arg-type]
        color = self.mi.Color3f(*map(float, value))  # type: ignore[arg-type]
        return self.spectrum(self.mi.luminance(color)) if self.mi.is_monochromatic else self.spectrum(color)

    def uniform(self, texture: Texture) -> Radiance | None:
        """The opaque color of a constant texture, else None. Spectra remain textures."""
        if self.spectral or texture.is_spatially_varying():
            return None
        value = self.spectrum(texture.eval(dr.zeros(self.mi.SurfaceInteraction3f)))
        dr.make_opaque(value)
        return value

    def dispersion(self, constants: OpticalConstants) -> Float:
        """eta at each nanometer of `GRID`, as kernel data; constant beyond the range of the source data."""
        values = self.mi.Float(constants.at(GRID, "level").eta.astype(np.float32))
        dr.make_opaque(values)
        return values

    def interpolated(self, values: Float, wavelength: Float, active: Mask) -> Float:
        """The linearly interpolated value of a `dispersion` table at a wavelength, within 1e-7 of the formulas."""
        mi = self.mi
        place = dr.clip(wavelength - GRID[0], 0.0, len(GRID) - 1.001)
        left = mi.UInt32(place)
        part = place - mi.Float(left)
        low, high = (dr.gather(mi.Float, values, left + step, active) for step in (0, 1))
        return dr.fma(part, high - low, low)

    def curve(self, wavelengths: Floats, values: Floats) -> Texture:
        """A spectrum that interpolates values at given wavelengths [nm]; constant beyond their range.

        Values may exceed 1, as indices of refraction do.
        """
        text = ", ".join(f"{x:.9g}" for x in np.interp(GRID, wavelengths, values))
        # on a regular grid, because Mitsuba would search irregular points for each wavelength at every hit
        ends = {"wavelength_min": GRID[0], "wavelength_max": GRID[-1]}
        return self.mi.load_dict({"type": "regular", **ends, "values": text})

    def through_rgb(self, values: Sequence[float]) -> Texture:
        """A spectrum that interpolates the three values of a color at `RGB_WAVELENGTHS`.

        Mitsuba's own conversion of colors to spectra is for reflectances and would clamp an index of refraction to 1.
        """
        return self.curve(np.array(RGB_WAVELENGTHS[::-1]), np.array(values[::-1], float))

    def measured(self, preset: str, parameter: str) -> Texture | None:
        """The spectrum of `eta` or `k` of a metal that Mitsuba ships; None for metals that it does not have (Fe, Ti).

        The three numbers of Gonio's presets are from other measurements; for Ag, Au and Cu, they are from a fit
        [Rakic1998]. In luminance at normal incidence, Mitsuba's gold is 6.1 % brighter, its silver 1.0 % brighter, its
        chromium 18.9 % brighter, and its copper 4.9 % darker; the other metals differ by at most 0.8 %. Sampling at
        only three wavelengths causes 0.4 % of the difference for gold and 1.2 % for copper.
        """
        folder = Path(str(self.mi.__file__)).parent / "data" / "ior"
        files = (folder / f"{preset}{source}.{parameter}.spd" for source in ("", "_palik"))
        file = next((file for file in files if file.is_file()), None)
        return None if file is None else self.curve(*np.loadtxt(file, unpack=True))
