"""Bagher's shifted gamma distribution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ... import ops
from ...material.bsdf import KnownViolation
from ...material.parameters import Colour, spectrum
from ...ops import (
    Direction,
    Scalar,
    Spectrum,
    atan2,
    exp,
    function,
    inv_pi,
    log,
    max_component,
    maximum,
    mean,
    sincos,
    sqr,
    sqrt,
    vec3,
    where,
)
from ...optics import frame
from ...optics.fresnel.schlick import schlick
from ...optics.special import exprel, power_integral, power_quantile
from .glossy import _Glossy, facet, sum_breach

# Lower limit of G1. The fits of the paper reach -0.002 at 90 degrees, which is preserved; with other parameters, the
# product of two strongly negative G1 would be positive and unbounded.
MIN_COSINE = -0.01


class ShiftedGamma(_Glossy):
    """A microfacet model with a fitted distribution: f = diffuse / pi + specular F D G / (pi (n.o)(n.i)) in each
    channel (Bagher2012).

    D = normalization e^-x / (x^p pi cos^4 h) with x = alpha + tan^2 h / alpha
    G = G1(o) G1(i) with G1 = 1 + Lambda (1 - exp(t^k)), t = (theta - theta0) / reach; G1 = 1 for theta < theta0
    F = f0 + (1 - f0) (1 - cos)^5 - f1 cos, with cos = o.h

    h is the angle between the half vector and n. The angle `reach` replaces the parameter c = reach^-k of the paper,
    which exceeds 1e100 in the published fits. D integrates to 1 if normalization = 1 / (alpha Gamma(1 - p, alpha)).
    Because all values are fitted, F can exceed 1 and, for f1 > f0, be negative; as published, G1 and the lobe can be
    negative at the horizon. The model is reciprocal. Half vectors are sampled for the smallest or the largest alpha of
    the channels, from a power law and an exponential that together approximate D to within a factor of e.

    The presets are the fits of Bagher2012 to the materials in the MERL database.
    """

    specular: Colour = spectrum(default=0.3, doc="scale factor for the lobe", low=0.0)
    alpha: Colour = spectrum(default=0.05, doc="width of the distribution, as a scale of tan^2 h", low=1e-5)
    p: Colour = spectrum(default=0.5, doc="exponent of x in D, which shapes the peak", low=0.0, high=3.0)
    f0: Colour = spectrum(default=0.05, doc="F at normal incidence, before f1 is subtracted")
    f1: Colour = spectrum(default=0.0, doc="coefficient of the cosine that is subtracted from F")
    normalization: Colour = spectrum(default=17.5, doc="scale factor for D (K in the paper)", low=0.0)
    Lambda: Colour = spectrum(default=3.0, doc="strength of the masking", low=0.0)
    reach: Colour = spectrum(default=1.64, doc="angle beyond theta0 at which masking is strong", low=0.05, unit="rad")
    k: Colour = spectrum(default=30.0, doc="steepness of the masking", low=1.0)
    theta0: Colour = spectrum(default=0.0, doc="angle at which masking begins", unit="rad")

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": sum_breach("F and G are fitted factors without bounds, and "),
        "positivity": KnownViolation(
            "F is negative where f1 cos exceeds Schlick's curve, and G1 may be negative at the horizon",
            1.0,
            certain=False,
        ),
    }

    @function
    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """f0 + (1 - f0) (1 - cos)^5 - f1 cos (Bagher2012, eq. 13)."""
        return schlick(cos_theta, self.f0) - self.f1 * cos_theta

    @function
    def _shadowing(self, v: Direction) -> Spectrum:
        """G1 = 1 + Lambda (1 - exp(t^k)) (Bagher2012, eq. 11)."""
        theta = atan2(sqrt(maximum(frame.sin2(v), 1e-20)), v.z)
        t = maximum(theta - self.theta0, 1e-6) / self.reach
        power = exp(ops.minimum(self.k * log(t), 3.7))  # e^40 fits in float32, and G1 is far below its lower limit
        depth = self.Lambda * power * exprel(power)
        return maximum(1.0 - depth, MIN_COSINE)

    @function
    def _density(self, h: Direction) -> Spectrum:
        """D, the density of facet normals, 1/sr."""
        cos2 = sqr(maximum(h.z, 1e-4))
        x = self.alpha + frame.sin2(h) / (cos2 * self.alpha)
        return self.normalization * exp(-x - self.p * log(x)) * (inv_pi / sqr(cos2))

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular F D G / (pi cos theta_o)."""
        h, cos = facet(wo, wi)
        facets = self._density(h) * self._shadowing(wo) * self._shadowing(wi) * (inv_pi / wo.z)
        return self.specular * self.reflectance(cos) * facets

    @function
    def _widths(self) -> tuple[Scalar, Scalar, Scalar]:
        """The smallest alpha, the largest alpha and the mean p of the channels."""
        return -max_component(-self.alpha), max_component(self.alpha), mean(self.p)

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Mixture of the densities for the smallest and the largest alpha, divided by 4 (o.h)."""
        h, cos = facet(wo, wi)
        narrow, wide, p = self._widths()
        return (_gamma_pdf(h, narrow, p) + _gamma_pdf(h, wide, p)) * 0.125 / cos

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a half vector sampled for the smallest or the largest alpha."""
        narrow, wide, p = self._widths()
        return frame.reflect(wo, _gamma_sample(u.y, u.z, where(u.x < 0.5, narrow, wide), p))

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """4 / pi specular F G, with G for the mirror direction: the albedo of a narrow lobe."""
        return self.specular * self.reflectance(wo.z) * sqr(self._shadowing(wo)) * (4.0 * inv_pi)


@function
def _parts(alpha: Scalar, p: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """s = max(1, alpha), log(s / alpha), and the integral of x^-p from alpha to s divided by alpha^(1 - p).

    The sampling density in x is x^-p up to s and s^-p e^-x beyond, where its integral is s^-p e^-s. D in x is this
    density times a factor between 1 / e and 1.
    """
    s = maximum(alpha, 1.0)
    log_t = log(s / alpha)
    return s, log_t, power_integral(log_t, 1.0 - p)


@function
def _gamma_pdf(h: Direction, alpha: Scalar, p: Scalar) -> Scalar:
    """Density of `_gamma_sample`, 1/sr."""
    s, _, area = _parts(alpha, p)
    below, beyond = exp((1.0 - p) * log(alpha)) * area, exp(-p * log(s) - s)
    cos2 = sqr(maximum(h.z, 1e-4))
    x = alpha + frame.sin2(h) / (cos2 * alpha)
    value = where(x < s, exp(-p * log(x)), exp(-p * log(s) - x))
    # tan^2 = alpha (x - alpha), and dw = cos^3 / 2 d(tan^2) dphi
    return value / ((below + beyond) * alpha * ops.pi * cos2 * sqrt(cos2))


@function
def _gamma_sample(u1: Scalar, u2: Scalar, alpha: Scalar, p: Scalar) -> Direction:
    """A half vector, with x from the power law up to s and from the exponential beyond."""
    s, _, area = _parts(alpha, p)
    q = 1.0 - p
    below, beyond = exp(q * log(alpha)) * area, exp(-p * log(s) - s)
    share = below / (below + beyond)
    inner = u1 < share
    log_t = power_quantile(area * ops.minimum(u1 / maximum(share, 1e-6), 1.0), q)
    outer = ops.clamp((1.0 - u1) / maximum(1.0 - share, 1e-6), 1e-7, 1.0)
    past = where(inner, alpha * log_t * exprel(log_t), s - alpha - log(outer))  # x - alpha
    tan2 = alpha * past
    cos = ops.rsqrt(1.0 + tan2)
    sin = sqrt(tan2) * cos
    sn, cs = sincos((2.0 * ops.pi) * u2)
    return vec3(sin * cs, sin * sn, cos)
