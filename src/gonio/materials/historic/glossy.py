"""The base class of the historic models: a Lambertian term plus a glossy lobe."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ... import ops
from ...catalog import library
from ...material.bsdf import BSDF, KnownViolation, Limit, Preset
from ...material.calling import method
from ...material.parameters import Colour, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, clamp, dot, function, inv_pi, maximum, mean, sqrt, where
from ...optics.frame import TINY, lit, normal_like
from ...optics.warp import square_to_cosine_hemisphere
from ..diffuse.lambert import Lambert

# Maximum probability of sampling the lobe. Where the lobe exceeds its sampling density, as at grazing incidence, cosine
# samples keep the weights bounded.
MAX_LOBE_SHARE = 0.95


class _Glossy(BSDF):
    """f = diffuse / pi + a lobe. A subclass defines the lobe, its density and sampling, and an estimate of its albedo.

    The lobe is evaluated only for directions above the surface; a direction below is replaced by the normal.
    """

    overridable: ClassVar[bool] = True

    diffuse: Colour = spectrum(default=0.2, doc="albedo of the Lambertian term", low=0.0, high=1.0, soft_high=True)

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"specular": 0.0}, equals=lambda one: Lambert(one.diffuse)),)

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """The published fits of this model to the MERL materials."""
        return library.presets(cls.name)

    @property
    def _lambert(self) -> Spectrum:
        """`diffuse`; mypy does not treat an inherited field of a subclass as a declared parameter."""
        return self.diffuse

    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """f |cos theta_i| of the lobe."""
        raise NotImplementedError

    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of `_lobe_sample`, 1/sr."""
        raise NotImplementedError

    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction sampled from the lobe, on either side of the surface; u.x has been rescaled to [0, 1)."""
        raise NotImplementedError

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """The approximate albedo of the lobe, which determines the probability of sampling it."""
        raise NotImplementedError

    def _focus(self) -> Scalar | float:
        """How narrow the lobe is compared with the cosine, from 0 to 1; the cosine is a better density for a wide
        lobe."""
        return 1.0

    def _diffuse(self, wo: Direction, wi: Direction) -> Spectrum:
        """f |cos theta_i| of the diffuse term."""
        return self._lambert * (wi.z * inv_pi)

    def _most(self) -> float | np.ndarray:
        """An upper bound of the lobe's albedo over all angles."""
        return math.inf

    @function
    def _share(self, wo: Direction) -> Scalar:
        """Probability of the lobe: its fraction of the total albedo, reduced if it is about as wide as the cosine."""
        lobe = maximum(mean(self._lobe_albedo(wo)), 0.0)
        both = lobe + mean(self._lambert)
        return clamp(self._focus() * ops.safe_div(lobe, both), 0.0, MAX_LOBE_SHARE)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """diffuse / pi cos theta_i + the lobe, above the surface."""
        above, o, i = lit(wo, wi)
        return where(above, self._diffuse(o, i) + self._lobe(o, i), 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Mixture of the cosine density and the density of the lobe, weighted by albedo."""
        above, o, i = lit(wo, wi)
        share = self._share(o)
        return where(above, (1.0 - share) * i.z * inv_pi + share * self._lobe_pdf(o, i), 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects a lobe; a direction below the surface is a failed sample."""
        o = where(wo.z > 0.0, wo, normal_like(wo))
        share = self._share(o)
        pick = u.x < share
        u_remapped = ops.vec3(ops.safe_div(u.x, share), u.y, u.z)
        wi = where(pick, self._lobe_sample(o, u_remapped), square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def lossless(self) -> Self:
        """The material itself: the two terms are simply added, so no parameter values reflect exactly all light."""
        return self

    def tint(self, wo: Direction) -> Spectrum:
        """The sum of the two albedos."""
        return self._lambert + maximum(self._lobe_albedo(where(wo.z > 0.0, wo, normal_like(wo))), 0.0)


def sum_breach(more: str = "") -> KnownViolation:
    """The violation of energy conservation by a sum of two terms.

    more  a reason that concerns the lobe alone, ending in ", and ", placed before the reason that concerns the sum
    """
    return KnownViolation(
        f"{more}the diffuse and specular terms are added, so the total albedo may exceed 1",
        lambda model: max(float(np.max(np.asarray(model.diffuse) + model._most())) - 1.0, 0.0),
        certain=False,  # the bound need not be reached
    )


@function
def facet(wo: Direction, wi: Direction) -> tuple[Direction, Scalar]:
    """The half vector h and the cosine o.h, which is half the length of o + i, so that rounding cannot make it 0 or
    negative."""
    total = wo + wi
    size = sqrt(maximum(dot(total, total), TINY))
    return total * (1.0 / size), 0.5 * size
