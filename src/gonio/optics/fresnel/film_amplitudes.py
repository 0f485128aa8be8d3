"""The amplitudes of a thin film: its faces, and the sum of all waves that they reflect.

Let r12 be the amplitude of the film's upper face, r23 that of the surface below the film, and
delta = 4 pi d w2 / lambda with w2 = sqrt(eta2^2 - sin^2) the phase of a round trip, for a film of thickness d and index
eta2. The sum is (Airy; Born1999, sec. 7.6)

    r = (r12 + r23 e^(i delta)) / (1 + r12 r23 e^(i delta)).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from ...ops import Scalar, Spectrum, abs, channels, floor, function, maximum, sincos, sqr, sqrt, where


class Complex(NamedTuple):
    """A complex number of Dr.Jit values or symbols."""

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
        """The squared absolute value."""
        return sqr(self.re) + sqr(self.im)

    def over(self, other: Amplitude) -> Complex:
        return self.times(other.conjugate).scaled(1.0 / maximum(other.square, 1e-30))


class Real(NamedTuple):
    """A real number with the interface of `Complex`, for clear bases, at a third of the cost."""

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
    """The amplitudes (r_s, r_p) of a film's faces, and half the optical path of a round trip through it.

    top    amplitudes of the upper face, which are real
    base   amplitudes of the surface below the film
    bare   amplitudes of that surface without the film
    way    d w2, in the unit of the thickness d
    """

    top: tuple[Scalar, Scalar]
    base: tuple[Complex, Complex]
    bare: tuple[Complex, Complex]
    way: Scalar


class ClearFaces(NamedTuple):
    """`Faces` for a clear base."""

    top: tuple[Scalar, Scalar]
    base: tuple[Real, Real]
    bare: tuple[Real, Real]
    way: Scalar


@function
def faces(cos_i: Scalar, eta: Scalar, k: Scalar | None, film_eta: Scalar, thickness: Scalar) -> Faces | ClearFaces:
    """The faces of a film of real index film_eta >= 1 on a base of index eta + i k, or real index eta; see `Film`."""
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
    """(r_s, r_p) of the face between the medium a above and b below. With w = sqrt(n^2 - sin^2),
    r_s = (n_a^2 - n_b^2) / (w_a + w_b)^2 and r_p = -r_s (w_a w_b - sin^2) / (w_a w_b + sin^2), in which nothing cancels
    for similar indices."""
    both = Complex(above + below.re, below.im)
    s = contrast.over(both.times(both))
    product = below.scaled(above)
    ratio = Complex(sin2 - product.re, -product.im).over(Complex(sin2 + product.re, product.im))
    return s, s.times(ratio)


def _clear_face(above: Scalar, below: Scalar, contrast: Scalar, sin2: Scalar) -> tuple[Real, Real]:
    """`_face` between two clear media."""
    s, product = contrast / sqr(above + below), above * below
    return Real(s), Real(s * (sin2 - product) / maximum(sin2 + product, 1e-30))


@function
def _root(real: Scalar, half_imaginary: Scalar) -> Complex:
    """sqrt(real + 2 i half_imaginary), both parts >= 0; the smaller follows from the larger, so nothing cancels."""
    size = sqrt(maximum(sqr(real) + 4.0 * sqr(half_imaginary), 1e-30))
    larger = sqrt(maximum(0.5 * (size + abs(real)), 1e-24))
    other = half_imaginary / larger
    return Complex(where(real > 0.0, larger, other), where(real > 0.0, other, larger))


class Amplitudes(NamedTuple):
    """The sums of all reflected waves at one wavelength.

    s, p              amplitudes of the two polarizations
    under_s, under_p  their denominators, 1 + r12 r23 e^(i delta)
    """

    s: Complex
    p: Complex
    under_s: Complex
    under_p: Complex


@function
def airy(film: Faces | ClearFaces, wavelength: Scalar | float) -> Amplitudes:
    """The sums of all reflected waves at a wavelength, which is in the unit of the thickness.

    With E = e^(i delta), the numerator is r12 + r23 E = r13 (1 + r12 r23) + r23 (E - 1), where r13 is the amplitude of
    the bare surface. In this form, cancellation occurs only where the waves themselves cancel.
    """
    turns = 2.0 * film.way / wavelength
    half_angle = (turns - floor(turns)) * math.pi  # the sine of shaders is accurate only near 0
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


def channels_of_k(k: Spectrum | None, eta: Spectrum) -> Sequence[Scalar | None]:
    """The channels of k, as many as eta has; None for each channel if k is None."""
    return [None] * len(channels(eta)) if k is None else channels(k)
