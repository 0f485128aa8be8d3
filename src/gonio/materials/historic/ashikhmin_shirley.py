"""Ashikhmin and Shirley's anisotropic Phong model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...material.bsdf import KnownViolation, Limit
from ...material.parameters import Angle, Colour, Width, choice, flag, spectrum, width
from ...ops import Direction, Pair, Scalar, Spectrum, exp, function, inv_pi, log, maximum, safe_sqrt, sincos, sqr, sqrt
from ...optics import frame, fresnel
from ...optics.special import exprel, power_of_cosine
from ..microfacet import microfacet
from .glossy import _Glossy, facet, sum_breach


class AshikhminShirley(_Glossy):
    """An anisotropic Phong model: f = diffuse term + specular F p(h) / (4 (o.h) max((n.o), (n.i))) (Ashikhmin2000).

    p = sqrt((n_x + 1)(n_y + 1)) / (2 pi) (n.h)^((n_x h_x^2 + n_y h_y^2) / (1 - h_z^2)) is the density of the half
    vector h. The exponents n_x and n_y are given by `exponent`. By default, F is Schlick's approximation with
    F0 = ((eta - 1) / (eta + 1))^2, as in the paper. The diffuse term is Lambertian or, if `coupled` is true, that of
    the paper, which excludes the fraction F0 of the light and decreases toward grazing angles. The model is reciprocal.

    The presets, named MATERIAL:PAPER/FIT, are published fits to materials in the MERL database.
    """

    specular: Colour = spectrum(default=1.0, doc="scale factor for the lobe", low=0.0)
    exponent: Width = width(
        default=100.0,
        doc="exponent of the lobe; for anisotropy, exponents along x and y",
        low=0.0,
        high=math.inf,
    )
    rotation: Angle = microfacet.rotation_angle()
    eta: Colour = spectrum(default=1.5, doc="refractive index, relative to the outside", low=1.0)
    fresnel: str = choice("schlick", "Fresnel reflectance", fresnel.Fresnel.family, white="one")
    coupled: bool = flag(
        default=False, doc="whether the diffuse term is that of the paper, which excludes the fraction F0 of the light"
    )

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"specular": 0.0}, mutes=("exponent", "rotation", "eta")),)
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {"energy": sum_breach()}

    def _most(self) -> np.ndarray:
        """`specular`, because the weight of a sample is specular F (n.i) / max((n.o), (n.i))."""
        return np.max(np.asarray(self.specular, float))

    def reflectance(self, cos_theta: Scalar | float) -> Spectrum:
        """F at the cosine of incidence on a facet, by the formula that `fresnel` selects."""
        return fresnel.kind(self.fresnel).conductor(cos_theta, self.eta, ops.zeros_like(self.eta))

    @function
    def _diffuse(self, wo: Direction, wi: Direction) -> Spectrum:
        """diffuse / pi, or 28 diffuse / (23 pi) (1 - Rs) (1 - (1 - (n.o) / 2)^5) (1 - (1 - (n.i) / 2)^5)."""
        if not self.coupled:
            return self._lambert * (wi.z * inv_pi)
        left = 1.0 - self.specular * self.reflectance(ops.ones_like(wo.z))
        return self._lambert * left * ((28.0 / 23.0) * inv_pi * _faded(wo.z) * _faded(wi.z) * wi.z)

    @function
    def _focus(self) -> Scalar:
        """(n / (n + 9))^2, which is 0 for n = 0, where the lobe is flat. The peak density of the lobe is (n + 1) / 8
        times that of the cosine."""
        n = sqrt((self.exponent.x + 1.0) * (self.exponent.y + 1.0))
        return sqr((n - 1.0) / (n + 8.0))

    @function
    def _density(self, h: Direction) -> Scalar:
        """Density p(h) of half vectors, 1/sr."""
        n = self.exponent
        h_local = frame.rotate(h, self.rotation)
        sin2 = frame.sin2(h_local)
        power = (n.x * sqr(h_local.x) + n.y * sqr(h_local.y)) / maximum(sin2, frame.TINY)
        norm = sqrt((n.x + 1.0) * (n.y + 1.0)) * (0.5 * inv_pi)
        return norm * power_of_cosine(h.z, sin2, power)

    @function
    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """specular F p cos theta_i / (4 (o.h) max((n.o), (n.i)))."""
        h, cos = facet(wo, wi)
        spread = self._density(h) * wi.z / (4.0 * cos * maximum(wo.z, wi.z))
        return self.specular * self.reflectance(cos) * spread

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """p(h) / (4 (o.h))."""
        h, cos = facet(wo, wi)
        return self._density(h) / (4.0 * cos)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """wo mirrored about a half vector with density p."""
        return frame.reflect(wo, frame.rotate_back(_half_vector(u.y, u.z, self.exponent), self.rotation))

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """specular F, the albedo of a narrow lobe."""
        return self.specular * self.reflectance(wo.z)


@function
def _faded(cos: Scalar) -> Scalar:
    """1 - (1 - cos / 2)^5, multiplied out, because the difference would lose its digits at grazing angles."""
    x = 0.5 * cos
    return x * (5.0 - x * (10.0 - x * (10.0 - x * (5.0 - x))))


@function
def _half_vector(u1: Scalar, u2: Scalar, exponent: Pair) -> Direction:
    """A half vector with density p. Its azimuth is given by tan phi = sqrt((n_x + 1) / (n_y + 1)) tan(2 pi u2), and its
    polar angle follows the power lobe at that azimuth (Ashikhmin2000, eqs. 9 and 10, for all quadrants at once)."""
    s, c = sincos((2.0 * ops.pi) * u2)
    across = s * sqrt((exponent.x + 1.0) / (exponent.y + 1.0))
    over = ops.rsqrt(sqr(c) + sqr(across))
    c, s = c * over, across * over
    log_cos = log(1.0 - u1) / (exponent.x * sqr(c) + exponent.y * sqr(s) + 1.0)
    sin = safe_sqrt(-2.0 * log_cos * exprel(2.0 * log_cos))
    return ops.vec3(sin * c, sin * s, exp(log_cos))
