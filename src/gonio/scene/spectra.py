"""Emission spectra of lamps, which are spectra in Mitsuba's spectral variants and colors in other variants."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..bridge.types import PluginDict
from . import values
from .values import LightSpectrum

Floats = NDArray[np.float64]
Colour: TypeAlias = float | tuple[float, float, float]

GRID = np.arange(360.0, 831.0)  # nm, the range of Mitsuba's CIE observer
SECOND_RADIATION = 1.438776877e7  # nm K, hc/k in Planck's law


def emitted(light: Colour | LightSpectrum) -> PluginDict:
    """Radiance of a light as a Mitsuba plugin: a spectrum if both the variant and the light are spectral, else rgb."""
    if engine.load().is_spectral and not np.any(light.scale if isinstance(light, LightSpectrum) else light):
        return {"type": "uniform", "value": 0.0}  # Mitsuba rejects a `regular` spectrum that is 0 everywhere
    if isinstance(light, LightSpectrum) and engine.load().is_spectral:
        text = ", ".join(f"{value:.9g}" for value in curve(light))
        return {"type": "regular", "wavelength_min": GRID[0], "wavelength_max": GRID[-1], "values": text}
    return {"type": "rgb", "value": colour(light)}


def colour(light: Colour | LightSpectrum) -> list[float]:
    """The radiance of a light as linear sRGB.

    Colors outside the gamut are clipped at 0 and rescaled to preserve the luminance.
    """
    if not isinstance(light, LightSpectrum):
        return values.rgb(light)
    if isinstance(light, values.Daylight):
        return [light.scale] * 3
    mi, xyz = engine.load(), _observer() @ curve(light)
    rgb = np.maximum(np.array(mi.xyz_to_srgb(mi.Color3f(*map(float, xyz)))).ravel(), 0.0)
    luminance = float(rgb @ (0.212671, 0.715160, 0.072169))
    return [float(c) * light.scale / luminance if luminance else 0.0 for c in rgb]


def curve(light: LightSpectrum) -> Floats:
    """The spectral radiance of a light on `GRID`, scaled so that the luminance equals the light's `scale`."""
    table = _relative(light)
    return table * (light.scale / float(_observer()[1] @ table))


def _relative(light: LightSpectrum) -> Floats:
    if isinstance(light, values.Daylight):
        from ..measure.colours import D65

        return np.interp(GRID, np.arange(380.0, 781.0, 10.0), D65, left=0.0, right=0.0)
    if isinstance(light, values.Blackbody):
        reference = 560.0
        rise = np.expm1(SECOND_RADIATION / (reference * light.temperature))
        return (reference / GRID) ** 5 * rise / np.expm1(SECOND_RADIATION / (GRID * light.temperature))
    if isinstance(light, values.Led):
        peaks = [h * np.exp(-4.0 * np.log(2.0) * ((GRID - at) / width) ** 2) for at, width, h in light.peaks]
        return np.sum(peaks, axis=0)
    assert isinstance(light, values.MeasuredLight), "all other types are handled above"
    return np.interp(GRID, light.wavelengths, light.values, left=0.0, right=0.0)


def _observer() -> Floats:
    """Mitsuba's CIE 1931 color matching functions, (3, N), scaled so that a constant radiance of 1 has Y = 1."""
    from ..transport.scene_data import CIE_Y_INTEGRAL

    mi = engine.load()
    observer = mi.cie1931_xyz(mi.Float(GRID.astype(np.float32)))
    return np.array([np.asarray(row, np.float64) for row in (observer.x, observer.y, observer.z)]) / CIE_Y_INTEGRAL
