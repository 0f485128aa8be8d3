"""Reflection by a thin film on a surface: interference of the waves from its two faces, and the resulting colors.

`film_amplitudes` computes the amplitudes at one wavelength, as spectral variants require. RGB colors are computed by
one of the methods in `FORMS`. All indices are relative to the outer medium.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, overload

import numpy as np

from ...ops import Scalar, Spectrum, channels, clamp, function, maximum, of_channels, sqrt, zeros_like
from ...ops.types import Value
from .. import colour
from ..indices import RGB_WAVELENGTHS
from .film_amplitudes import Amplitudes, Complex, airy, channels_of_k, faces
from .film_fourier import in_fourier_space
from .polarization import Diattenuation

FORMS = {
    "local": "interference at 20 wavelengths, converted to RGB under D65 (the locally spectral method of OpenPBR)",
    "belcour-barla": "interference in Fourier space, with Gaussian fits of the color matching functions (Belcour2017)",
}

# 390 to 770 nm in steps of 20: the fringes of a 1 um film are 100 nm apart, those of a 3 um film 35 nm
NODES = np.arange(390.0, 771.0, 20.0)
WEIGHTS = colour.weights(NODES)


class Film(NamedTuple):
    """A film on a base, with the values of a material's parameters.

    eta, k       index of the base, per channel; k is None for a clear base without total reflection (eta > sin)
    film_eta     index of the film
    thickness    thickness of the film, nm
    form         name of a method in `FORMS`
    wavelengths  wavelengths of the rays in spectral variants, nm, one per channel; else None
    """

    eta: Spectrum
    k: Spectrum | None
    film_eta: Scalar
    thickness: Scalar
    form: str
    wavelengths: Spectrum | None


def reflectance(cos_i: Scalar, film: Film) -> Spectrum:
    """R for unpolarized light at cos_i: at the rays' wavelengths if they are given, else as a color by `film.form`."""
    index = film.eta, film.k, film.film_eta, film.thickness
    if film.wavelengths is not None:
        return _spectrum_of(film, lambda eta, k, nm: _unpolarized(cos_i, eta, k, film.film_eta, film.thickness, nm))
    if film.form == "belcour-barla":
        return in_fourier_space(cos_i, *index)
    return _by_wavelengths(cos_i, *index)


@function
def _by_wavelengths(cos_i: Scalar, eta: Spectrum, k: Spectrum | None, film_eta: Scalar, thickness: Scalar) -> Spectrum:
    """The color of R under daylight, as a sum over the wavelengths `NODES`."""
    mixing = WEIGHTS if len(channels(eta)) == 3 else np.tile((WEIGHTS @ colour.LUMINANCE)[:, None], 3)
    total = zeros_like(eta)
    for nm, (red, green, blue) in zip(NODES.tolist(), mixing.tolist(), strict=True):
        total = total + _node(cos_i, eta, k, film_eta, thickness, nm, red, green, blue)
    # colors out of gamut would be above 1 or below 0
    return clamp(total, 0.0, 1.0)


def polarization(cos_i: Scalar, film: Film) -> tuple[Diattenuation[Spectrum], Diattenuation[Spectrum]]:
    """Diattenuation by reflection and by refraction for light from outside. Colors are sums over wavelengths,
    regardless of the film's `form`."""

    def summed(what: Callable[[Amplitudes], Scalar]) -> Spectrum:
        def at(eta: Scalar, k: Scalar | None, nm: Scalar | float) -> Scalar:
            return what(airy(faces(cos_i, eta, k, film.film_eta, film.thickness), nm))

        return _spectrum_of(film, at)

    def reflected(waves: Amplitudes) -> Complex:
        return waves.s.times(waves.p.conjugate)

    def transmitted(waves: Amplitudes) -> Complex:
        """t_s times the conjugate of t_p. Their phases differ only by those of their denominators."""
        phase = waves.under_s.conjugate.times(waves.under_p)
        size = maximum(1.0 - waves.s.square, 0.0) * maximum(1.0 - waves.p.square, 0.0)
        return phase.scaled(sqrt(size / maximum(phase.square, 1e-30)))

    s, p = summed(lambda waves: waves.s.square), summed(lambda waves: waves.p.square)
    back = summed(lambda waves: reflected(waves).re), summed(lambda waves: reflected(waves).im)
    on = summed(lambda waves: transmitted(waves).re), summed(lambda waves: transmitted(waves).im)
    return _over_sum(s, p, *back), _over_sum(1.0 - s, 1.0 - p, *on)


def _over_sum(s: Spectrum, p: Spectrum, real: Spectrum, imaginary: Spectrum) -> Diattenuation[Spectrum]:
    one = 1.0 / maximum(s + p, 1e-12)
    return Diattenuation((s - p) * one, 2.0 * real * one, 2.0 * imaginary * one)


@function
def _unpolarized(
    cos_i: Scalar, eta: Scalar, k: Scalar | None, film_eta: Scalar, thickness: Scalar, wavelength: Scalar | float
) -> Scalar:
    """R at one wavelength."""
    waves = airy(faces(cos_i, eta, k, film_eta, thickness), wavelength)
    return 0.5 * (waves.s.square + waves.p.square)


@function
def _node(
    cos_i: Scalar,
    eta: Spectrum,
    k: Spectrum | None,
    film_eta: Scalar,
    thickness: Scalar,
    nm: float,
    red: float,
    green: float,
    blue: float,
) -> Spectrum:
    """The contribution of one wavelength to the color of R."""
    R = _unpolarized(cos_i, _between(channels(eta), nm), _between(channels_of_k(k, eta), nm), film_eta, thickness, nm)
    return of_channels(eta, [R * share for share in (red, green, blue)][: len(channels(eta))])


def _spectrum_of(film: Film, at: Callable[[Scalar, Scalar | None, Scalar | float], Scalar]) -> Spectrum:
    """The values of `at(eta, k, wavelength)` at each channel's wavelength in spectral variants, else its color under
    daylight."""
    if film.wavelengths is None:
        return _sum(film.eta, film.k, range(len(NODES)), at)
    triples = zip(channels(film.eta), channels_of_k(film.k, film.eta), channels(film.wavelengths), strict=True)
    return of_channels(film.eta, [at(*one) for one in triples])


def _sum(
    eta: Spectrum,
    k: Spectrum | None,
    nodes: Sequence[int],
    at: Callable[[Scalar, Scalar | None, Scalar | float], Scalar],
) -> Spectrum:
    """The contribution of the given nodes to the color of `at`.

    The red, green and blue indices are those at `RGB_WAVELENGTHS`; they are interpolated linearly between these
    wavelengths and constant beyond them.
    """
    etas, ks = channels(eta), channels_of_k(k, eta)
    mixing = WEIGHTS if len(etas) == 3 else (WEIGHTS @ colour.LUMINANCE)[:, None]
    totals: list[Scalar] = []
    for node in nodes:
        nm = float(NODES[node])
        R = at(_between(etas, nm), _between(ks, nm), nm)
        terms = [R * float(share) for share in mixing[node]]
        totals = [total + term for total, term in zip(totals, terms, strict=True)] if totals else terms
    return of_channels(eta, totals)


@overload
def _between(values: Sequence[Scalar], nm: float) -> Scalar: ...
@overload
def _between(values: Sequence[Scalar | None], nm: float) -> Scalar | None: ...
def _between(values: Sequence[Value], nm: float) -> Value:
    """The value at a wavelength, interpolated between the given values at `RGB_WAVELENGTHS`."""
    if values[0] is None:
        return None
    if len(values) != 3:
        return values[0]
    red, green, blue = RGB_WAVELENGTHS
    upper, lower = clamp((nm - green) / (red - green), 0.0, 1.0), clamp((green - nm) / (green - blue), 0.0, 1.0)
    return values[1] + (values[0] - values[1]) * upper + (values[2] - values[1]) * lower
