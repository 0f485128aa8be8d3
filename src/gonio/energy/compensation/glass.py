"""The energy lost by single scattering in rough glass, for both sides of the surface.

Of the energy lost on side a, a fraction T_a is sent to side b, and the rest back to side a (power, not radiance):

    f_reflected = (1 - T_a) M_a(o) M_a(i) / (pi M_avg,a),    f_transmitted = T_a M_a(o) M_b(i) / (pi M_avg,b),

so that no energy of light from side a is lost for any T_a. Reciprocity, f_ab / n_b^2 = f_ba / n_a^2, requires
T_a / (n_b^2 M_avg,b) = T_b / (n_a^2 M_avg,a). Because (1 - F_avg,a) n_a^2 = (1 - F_avg,b) n_b^2, this condition holds
for T_a = (1 - F_avg,a) M_avg,b / (M_avg,a + M_avg,b)  (Kulla2017, p. 30).

M of anisotropic glass is that of isotropic glass with an alpha that depends on the direction (`curves.widths_along`);
the lobe is sampled with the mean alpha.
"""

from __future__ import annotations

from typing import NamedTuple

from ...material import BSDF, Microsurface
from ...ops import (
    Direction,
    Mask,
    Mode,
    Pair,
    Scalar,
    Spectrum,
    abs,
    inset,
    inv_pi,
    lookup,
    maximum,
    minimum,
    sqr,
    sqrt,
    vec3,
    where,
)
from ...ops.backend import Array
from ...optics import frame
from ...optics.roughness import widths
from ..bend import form_of, knee
from . import curves, lobe
from .reflecting import has_two_widths


class Side(NamedTuple):
    """One side of the surface.

    c           coefficients of M; if the alphas differ, for their mean
    bend        the cosine below which masking is strong
    scale       1 / (pi M_avg) of the polynomial with these coefficients; 0 if no energy is lost
    true_scale  1 / (pi M_avg) of M itself; equal to `scale` if the alphas are equal
    through     T, the fraction of this side's lost energy that is sent to the other side
    """

    c: tuple[Scalar, ...]
    bend: Scalar
    scale: Scalar
    true_scale: Scalar
    through: Scalar


class TwoWidths(NamedTuple):
    """The two alphas and the rotation of the base."""

    alpha: Pair
    rotation: Pair | None


class Glass(NamedTuple):
    """Both sides of a surface; "thin" is the less dense one.

    average  mean of M_avg over the two sides
    F_avg    albedo of the base; the base and the lobe together preserve this fraction of the energy
    place    coordinates, for index and alpha, in the tables of the inverses of the lobes
    inside   index inside divided by index outside
    names    names of the distribution, the masking term and the Fresnel kind
    two      the two alphas, if they differ
    """

    thin: Side
    dense: Side
    average: Scalar
    F_avg: Spectrum
    place: tuple[Scalar, Scalar]
    inside: Scalar
    names: tuple[str, str, str]
    two: TwoWidths | None

    @property
    def factor(self) -> float:
        return 1.0

    def is_thin(self, w: Direction) -> Mask:
        """Whether a direction lies on the less dense side."""
        below = w.z < 0.0
        return where(self.inside >= 1.0, ~below, below)

    def at(self, w: Direction) -> Scalar:
        """M for a direction on either side."""
        if self.two is None:
            return self.of_mean_width(w)
        eta = maximum(self.inside, 1.0 / self.inside)
        width = curves.widths_along(frame.rotate(w, self.two.rotation), self.two.alpha, (eta - 1.0) / (eta + 1.0))
        tables = curves.glass(*self.names)
        c, bends = [], []
        for name, one in zip(curves.SIDES, width, strict=True):
            c.append(lookup(tables[name], self.place[0], inset(sqrt(one), curves.GLASS_ROWS))[:-1])
            bends.append(knee(form_of(*self.names[:2], name), self.names[1], one))
        return self._missing(w, c, bends)

    def of_mean_width(self, w: Direction) -> Scalar:
        """M of the mean alpha, which is used to sample the lobe."""
        return self._missing(w, [self.thin.c, self.dense.c], [self.thin.bend, self.dense.bend])

    def _missing(self, w: Direction, coefficients: list[tuple[Scalar, ...]], bends: list[Scalar]) -> Scalar:
        of_sides = [
            curves.missing(form_of(*self.names[:2], name), c, bend, abs(w.z))
            for name, c, bend in zip(curves.SIDES, coefficients, bends, strict=True)
        ]
        return where(self.is_thin(w), of_sides[0], of_sides[1])

    def over_average(self, w: Direction) -> Scalar:
        return where(self.is_thin(w), self.thin.true_scale, self.dense.true_scale)

    def share(self, wo: Direction, wi: Direction) -> Scalar:
        """1 - T of wo's side for reflection, T for transmission; 0 if either direction lies in the surface."""
        sides = wo.z * wi.z
        through = self.through(wo)
        return where(sides != 0.0, where(sides > 0.0, 1.0 - through, through), 0.0)

    def through(self, wo: Direction) -> Scalar:
        """T of wo's side."""
        return where(self.is_thin(wo), self.thin.through, self.dense.through)

    def radiance(self, wo: Direction, wi: Direction, mode: Mode) -> Scalar | float:
        if mode == "importance":
            return 1.0
        return where(wo.z * wi.z > 0.0, 1.0, 1.0 / sqr(self.eta(wo, wi)))

    def given(self, wo: Direction) -> Scalar:
        return where(self.thin.scale > 0.0, self.at(wo), 0.0)

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """M(mu_i) mu_i / (pi M_avg) for wi's side and the mean alpha, times the fraction for that side."""
        scale = where(self.is_thin(wi), self.thin.scale, self.dense.scale)
        return self.of_mean_width(wi) * abs(wi.z) * scale * self.share(wo, wi)

    def sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `pdf`: u.x selects the side."""
        thin, passes = self.is_thin(wo), u.x < self.through(wo)
        tables = curves.glass_lobe(*self.names)
        at = inset(u.y, tables["thin"].shape[-1])
        (of_thin,), (of_dense,) = (lookup(tables[side], *self.place, at) for side in curves.SIDES)
        leaves_thin = (thin & ~passes) | (passes & ~thin)
        w = lobe.from_square(where(leaves_thin, of_thin, of_dense), u.z)
        below = (wo.z < 0.0) & ~passes | (wo.z >= 0.0) & passes
        return vec3(w.x, w.y, where(below, -w.z, w.z))

    def eta(self, wo: Direction, wi: Direction) -> Scalar:
        """Index on wi's side divided by the index on wo's side."""
        return where(wo.z * wi.z > 0.0, 1.0, where(wo.z >= 0.0, self.inside, 1.0 / self.inside))


def glass(base: BSDF, surface: Microsurface) -> Glass:
    """The energy lost by single scattering in a bound base that transmits.

    surface  microsurface of the base
    """
    index = surface.eta
    assert index is not None, "a base that transmits has an index"
    names = surface.ndf, surface.masking, surface.fresnel
    alpha, _ = widths(surface.alpha)
    two = has_two_widths(base.plain)
    width = sqrt(0.5 * (sqr(alpha.x) + sqr(alpha.y))) if two else alpha.x
    eta = maximum(index, 1.0 / index)
    place = (
        inset(sqrt(maximum(eta - 1.0, 1e-6) / ((eta + 1.0) * curves.MAX_ROOT)), curves.GLASS_ETAS),
        inset(sqrt(width), curves.GLASS_ROWS),
    )
    tables = curves.glass(*names)
    thin, dense = (lookup(tables[side], *place) for side in curves.SIDES)
    m_thin, m_dense = mean_thin, mean_dense = maximum(thin[-1], 0.0), maximum(dense[-1], 0.0)
    if two:
        larger, smaller = maximum(alpha.x, alpha.y), minimum(alpha.x, alpha.y)
        aspect = inset(sqrt(smaller / larger), curves.ASPECTS), inset(sqrt(larger), curves.ASPECT_ROWS)
        m_thin, m_dense = (maximum(m, 0.0) for m in lookup(curves.glass_of_two(*names), place[0], *aspect))
    both = maximum(m_thin + m_dense, 2.0 * lobe.NOTHING)
    some = (m_thin > lobe.NOTHING) & (m_dense > lobe.NOTHING) & (abs(index - 1.0) > 1e-4)
    reflected: Array = base.mean_reflectance()  # a single number, because the base is glass
    enters = 1.0 - reflected

    def side(name: str, fit: tuple[Scalar, ...], of_mean: Scalar, average: Scalar, through: Scalar) -> Side:
        bend = knee(form_of(*names[:2], name), surface.masking, width)
        scale, of_both_widths = (where(some, inv_pi / maximum(m, lobe.NOTHING), 0.0) for m in (of_mean, average))
        return Side(fit[:-1], bend, scale, of_both_widths, through)

    return Glass(
        thin=side("thin", thin, mean_thin, m_thin, enters * m_dense / both),
        dense=side("dense", dense, mean_dense, m_dense, enters / sqr(eta) * m_thin / both),
        average=0.5 * (m_thin + m_dense),
        F_avg=surface.albedo,
        place=place,
        inside=index,
        names=names,
        two=TwoWidths(alpha, surface.rotation) if two else None,
    )
