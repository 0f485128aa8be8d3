"""The color of a thin film by Fourier transforms of the color-matching functions (Belcour2017)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from ...ops import (
    Scalar,
    Spectrum,
    channels,
    clamp,
    exp,
    floor,
    function,
    maximum,
    of_channels,
    sincos,
    sqr,
    zeros_like,
)
from .. import colour
from .film_amplitudes import Amplitude, Complex, channels_of_k, faces


def _of_unit(height: float, place: float, variance: float) -> tuple[float, float, float]:
    """A Gaussian whose height is scaled so that the color-matching function y integrates to 1."""
    return height * math.sqrt(2.0 * math.pi * variance) / 1.0685e-7, place, variance


Curve: TypeAlias = tuple[tuple[float, float, float], ...]

# Fits of the color-matching functions, as functions of the wave number, by sums of Gaussians (Belcour2017, supplemental
# code): height, center and variance
CURVES: tuple[Curve, Curve, Curve] = (
    (_of_unit(5.4856e-13, 1.6810e6, 4.3278e9), _of_unit(9.7470e-14, 2.2399e6, 4.5282e9)),
    (_of_unit(4.4201e-13, 1.7953e6, 9.3046e9),),
    (_of_unit(5.2481e-13, 2.2084e6, 6.6121e9),),
)
HARMONICS = 3  # the fourth is |r12 r23|^3 times the first, and color-matching functions average it out
WHITE = (0.95047, 1.0, 1.08883)  # XYZ of D65: the curves were fitted for an equal-energy spectrum


@function
def in_fourier_space(cos_i: Scalar, eta: Spectrum, k: Spectrum | None, film_eta: Scalar, thickness: Scalar) -> Spectrum:
    """The RGB color of the reflectance of a thin film, computed in Fourier space (Belcour2017, eqs. 6 to 10).

    It is the sum of two terms. The mean of the reflectance over all phases is computed for each RGB channel. The
    interference term is computed for the color-matching functions x, y and z, with the index of the base in red, green
    and blue, respectively, and is then converted to RGB.
    """
    etas, ks = channels(eta), channels_of_k(k, eta)
    if len(etas) != 3:
        luminance = _band(cos_i, etas[0], ks[0], film_eta, thickness, *CURVES[1][0])
        return clamp(of_channels(eta, [luminance.mean + luminance.wave]), 0.0, 1.0)
    (wide, other), (middle,), (narrow,) = CURVES
    x = _band_of_two(cos_i, etas[0], ks[0], film_eta, thickness, *wide, *other)
    y = _band(cos_i, etas[1], ks[1], film_eta, thickness, *middle)
    z = _band(cos_i, etas[2], ks[2], film_eta, thickness, *narrow)
    X, Y, Z = (band.wave * white for band, white in zip((x, y, z), WHITE, strict=True))
    waves = [X * float(row[0]) + Y * float(row[1]) + Z * float(row[2]) for row in colour.XYZ_TO_RGB]
    total = [band.mean + wave for band, wave in zip((x, y, z), waves, strict=True)]
    return clamp(of_channels(eta, total), 0.0, 1.0)


class Band(NamedTuple):
    """The response of one color-matching function: the mean of R over all phases, and the contribution of
    interference."""

    mean: Scalar
    wave: Scalar


@function
def _band(
    cos_i: Scalar,
    eta: Scalar,
    k: Scalar | None,
    film_eta: Scalar,
    thickness: Scalar,
    height: float,
    place: float,
    variance: float,
) -> Band:
    """The response, averaged over the two polarizations, of a color-matching function fitted by one Gaussian."""
    return _through([(height, place, variance)], cos_i, eta, k, film_eta, thickness)


@function
def _band_of_two(
    cos_i: Scalar,
    eta: Scalar,
    k: Scalar | None,
    film_eta: Scalar,
    thickness: Scalar,
    height: float,
    place: float,
    variance: float,
    other_height: float,
    other_place: float,
    other_variance: float,
) -> Band:
    """The response, averaged over the two polarizations, of a color-matching function fitted by two Gaussians."""
    fits = [(height, place, variance), (other_height, other_place, other_variance)]
    return _through(fits, cos_i, eta, k, film_eta, thickness)


def _through(
    fits: Sequence[tuple[float, float, float]],
    cos_i: Scalar,
    eta: Scalar,
    k: Scalar | None,
    film_eta: Scalar,
    thickness: Scalar,
) -> Band:
    """The response, averaged over the two polarizations, of a sum of Gaussians.

    fits  height, center and variance of each Gaussian
    """
    film = faces(cos_i, eta, k, film_eta, thickness)
    mean, wave = zeros_like(cos_i), zeros_like(cos_i)
    trips: list[Amplitude] = []  # one round trip through the film, without its phase
    sizes: list[Scalar] = []
    for number, top in enumerate(film.top):
        base = film.base[number]
        outer, inner = sqr(top), base.square
        passed = 1.0 - outer
        bounced = sqr(passed) * inner / maximum(1.0 - outer * inner, 1e-6)
        mean = mean + 0.5 * (outer + bounced)
        trips.append(base.scaled(-top))
        sizes.append(bounced - passed)
    path = film.way * 2e-9
    bells = [_bell(path, place, variance) for _, place, variance in fits]
    # a path n times as long multiplies the phase by n and raises the attenuation to the power n^2
    waves = [bell.turn for bell in bells]
    powers = trips
    for order in range(1, HARMONICS + 1):
        if order > 1:
            waves = [bell_wave.times(bell.turn) for bell_wave, bell in zip(waves, bells, strict=True)]
            powers = [power.times(trip) for power, trip in zip(powers, trips, strict=True)]
        parts = [
            bell_wave.scaled(_power(bell.left, order * order) * height)
            for bell_wave, bell, (height, _, _) in zip(waves, bells, fits, strict=True)
        ]
        curve = parts[0] if len(parts) == 1 else parts[0].plus(parts[1])
        for size, power in zip(sizes, powers, strict=True):
            wave = wave + size * curve.times(power).re
    return Band(mean, wave)


class Bell(NamedTuple):
    """The Fourier transform of a Gaussian in the wave number: an attenuated wave.

    turn  the phase factor
    left  the attenuation
    """

    turn: Complex
    left: Scalar


@function
def _bell(path: Scalar, place: float, variance: float) -> Bell:
    """The Fourier transform at an optical path in meters.

    place, variance  center and variance of the Gaussian
    """
    turns = path * place
    angle = (turns - floor(turns)) * (2.0 * math.pi)
    sin, cos = sincos(angle)
    return Bell(Complex(cos, sin), exp(sqr(path) * (variance * -((2.0 * math.pi) ** 2))))


def _power(x: Scalar, exponent: int) -> Scalar:
    """x^exponent, by squaring."""
    if exponent == 1:
        return x
    even = sqr(_power(x, exponent // 2))
    return even * x if exponent % 2 else even
