"""Light reflected by a thin film on a surface: waves from its two faces add up, and colours come of it.

With the amplitudes r12 of the film's face and r23 of the surface under it, and delta = 4 pi d w2 / lambda that a round
trip adds, w2 = sqrt(eta2^2 - sin^2), all waves together are (Airy's sum; Born1999, sec. 7.6)

    r = (r12 + r23 e^(i delta)) / (1 + r12 r23 e^(i delta)).

That is for one wavelength, and is what spectral variants evaluate. Three colours can follow from it in two ways, the
members of `FORMS`. Indices are over that of the outside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...ops import (
    Scalar,
    Spectrum,
    abs,
    channels,
    clamp,
    exp,
    floor,
    function,
    maximum,
    of_channels,
    sincos,
    sqr,
    sqrt,
    where,
)
from .. import colour
from ..indices import RGB_WAVELENGTHS
from .polarization import Diattenuation

FORMS = {
    "local": "the sum of waves at 20 wavelengths, seen under D65 (locally spectral, OpenPBR)",
    "belcour-barla": "the interference as Gaussians in Fourier space (Belcour2017)",
}

# 390 to 770 nm by 20: fringes of a film of 1 um are 100 nm apart, of 3 um 35 nm
NODES = np.arange(390.0, 771.0, 20.0)
WEIGHTS = colour.weights(NODES)


def _of_unit(height: float, place: float, variance: float) -> tuple[float, float, float]:
    """A bell, its height such that y's integral is 1."""
    return height * math.sqrt(2.0 * math.pi * variance) / 1.0685e-7, place, variance


# Fits of the observer's curves over wave numbers (Belcour2017, supplemental code): height, place and variance, the
# second bell of x last, which the other curves have at height 0
BELLS = (
    _of_unit(5.4856e-13, 1.6810e6, 4.3278e9),
    _of_unit(4.4201e-13, 1.7953e6, 9.3046e9),
    _of_unit(5.2481e-13, 2.2084e6, 6.6121e9),
)
SECOND = (_of_unit(9.7470e-14, 2.2399e6, 4.5282e9), (0.0, 1.0, 1.0), (0.0, 1.0, 1.0))
HARMONICS = 3  # the next is r^4 of the first, and the eye's curves have blurred it
WHITE = (0.95047, 1.0, 1.08883)  # XYZ of D65: the curves were fitted under even light


class Complex(NamedTuple):
    """A complex number, of symbols too."""

    re: Scalar
    im: Scalar

    def plus(self, other: Complex) -> Complex:
        return Complex(self.re + other.re, self.im + other.im)

    def times(self, other: Complex) -> Complex:
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def scaled(self, factor: Scalar | float) -> Complex:
        return Complex(self.re * factor, self.im * factor)

    @property
    def conjugate(self) -> Complex:
        return Complex(self.re, -self.im)

    @property
    def square(self) -> Scalar:
        """Its absolute value, squared."""
        return sqr(self.re) + sqr(self.im)

    def over(self, other: Complex) -> Complex:
        return self.times(other.conjugate).scaled(1.0 / maximum(other.square, 1e-30))


class Faces(NamedTuple):
    """The amplitudes of a film's faces, and half the way of a round trip through it.

    top    of the face toward the light, of s and of p; real
    base   of the surface under the film
    bare   of the surface without the film
    way    d w2, in the unit of d
    """

    top: tuple[Scalar, Scalar]
    base: tuple[Complex, Complex]
    bare: tuple[Complex, Complex]
    way: Scalar


@function
def faces(cos_i: Scalar, eta: Scalar, k: Scalar, film_eta: Scalar, thickness: Scalar) -> Faces:
    """Of a film of real index film_eta >= 1 on a base of index eta + i k."""
    sin2 = 1.0 - sqr(cos_i)
    inside = sqrt(maximum(sqr(film_eta) - sin2, 1e-12))
    w = _root(sqr(eta) - sqr(k) - sin2, eta * k)
    contrast = (1.0 - film_eta) * (1.0 + film_eta)
    top_s = contrast / sqr(cos_i + inside)
    top_p = -top_s * (cos_i * inside - sin2) / maximum(cos_i * inside + sin2, 1e-30)
    loss = 2.0 * eta * k
    base = _face(inside, w, Complex((film_eta - eta) * (film_eta + eta) + sqr(k), -loss), sin2)
    bare = _face(cos_i, w, Complex((1.0 - eta) * (1.0 + eta) + sqr(k), -loss), sin2)
    return Faces((top_s, top_p), base, bare, thickness * inside)


def _face(above: Scalar, below: Complex, contrast: Complex, sin2: Scalar) -> tuple[Complex, Complex]:
    """(r_s, r_p) between two media, a over b, with w = sqrt(n^2 - sin^2): r_s = (n_a^2 - n_b^2) / (w_a + w_b)^2 and
    r_p = -r_s (w_a w_b - sin^2) / (w_a w_b + sin^2). Where the indices are near nothing cancels."""
    both = Complex(above + below.re, below.im)
    s = contrast.over(both.times(both))
    product = below.scaled(above)
    turned = Complex(sin2 - product.re, -product.im).over(Complex(sin2 + product.re, product.im))
    return s, s.times(turned)


def _root(real: Scalar, half_imaginary: Scalar) -> Complex:
    """sqrt(real + 2 i half_imaginary), both parts >= 0; the smaller is found from the larger, which cancels nothing."""
    size = sqrt(maximum(sqr(real) + 4.0 * sqr(half_imaginary), 1e-30))
    larger = sqrt(maximum(0.5 * (size + abs(real)), 1e-24))
    other = half_imaginary / larger
    return Complex(where(real > 0.0, larger, other), where(real > 0.0, other, larger))


class Amplitudes(NamedTuple):
    """Of all waves together at one wavelength: reflected fields, and what both are divided by."""

    s: Complex
    p: Complex
    under_s: Complex
    under_p: Complex


@function
def airy(film: Faces, wavelength: Scalar | float) -> Amplitudes:
    """The sum of all waves at a wavelength, in the unit of the thickness.

    Above the line stands r12 + r23 E = r13 (1 + r12 r23) + r23 (E - 1), with r13 of the bare surface: it cancels only
    where waves do.
    """
    turns = 2.0 * film.way / wavelength
    half_angle = (turns - floor(turns)) * math.pi  # a shader's sine is good near 0 only
    sin, cos = sincos(half_angle)
    less = Complex(-2.0 * sqr(sin), 2.0 * sin * cos)  # E - 1
    over, under = [], []
    for top, base, bare in zip(film.top, film.base, film.bare, strict=True):
        inner = base.times(less)
        once = Complex(1.0 + top * base.re, top * base.im)
        over.append(bare.times(once).plus(inner))
        under.append(once.plus(inner.scaled(top)))
    return Amplitudes(over[0].over(under[0]), over[1].over(under[1]), *under)


class Film(NamedTuple):
    """A film on a base, as a material has it.

    eta, k      of the base, colours
    film_eta    index of the film
    thickness   nm
    form        a name of `FORMS`
    wavelengths of the rays, nm, one for each channel, in spectral variants; else None
    """

    eta: Spectrum
    k: Spectrum
    film_eta: Scalar
    thickness: Scalar
    form: str
    wavelengths: Spectrum | None


def reflectance(cos_i: Scalar, film: Film) -> Spectrum:
    """R of unpolarized light under cos_i, by the form of the film; at the rays' wavelengths where these are known."""
    index = film.eta, film.k, film.film_eta, film.thickness
    if film.wavelengths is not None:
        return _seen(film, lambda eta, k, nm: _unpolarized(cos_i, eta, k, film.film_eta, film.thickness, nm))
    if film.form == "belcour-barla":
        return _in_fourier_space(cos_i, *index)
    return _by_wavelengths(cos_i, *index)


@function
def _by_wavelengths(cos_i: Scalar, eta: Spectrum, k: Spectrum, film_eta: Scalar, thickness: Scalar) -> Spectrum:
    """The colour of R under daylight, summed over `NODES`."""
    mixing = WEIGHTS if len(channels(eta)) == 3 else np.tile((WEIGHTS @ colour.LUMINANCE)[:, None], 3)
    seen = 0.0 * eta
    for nm, (red, green, blue) in zip(NODES.tolist(), mixing.tolist(), strict=True):
        seen = seen + _node(cos_i, eta, k, film_eta, thickness, nm, red, green, blue)
    # colours that no three lights mix would be more than all, or less than nothing
    return clamp(seen, 0.0, 1.0)


def polarization(cos_i: Scalar, film: Film) -> tuple[Diattenuation[Spectrum], Diattenuation[Spectrum]]:
    """What reflection and refraction do to polarization, from outside, summed over wavelengths whatever the form is."""

    def seen(what: Callable[[Amplitudes], Scalar]) -> Spectrum:
        def at(eta: Scalar, k: Scalar, nm: Scalar | float) -> Scalar:
            return what(airy(faces(cos_i, eta, k, film.film_eta, film.thickness), nm))

        return _seen(film, at)

    def reflected(waves: Amplitudes) -> Complex:
        return waves.s.times(waves.p.conjugate)

    def transmitted(waves: Amplitudes) -> Complex:
        """t_s times the conjugate of t_p: only what both are divided by turns them apart."""
        phase = waves.under_s.conjugate.times(waves.under_p)
        size = maximum(1.0 - waves.s.square, 0.0) * maximum(1.0 - waves.p.square, 0.0)
        return phase.scaled(sqrt(size / maximum(phase.square, 1e-30)))

    s, p = seen(lambda waves: waves.s.square), seen(lambda waves: waves.p.square)
    back = seen(lambda waves: reflected(waves).re), seen(lambda waves: reflected(waves).im)
    on = seen(lambda waves: transmitted(waves).re), seen(lambda waves: transmitted(waves).im)
    return _over_sum(s, p, *back), _over_sum(1.0 - s, 1.0 - p, *on)


def _over_sum(s: Spectrum, p: Spectrum, real: Spectrum, imaginary: Spectrum) -> Diattenuation[Spectrum]:
    one = 1.0 / maximum(s + p, 1e-12)
    return Diattenuation((s - p) * one, 2.0 * real * one, 2.0 * imaginary * one)


@function
def _unpolarized(
    cos_i: Scalar, eta: Scalar, k: Scalar, film_eta: Scalar, thickness: Scalar, wavelength: Scalar | float
) -> Scalar:
    """R at one wavelength."""
    waves = airy(faces(cos_i, eta, k, film_eta, thickness), wavelength)
    return 0.5 * (waves.s.square + waves.p.square)


@function
def _node(
    cos_i: Scalar,
    eta: Spectrum,
    k: Spectrum,
    film_eta: Scalar,
    thickness: Scalar,
    nm: float,
    red: float,
    green: float,
    blue: float,
) -> Spectrum:
    """What a wavelength adds to the colour of R."""
    R = _unpolarized(cos_i, _between(channels(eta), nm), _between(channels(k), nm), film_eta, thickness, nm)
    return of_channels(eta, [R * share for share in (red, green, blue)][: len(channels(eta))])


def _seen(film: Film, at: Callable[[Scalar, Scalar, Scalar | float], Scalar]) -> Spectrum:
    """What `at` gives for eta, k and a wavelength: one for each channel of a spectrum, else a colour under daylight."""
    if film.wavelengths is None:
        return _sum(film.eta, film.k, range(len(NODES)), at)
    triples = zip(channels(film.eta), channels(film.k), channels(film.wavelengths), strict=True)
    return of_channels(film.eta, [at(*one) for one in triples])


def _sum(
    eta: Spectrum, k: Spectrum, nodes: Sequence[int], at: Callable[[Scalar, Scalar, Scalar | float], Scalar]
) -> Spectrum:
    """The colour of what `at` gives at some of the nodes. The indices of red, green and blue stand for
    `RGB_WAVELENGTHS`; between them they are straight, beyond them level."""
    etas, ks = channels(eta), channels(k)
    mixing = WEIGHTS if len(etas) == 3 else (WEIGHTS @ colour.LUMINANCE)[:, None]
    totals: list[Scalar] = []
    for node in nodes:
        nm = float(NODES[node])
        R = at(_between(etas, nm), _between(ks, nm), nm)
        terms = [R * float(share) for share in mixing[node]]
        totals = [total + term for total, term in zip(totals, terms, strict=True)] if totals else terms
    return of_channels(eta, totals)


def _between(values: Sequence[Scalar], nm: float) -> Scalar:
    """The value at a wavelength of one that is known at `RGB_WAVELENGTHS`."""
    if len(values) != 3:
        return values[0]
    red, green, blue = RGB_WAVELENGTHS
    upper, lower = clamp((nm - green) / (red - green), 0.0, 1.0), clamp((green - nm) / (green - blue), 0.0, 1.0)
    return values[1] + (values[0] - values[1]) * upper + (values[2] - values[1]) * lower


# ---------------------------------------------------------------------- in Fourier space


@function
def _in_fourier_space(cos_i: Scalar, eta: Spectrum, k: Spectrum, film_eta: Scalar, thickness: Scalar) -> Spectrum:
    """Belcour2017, eq. 6 to 10, the mean term kept as a colour; harmonics of red, green and blue indices are taken for
    those of x, y and z."""
    etas, ks = channels(eta), channels(k)
    if len(etas) != 3:
        luminance = _band(cos_i, etas[0], ks[0], film_eta, thickness, *BELLS[1], *SECOND[1])
        return clamp(of_channels(eta, [luminance.mean + luminance.wave]), 0.0, 1.0)
    x = _band(cos_i, etas[0], ks[0], film_eta, thickness, *BELLS[0], *SECOND[0])
    y = _band(cos_i, etas[1], ks[1], film_eta, thickness, *BELLS[1], *SECOND[1])
    z = _band(cos_i, etas[2], ks[2], film_eta, thickness, *BELLS[2], *SECOND[2])
    X, Y, Z = (band.wave * white for band, white in zip((x, y, z), WHITE, strict=True))
    waves = [X * float(row[0]) + Y * float(row[1]) + Z * float(row[2]) for row in colour.XYZ_TO_RGB]
    total = [band.mean + wave for band, wave in zip((x, y, z), waves, strict=True)]
    return clamp(of_channels(eta, total), 0.0, 1.0)


class Band(NamedTuple):
    """What one curve of the observer sees: the mean of R over wavelengths, and what is left of its waves."""

    mean: Scalar
    wave: Scalar


@function
def _band(
    cos_i: Scalar,
    eta: Scalar,
    k: Scalar,
    film_eta: Scalar,
    thickness: Scalar,
    height: float,
    place: float,
    variance: float,
    height_too: float,
    place_too: float,
    variance_too: float,
) -> Band:
    """Mean of both polarizations; the curve is the sum of two bells."""
    film = faces(cos_i, eta, k, film_eta, thickness)
    mean, wave = 0.0 * cos_i, 0.0 * cos_i
    trips: list[Complex] = []  # once through the film and back, without the way
    sizes: list[Scalar] = []
    for top, base in zip(film.top, film.base, strict=True):
        outer, inner = sqr(top), base.square
        passed = 1.0 - outer
        bounced = sqr(passed) * inner / maximum(1.0 - outer * inner, 1e-6)
        mean = mean + 0.5 * (outer + bounced)
        trips.append(base.scaled(-top))
        sizes.append(bounced - passed)
    powers = trips
    for order in range(1, HARMONICS + 1):
        path = film.way * (2.0 * order * 1e-9)
        curve = _bell(path, height, place, variance).plus(_bell(path, height_too, place_too, variance_too))
        if order > 1:
            powers = [power.times(trip) for power, trip in zip(powers, trips, strict=True)]
        for size, power in zip(sizes, powers, strict=True):
            wave = wave + size * power.times(curve).re
    return Band(mean, wave)


@function
def _bell(path: Scalar, height: float, place: float, variance: float) -> Complex:
    """The Fourier transform of a bell over wave numbers at a path, metres: a wave that dies out."""
    turns = path * place
    angle = (turns - floor(turns)) * (2.0 * math.pi)
    sin, cos = sincos(angle)
    size = exp(sqr(path) * (variance * -((2.0 * math.pi) ** 2))) * height
    return Complex(cos, sin).scaled(size)
