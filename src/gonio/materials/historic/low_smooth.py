"""Low's model of a smooth surface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ... import ops
from ...material.bsdf import KnownViolation
from ...material.parameters import Colour, Member, Number, number, spectrum
from ...ops import (
    Direction,
    Scalar,
    Spectrum,
    exp,
    function,
    inv_pi,
    maximum,
    safe_sqrt,
    sincos,
    sqr,
    sqrt,
    vec3,
    where,
)
from ...optics import fresnel
from ...optics.special import exprel, logrel, power_integral, power_quantile
from ..microfacet import microfacet
from .glossy import _Glossy, sum_breach

# Minimum radius at which the power law is truncated. At grazing angles, the rim is so close in half of the azimuths
# that all samples there would lie in a sliver along the horizon, whose density float32 directions cannot resolve.
RIM = 0.25


class LowSmooth(_Glossy):
    """Rayleigh-Rice scattering of a nearly smooth surface: f = diffuse / pi + specular (1 + b |Dp|^2)^-c F (Low2012).

    Dp, the tangential component of o + i, is the deviation of the pair from mirror reflection. The lobe follows the
    power spectrum of polished surfaces (the ABC model; Church1990). F is evaluated at the cosine sqrt(1 - |q|^2 / 4),
    where q is the tangential component of o - i; for mirror reflection, this is the cosine of the angle of incidence.
    The model is reciprocal. `specular` is not an albedo but the height of the peak divided by F, in 1/sr. Dp is sampled
    from the power law of the lobe, truncated near the rim of the disk of projected directions.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=10.0, doc="height of the peak divided by F, in 1/sr", low=0.0)
    b: Number = number(default=300.0, doc="narrowness of the peak, whose radius in Dp is 1 / sqrt(b)", low=1e-3)
    c: Number = number(default=1.0, doc="falloff beyond the peak, as the length of Dp to the power -2 c", low=0.0)
    eta: Colour = spectrum(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    fresnel: Member = microfacet.fresnel_choice()

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("the lobe is not normalized, and "),
    }

    def _most(self) -> np.ndarray:
        """`specular` times the lobe's integral over a disk of radius 2, the maximum of |Dp|."""
        return np.max(np.asarray(self.specular, float)) * np.max(_area(np.asarray(self.b), np.asarray(self.c), 2.0))

    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
        return fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, ops.zeros_like(self.eta))

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular (1 + b |Dp|^2)^-c F cos theta_i."""
        across2 = sqr(wo.x - wi.x) + sqr(wo.y - wi.y)
        spread = exp(-self.c * self._log_fall(_deviation2(wo, wi)))
        return self.specular * self.reflectance(safe_sqrt(1.0 - 0.25 * across2)) * (spread * wi.z)

    @function
    def _mass(self, radius: Scalar) -> Scalar:
        """int_0^radius (1 + b r^2)^-c r dr."""
        return power_integral(self._log_fall(sqr(radius)), 1.0 - self.c) * (0.5 / self.b)

    @function
    def _log_fall(self, r2: Scalar) -> Scalar:
        """log(1 + b r^2), accurate for a small b r^2."""
        x = self.b * r2
        return x * logrel(x)

    @function
    def _focus(self) -> Scalar:
        """(1 - 1 / r)^2, where r = 1 / (2 mass) is the peak density of the lobe divided by that of the cosine, which is
        uniform on the disk."""
        mass = self._mass(ops.ones_like(self.b))
        return sqr(ops.clamp(1.0 - 2.0 * mass, 0.0, 1.0))

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """(1 + b r^2)^-c / (2 pi mass), the density on the disk of directions, times d(disk)/dw = cos theta_i."""
        r2 = _deviation2(wo, wi)
        r = sqrt(maximum(r2, 1e-30))
        rim = _rim(wo, (wo.x + wi.x) / r, (wo.y + wi.y) / r)
        spread = exp(-self.c * self._log_fall(r2))
        return spread * wi.z * (0.5 * inv_pi) / self._mass(maximum(rim.ahead, RIM))

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """The direction whose projection is one step away from that of the mirrored wo, at a uniform azimuth. The
        length of the step follows the power law, truncated at the rim of the disk or at `RIM`, whichever is farther; a
        step beyond the rim is a failed sample."""
        s, c = sincos((2.0 * ops.pi) * u.z)
        rim = _rim(wo, c, s)
        q = 1.0 - self.c
        end = maximum(rim.ahead, RIM)
        log_t = power_quantile(u.y * power_integral(self._log_fall(sqr(end)), q), q)
        r = sqrt(log_t * exprel(log_t) / self.b)
        # 1 - x^2 - y^2 as a product, because the difference cancels near the rim
        z2 = (rim.ahead - r) * (rim.behind + r)
        beyond = ops.rsqrt(1.0 + maximum(-z2, 0.0))
        return vec3((r * c - wo.x) * beyond, (r * s - wo.y) * beyond, safe_sqrt(z2))

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """specular F times the lobe's integral over a disk of radius 1, which contains all directions at normal
        incidence."""
        return self.specular * self.reflectance(wo.z) * ((2.0 * ops.pi) * self._mass(ops.ones_like(wo.z)))


class Rim(NamedTuple):
    ahead: Scalar
    behind: Scalar


@function
def _rim(wo: Direction, c: Scalar, s: Scalar) -> Rim:
    """Distances from the mirrored wo to the rim of the unit disk, along the azimuth (c, s) and opposite to it.

    They are the roots r of |p + r d|^2 = 1, where p is the mirrored wo on the disk and d = (c, s). One root would
    suffer from cancellation, so it is computed from their product, -(n.o)^2.
    """
    along = wo.x * c + wo.y * s
    root = sqrt(sqr(along) + sqr(wo.z))
    longer = maximum(root + ops.abs(along), 1e-6)
    shorter = sqr(wo.z) / longer
    return Rim(where(along > 0.0, longer, shorter), where(along > 0.0, shorter, longer))


@function
def _deviation2(wo: Direction, wi: Direction) -> Scalar:
    """|Dp|^2, the squared length of the tangential component of o + i."""
    return sqr(wo.x + wi.x) + sqr(wo.y + wi.y)


def _area(b: np.ndarray, c: np.ndarray, radius: float) -> np.ndarray:
    """2 pi int_0^radius (1 + b r^2)^-c r dr, for plain numbers."""
    log_t, q = np.log1p(b * radius**2), np.where(np.abs(1.0 - c) < 1e-9, 1e-9, 1.0 - c)
    return np.pi / b * np.expm1(q * log_t) / q
