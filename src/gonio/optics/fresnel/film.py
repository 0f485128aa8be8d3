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
from typing import NamedTuple, TypeAlias, overload

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
    zeros_like,
)
from ...ops.types import Value
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


Curve: TypeAlias = tuple[tuple[float, float, float], ...]

# Fits of the observer's curves over wave numbers, as sums of bells (Belcour2017, supplemental code): height, place and
# variance
CURVES: tuple[Curve, Curve, Curve] = (
    (_of_unit(5.4856e-13, 1.6810e6, 4.3278e9), _of_unit(9.7470e-14, 2.2399e6, 4.5282e9)),
    (_of_unit(4.4201e-13, 1.7953e6, 9.3046e9),),
    (_of_unit(5.2481e-13, 2.2084e6, 6.6121e9),),
)
HARMONICS = 3  # the next is r^4 of the first, and the eye's curves have blurred it
WHITE = (0.95047, 1.0, 1.08883)  # XYZ of D65: the curves were fitted under even light


class Complex(NamedTuple):
    """A complex number, of symbols too."""

    re: Scalar
    im: Scalar

    def plus(self, other: Amplitude) -> Complex:
        return Complex(self.re + other.re, self.im if isinstance(other, Real) else self.im + other.im)

    def times(self, other: Amplitude) -> Complex:
        if isinstance(other, Real):
            return self.scaled(other.re)
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

    def over(self, other: Amplitude) -> Complex:
        return self.times(other.conjugate).scaled(1.0 / maximum(other.square, 1e-30))


class Real(NamedTuple):
    """A real number in the place of a complex one: of clear bases, for a third of the work."""

    re: Scalar

    def plus(self, other: Real) -> Real:
        return Real(self.re + other.re)

    def times(self, other: Amplitude) -> Amplitude:
        return other.scaled(self.re)

    def scaled(self, factor: Scalar | float) -> Real:
        return Real(self.re * factor)

    @property
    def conjugate(self) -> Real:
        return self

    @property
    def square(self) -> Scalar:
        return sqr(self.re)

    def over(self, other: Real) -> Real:
        return Real(self.re / maximum(other.re, 1e-30))


Amplitude: TypeAlias = Complex | Real


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


class ClearFaces(NamedTuple):
    """The same of a base that is clear."""

    top: tuple[Scalar, Scalar]
    base: tuple[Real, Real]
    bare: tuple[Real, Real]
    way: Scalar


@function
def faces(cos_i: Scalar, eta: Scalar, k: Scalar | None, film_eta: Scalar, thickness: Scalar) -> Faces | ClearFaces:
    """Of a film of real index film_eta >= 1 on a base of index eta + i k, or clear without k, see `Film`."""
    sin2 = 1.0 - sqr(cos_i)
    inside = sqrt(maximum(sqr(film_eta) - sin2, 1e-12))
    contrast = (1.0 - film_eta) * (1.0 + film_eta)
    top_s = contrast / sqr(cos_i + inside)
    top_p = -top_s * (cos_i * inside - sin2) / maximum(cos_i * inside + sin2, 1e-30)
    under, outside = (film_eta - eta) * (film_eta + eta), (1.0 - eta) * (1.0 + eta)
    if k is None:
        below = sqrt(maximum(sqr(eta) - sin2, 1e-12))
        base = _clear_face(inside, below, under, sin2)
        bare = _clear_face(cos_i, below, outside, sin2)
        return ClearFaces((top_s, top_p), base, bare, thickness * inside)
    w = _root(sqr(eta) - sqr(k) - sin2, eta * k)
    loss = 2.0 * eta * k
    return Faces(
        (top_s, top_p),
        _face(inside, w, Complex(under + sqr(k), -loss), sin2),
        _face(cos_i, w, Complex(outside + sqr(k), -loss), sin2),
        thickness * inside,
    )


def _face(above: Scalar, below: Complex, contrast: Complex, sin2: Scalar) -> tuple[Complex, Complex]:
    """(r_s, r_p) between two media, a over b, with w = sqrt(n^2 - sin^2): r_s = (n_a^2 - n_b^2) / (w_a + w_b)^2 and
    r_p = -r_s (w_a w_b - sin^2) / (w_a w_b + sin^2). Where the indices are near nothing cancels."""
    both = Complex(above + below.re, below.im)
    s = contrast.over(both.times(both))
    product = below.scaled(above)
    ratio = Complex(sin2 - product.re, -product.im).over(Complex(sin2 + product.re, product.im))
    return s, s.times(ratio)


def _clear_face(above: Scalar, below: Scalar, contrast: Scalar, sin2: Scalar) -> tuple[Real, Real]:
    """The same, both media clear."""
    s, product = contrast / sqr(above + below), above * below
    return Real(s), Real(s * (sin2 - product) / maximum(sin2 + product, 1e-30))


@function
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
def airy(film: Faces | ClearFaces, wavelength: Scalar | float) -> Amplitudes:
    """The sum of all waves at a wavelength, in the unit of the thickness.

    Above the line stands r12 + r23 E = r13 (1 + r12 r23) + r23 (E - 1), with r13 of the bare surface: it cancels only
    where waves do.
    """
    turns = 2.0 * film.way / wavelength
    half_angle = (turns - floor(turns)) * math.pi  # a shader's sine is good near 0 only
    sin, cos = sincos(half_angle)
    less = Complex(-2.0 * sqr(sin), 2.0 * sin * cos)  # E - 1
    over, under = [], []
    for number, top in enumerate(film.top):
        base, bare = film.base[number], film.bare[number]
        inner = less.times(base)
        share = base.scaled(top)
        once = share._replace(re=1.0 + share.re)
        over.append(inner.plus(bare.times(once)))
        under.append(inner.scaled(top).plus(once))
    return Amplitudes(over[0].over(under[0]), over[1].over(under[1]), *under)


class Film(NamedTuple):
    """A film on a base, as a material has it.

    eta, k      of the base, colours; k None: it is clear, and light from outside always finds a way into it, eta > sin
    film_eta    index of the film
    thickness   nm
    form        a name of `FORMS`
    wavelengths of the rays, nm, one for each channel, in spectral variants; else None
    """

    eta: Spectrum
    k: Spectrum | None
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
def _by_wavelengths(cos_i: Scalar, eta: Spectrum, k: Spectrum | None, film_eta: Scalar, thickness: Scalar) -> Spectrum:
    """The colour of R under daylight, summed over `NODES`."""
    mixing = WEIGHTS if len(channels(eta)) == 3 else np.tile((WEIGHTS @ colour.LUMINANCE)[:, None], 3)
    total = zeros_like(eta)
    for nm, (red, green, blue) in zip(NODES.tolist(), mixing.tolist(), strict=True):
        total = total + _node(cos_i, eta, k, film_eta, thickness, nm, red, green, blue)
    # colours that no three lights mix would be more than all, or less than nothing
    return clamp(total, 0.0, 1.0)


def polarization(cos_i: Scalar, film: Film) -> tuple[Diattenuation[Spectrum], Diattenuation[Spectrum]]:
    """What reflection and refraction do to polarization, from outside, summed over wavelengths whatever the form is."""

    def summed(what: Callable[[Amplitudes], Scalar]) -> Spectrum:
        def at(eta: Scalar, k: Scalar | None, nm: Scalar | float) -> Scalar:
            return what(airy(faces(cos_i, eta, k, film.film_eta, film.thickness), nm))

        return _seen(film, at)

    def reflected(waves: Amplitudes) -> Complex:
        return waves.s.times(waves.p.conjugate)

    def transmitted(waves: Amplitudes) -> Complex:
        """t_s times the conjugate of t_p: only what both are divided by turns them apart."""
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
    """What a wavelength adds to the colour of R."""
    R = _unpolarized(cos_i, _between(channels(eta), nm), _between(_of(k, eta), nm), film_eta, thickness, nm)
    return of_channels(eta, [R * share for share in (red, green, blue)][: len(channels(eta))])


def _seen(film: Film, at: Callable[[Scalar, Scalar | None, Scalar | float], Scalar]) -> Spectrum:
    """What `at` gives for eta, k and a wavelength: one for each channel of a spectrum, else a colour under daylight."""
    if film.wavelengths is None:
        return _sum(film.eta, film.k, range(len(NODES)), at)
    triples = zip(channels(film.eta), _of(film.k, film.eta), channels(film.wavelengths), strict=True)
    return of_channels(film.eta, [at(*one) for one in triples])


def _sum(
    eta: Spectrum,
    k: Spectrum | None,
    nodes: Sequence[int],
    at: Callable[[Scalar, Scalar | None, Scalar | float], Scalar],
) -> Spectrum:
    """The colour of what `at` gives at some of the nodes. The indices of red, green and blue stand for
    `RGB_WAVELENGTHS`; between them they are straight, beyond them level."""
    etas, ks = channels(eta), _of(k, eta)
    mixing = WEIGHTS if len(etas) == 3 else (WEIGHTS @ colour.LUMINANCE)[:, None]
    totals: list[Scalar] = []
    for node in nodes:
        nm = float(NODES[node])
        R = at(_between(etas, nm), _between(ks, nm), nm)
        terms = [R * float(share) for share in mixing[node]]
        totals = [total + term for total, term in zip(totals, terms, strict=True)] if totals else terms
    return of_channels(eta, totals)


def _of(k: Spectrum | None, eta: Spectrum) -> Sequence[Scalar | None]:
    """The channels of k, as many as those of eta."""
    return [None] * len(channels(eta)) if k is None else channels(k)


@overload
def _between(values: Sequence[Scalar], nm: float) -> Scalar: ...
@overload
def _between(values: Sequence[Scalar | None], nm: float) -> Scalar | None: ...
def _between(values: Sequence[Value], nm: float) -> Value:
    """The value at a wavelength of one that is known at `RGB_WAVELENGTHS`."""
    if values[0] is None:
        return None
    if len(values) != 3:
        return values[0]
    red, green, blue = RGB_WAVELENGTHS
    upper, lower = clamp((nm - green) / (red - green), 0.0, 1.0), clamp((green - nm) / (green - blue), 0.0, 1.0)
    return values[1] + (values[0] - values[1]) * upper + (values[2] - values[1]) * lower


# ---------------------------------------------------------------------- in Fourier space


@function
def _in_fourier_space(
    cos_i: Scalar, eta: Spectrum, k: Spectrum | None, film_eta: Scalar, thickness: Scalar
) -> Spectrum:
    """Belcour2017, eq. 6 to 10, the mean term kept as a colour; harmonics of red, green and blue indices are taken for
    those of x, y and z."""
    etas, ks = channels(eta), _of(k, eta)
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
    """What one curve of the observer sees: the mean of R over wavelengths, and what is left of its waves."""

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
    """Mean of both polarizations, through a curve of one bell."""
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
    """Mean of both polarizations, through a curve of two bells."""
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
    """Through a curve that is a sum of bells, each height, place and variance."""
    film = faces(cos_i, eta, k, film_eta, thickness)
    mean, wave = zeros_like(cos_i), zeros_like(cos_i)
    trips: list[Amplitude] = []  # once through the film and back, without the way
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
    # A path n times as long turns a bell's wave n times as far, and dies out as the n^2-th power
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
    """The Fourier transform of a bell over wave numbers: a wave that dies out.

    turn  where the wave stands
    left  what is left of it
    """

    turn: Complex
    left: Scalar


@function
def _bell(path: Scalar, place: float, variance: float) -> Bell:
    """At a path, metres."""
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
