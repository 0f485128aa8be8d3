"""What differs between Mitsuba's variants: how a colour is held, and what a BSDF hands out."""

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

GRID = np.arange(360.0, 831.0)  # nm, where spectral variants have light


# Of a BSDF's flags: its index depends on the wavelength. Mitsuba's own end at bit 15, and it passes others on.
DISPERSES = 1 << 24

# The types of lobes that an integrator of Gonio's asks for: all, and by the last bit, which is no type, it says that it
# lets a path go on with its first wavelength alone where that refracts otherwise than the others. Anyone else gets the
# index of sodium light at all wavelengths.
SEPARATES = (1 << 31) - 1

# The same of one that knows what lies outside of a surface: a hit's `duv_dx.x`, which nothing of ours has a use for, is
# the index there less 1.
NESTS = SEPARATES - (1 << 30)


class Variant:
    """The variant that was set when this was made.

    spectrum  the type of an unpolarized spectrum: one channel, three, or one a wavelength
    """

    def __init__(self, mi: ModuleType) -> None:
        self.mi = mi
        self.spectrum = mi.UnpolarizedSpectrum
        self.channels = dr.size_v(self.spectrum)
        self.spectral = bool(mi.is_spectral)  # colours depend on the ray's wavelengths: they are textures

    def handed_out(self, value: Radiance) -> Radiance:
        """A material's value as Mitsuba takes it, where it is no Mueller matrix."""
        return self.mi.Spectrum(value)

    def mueller(
        self, value: Radiance, total: Radiance, parts: Sequence[Polarized], toward: Vector, away: Vector
    ) -> Radiance:
        """A material's value as a Mueller matrix: of each part as its facets have it, and what is left unpolarized.

        value   what unpolarized light gives
        total   what the parts are parts of
        toward  from where light arrives, and
        away    where it goes to; both away from the surface. As in Mitsuba the matrix is one from the Stokes basis of
                the one ray to that of the other (`mi.mueller.stokes_basis`)
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
        """The direction of s on a ray: perpendicular to the plane of incidence; any where the ray is the normal."""
        across = dr.cross(self.mi.Vector3f(normal), ray)
        length2 = dr.squared_norm(across)
        any_ = self.mi.coordinate_system(ray)[0]
        return dr.select(length2 > 1e-12, across * dr.rsqrt(dr.maximum(length2, 1e-30)), any_)

    def constant(self, value: float | Sequence[float]) -> Radiance:
        """A number (grey), or r, g, b where the variant is not spectral; alone, r, g, b is its luminance."""
        if np.ndim(value) == 0:
            return self.spectrum(float(value))  # type: ignore[arg-type]
        colour = self.mi.Color3f(*map(float, value))  # type: ignore[arg-type]
        return self.spectrum(self.mi.luminance(colour)) if self.mi.is_monochromatic else self.spectrum(colour)

    def uniform(self, texture: Texture) -> Radiance | None:
        """The opaque colour of a texture that is one colour everywhere, else None; spectra stay textures."""
        if self.spectral or texture.is_spatially_varying():
            return None
        value = self.spectrum(texture.eval(dr.zeros(self.mi.SurfaceInteraction3f)))
        dr.make_opaque(value)
        return value

    def dispersion(self, constants: OpticalConstants) -> Float:
        """eta at each nanometre of `GRID`, as a kernel reads it; level where the source ends."""
        values = self.mi.Float(constants.at(GRID, "level").eta.astype(np.float32))
        dr.make_opaque(values)
        return values

    def looked_up(self, values: Float, wavelength: Float, active: Mask) -> Float:
        """A table of `dispersion` at a wavelength. Linear over a nanometre: within 1e-7 of the formulas."""
        mi = self.mi
        place = dr.clip(wavelength - GRID[0], 0.0, len(GRID) - 1.001)
        left = mi.UInt32(place)
        part = place - mi.Float(left)
        low, high = (dr.gather(mi.Float, values, left + step, active) for step in (0, 1))
        return dr.fma(part, high - low, low)

    def curve(self, wavelengths: Floats, values: Floats) -> Texture:
        """A spectrum through points, level beyond; wavelengths in nm. Its values may be above 1, as an index is."""
        text = ", ".join(f"{x:.9g}" for x in np.interp(GRID, wavelengths, values))
        # on a grid: Mitsuba would look among uneven points, for each wavelength at every hit
        ends = {"wavelength_min": GRID[0], "wavelength_max": GRID[-1]}
        return self.mi.load_dict({"type": "regular", **ends, "values": text})

    def through_rgb(self, values: Sequence[float]) -> Texture:
        """A spectrum through a colour's values at `RGB_WAVELENGTHS`. Mitsuba's own way from colours to spectra is made
        for reflectances and would cut an index at 1."""
        return self.curve(np.array(RGB_WAVELENGTHS[::-1]), np.array(values[::-1], float))

    def measured(self, preset: str, parameter: str) -> Texture | None:
        """The spectrum that Mitsuba brings along for a metal's `eta` or `k`, None where it has none (Fe, Ti).

        These are other measurements than the three numbers of the preset, which for Ag, Au and Cu are a fit
        [Rakic1998]: by luminance at normal incidence gold is 6.1 % brighter, silver 1.0 %, chromium 18.9 %, copper is
        4.9 % darker, the others are within 0.8 %. Three points alone cost 0.4 % in gold, 1.2 % in copper.
        """
        folder = Path(str(self.mi.__file__)).parent / "data" / "ior"
        files = (folder / f"{preset}{source}.{parameter}.spd" for source in ("", "_palik"))
        file = next((file for file in files if file.is_file()), None)
        return None if file is None else self.curve(*np.loadtxt(file, unpack=True))
