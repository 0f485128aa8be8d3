"""The energy lost by a microfacet surface that only reflects: metals, and glass without transmission."""

from __future__ import annotations

from typing import NamedTuple

from ...material import BSDF, Microsurface
from ...material.parameters import has_two_values
from ...ops import function, inset, lookup, maximum, minimum, ones_like, sqr, sqrt, where
from ...ops.backend import Array
from ...ops.types import Direction, Mode, Pair, Scalar, Spectrum
from ...optics import frame
from ...optics.roughness import SMOOTH, widths
from ..bend import form_of, knee
from . import curves, lobe

APART = 0.05  # relative difference of two alphas above which only the anisotropic fit is used


class Reflecting(NamedTuple):
    """M as one Bernstein polynomial per alpha; see `curves`.

    c             coefficients of the polynomial; if the alphas differ, for their mean
    bend          the cosine below which masking is strong
    scale         1 / (pi M_avg) of this polynomial
    true_scale    1 / (pi M_avg) of M itself; equal to `scale` if the alphas are equal
    average       M_avg
    F_avg         mean reflectance
    factor        albedo of the base
    row           coordinate in the table of the inverse of the lobe
    two           `TwoWidths`, if the alphas differ
    ndf, masking  names of the distribution and the masking term
    """

    c: tuple[Scalar, ...]
    bend: Scalar
    scale: Scalar
    true_scale: Scalar
    average: Scalar
    F_avg: Spectrum
    factor: Spectrum
    row: Scalar
    two: TwoWidths | None
    ndf: str
    masking: str

    def at(self, w: Direction) -> Scalar:
        """M at a direction above the surface."""
        if self.two is None:
            return self.of_mean_width(w)
        even = self.of_mean_width(w)
        return even + self.two.apart * (self.two.at(w, self.ndf, self.masking) - even)

    def of_mean_width(self, w: Direction) -> Scalar:
        """M for the mean alpha, at a direction above the surface."""
        return curves.missing(form_of(self.ndf, self.masking), self.c, self.bend, w.z)

    def over_average(self, w: Direction) -> Scalar:
        return self.true_scale

    def share(self, wo: Direction, wi: Direction) -> Scalar:
        return where(lobe.above(wo, wi), ones_like(wi.z), 0.0)

    def radiance(self, wo: Direction, wi: Direction, mode: Mode) -> float:
        return 1.0

    def given(self, wo: Direction) -> Scalar:
        return where((self.scale > 0.0) & (wo.z > 0.0), self.at(wo), 0.0)

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the lobe, 1/sr: M(mu_i) mu_i / (pi M_avg) or, if the alphas differ, the average of this
        density for the mean alpha and for the larger one.

        M of an anisotropic surface is far above that of the mean alpha near the normal, and above that of the larger
        alpha at grazing angles.
        """
        density = self.of_mean_width(wi) * self.scale
        if self.two is not None:
            of_larger = self.two.larger.at(wi, self.ndf, self.masking) * self.two.larger.scale
            density = 0.5 * (density + of_larger)
        return density * maximum(wi.z, 0.0)

    def sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `pdf`: mu^2 from the table of its inverse, and a uniform azimuth."""
        row, v = self.row, u.y
        if self.two is not None:
            of_mean = v < 0.5
            row, v = where(of_mean, row, self.two.larger.row), where(of_mean, 2.0 * v, 2.0 * v - 1.0)
        (mu2,) = lookup(curves.lobe(self.ndf, self.masking), row, inset(v, curves.LOBE_NODES))
        return lobe.from_square(mu2, u.z)

    def eta(self, wo: Direction, wi: Direction) -> Scalar:
        return ones_like(wo.z)


class OneWidth(NamedTuple):
    """M for one alpha, and the lobe proportional to M mu.

    c      coefficients of the polynomial
    bend   the cosine below which masking is strong
    scale  1 / (pi M_avg)
    row    coordinate in the table of the inverse of the lobe
    """

    c: tuple[Scalar, ...]
    bend: Scalar
    scale: Scalar
    row: Scalar

    def at(self, w: Direction, ndf: str, masking: str) -> Scalar:
        """M at a direction above the surface."""
        return curves.missing(form_of(ndf, masking), self.c, self.bend, w.z)


class TwoWidths(NamedTuple):
    """M for two alphas, which depends on the azimuth; see `curves.anisotropic`.

    c_phi     for each coefficient of M, its coefficients in azimuth
    alpha     the two alphas
    rotation  rotation of the base
    apart     weight of this M relative to that of the mean alpha; 0 for equal alphas, for which the two fits differ by
              up to 2 % of a small value
    larger    M for the larger alpha, with which half of the lobe's samples are generated
    """

    c_phi: tuple[Scalar, ...]
    alpha: Pair
    rotation: Pair | None
    apart: Scalar
    larger: OneWidth

    def at(self, w: Direction, ndf: str, masking: str) -> Scalar:
        """M at a direction above the surface."""
        azimuth = _azimuth(frame.rotate(w, self.rotation), self.alpha)
        form = form_of(ndf, masking)
        rows = curves.turn(self.c_phi, azimuth.along, azimuth.across)
        return curves.missing(form, rows, knee(form, masking, azimuth.width), w.z)


def reflecting(base: BSDF, surface: Microsurface, average: str) -> Reflecting:
    """The energy lost by single scattering in a bound base that only reflects.

    surface  microsurface of the base
    average  "exact" or the name of a fit, as in `BSDF.mean_reflectance`
    """
    names = surface.ndf, surface.masking
    alpha, _ = widths(surface.alpha)
    two = has_two_widths(base.plain)
    width = sqrt(alpha.x * alpha.y) if two else alpha.x
    *c, mean = curves.coefficients(*names, width)
    mean = maximum(mean, 0.0)
    F_avg: Array = base.mean_reflectance(average)
    anisotropic, true_mean = None, mean
    if two:
        larger = maximum(alpha.x, alpha.y)
        ratio = minimum(alpha.x, alpha.y) / larger
        place = inset(sqrt(ratio), curves.ASPECTS), inset(sqrt(larger), curves.ASPECT_ROWS)
        *channels, of_both = lookup(curves.anisotropic(*names), *place)
        apart = minimum((1.0 - ratio) / APART, 1.0)
        of_larger = _one_width(larger, *names)
        anisotropic = TwoWidths(tuple(channels), alpha, surface.rotation, apart, of_larger)
        true_mean = mean + apart * (maximum(of_both, 0.0) - mean)
    return Reflecting(
        c=tuple(c),
        bend=knee(form_of(*names), surface.masking, width),
        scale=(scale := lobe.over_pi(mean)),
        true_scale=scale if anisotropic is None else lobe.over_pi(true_mean),
        average=true_mean,
        F_avg=F_avg,
        factor=surface.albedo,
        row=inset(sqrt(width), curves.ROWS),
        two=anisotropic,
        ndf=surface.ndf,
        masking=surface.masking,
    )


@function
def _one_width(width: Scalar, ndf: str, masking: str) -> OneWidth:
    """M of one width and its lobe."""
    *c, average = curves.coefficients(ndf, masking, width)
    bend = knee(form_of(ndf, masking), masking, width)
    return OneWidth(tuple(c), bend, lobe.over_pi(maximum(average, 0.0)), inset(sqrt(width), curves.ROWS))


def has_two_widths(base: BSDF) -> bool:
    """Whether an unbound base has, or may have, two different alphas, on which the code depends."""
    return base.microsurface is not None and has_two_values(base.microsurface.alpha)


class Azimuth(NamedTuple):
    """The azimuth of a direction between the axes of the larger and the smaller alpha, and the alpha along it."""

    along: Scalar
    across: Scalar
    width: Scalar


@function
def _azimuth(w: Direction, alpha: Pair) -> Azimuth:
    """(1 + y) / 2, (1 - y) / 2 and the alpha along w, alpha_phi; for the normal, the azimuth is arbitrary."""
    sin2 = maximum(frame.sin2(w), 1e-12)
    along_x, along_y = sqr(w.x) / sin2, sqr(w.y) / sin2
    width = sqrt(maximum(sqr(alpha.x) * along_x + sqr(alpha.y) * along_y, SMOOTH**2))
    has_azimuth = frame.sin2(w) > 1e-12
    x, y = where(has_azimuth, alpha.x * along_x, 1.0), where(has_azimuth, alpha.y * along_y, 1.0)
    larger_x = alpha.x >= alpha.y
    return Azimuth(where(larger_x, x, y) / (x + y), where(larger_x, y, x) / (x + y), width)
