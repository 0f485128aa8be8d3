"""What the historic models share: Lambert's reflection plus a glossy lobe, simply added."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple, Self

import numpy as np

from ... import ops
from ...catalog import library
from ...material.bsdf import BSDF, KnownViolation, Preset
from ...material.calling import method
from ...material.parameters import Colour, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, clamp, dot, function, inv_pi, maximum, mean, sqrt, where
from ...optics.frame import TINY, normal_like
from ...optics.warp import square_to_cosine_hemisphere

# Of all samples at most so many follow the lobe: where it comes out larger than its density says, as at grazing light,
# the cosine keeps the weight bounded.
MAX_LOBE_SHARE = 0.95


class _Glossy(BSDF):
    """f = diffuse / pi + a lobe. A member gives the lobe, its density and sampling, and an estimate of its albedo.

    The lobe is asked of two directions above the surface only: where one is not, for the normal in its place.
    """

    overridable: ClassVar[bool] = True

    diffuse: Colour = spectrum(default=0.2, doc="albedo of Lambert's part", low=0.0, high=1.0, soft_high=True)

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """The published fits of the MERL materials by this model."""
        return library.presets(cls.name)

    @property
    def _lambert(self) -> Spectrum:
        """`diffuse`; in subclasses mypy forgets that an inherited field is a declared parameter."""
        return self.diffuse

    def _lobe(self, wo: Direction, wi: Direction) -> Spectrum:
        """f |cos theta_i| of the lobe alone."""
        raise NotImplementedError

    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of `_lobe_sample`, 1/sr."""
        raise NotImplementedError

    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction of the lobe, on either side of the surface; u.x is spread over [0, 1) again."""
        raise NotImplementedError

    def _lobe_albedo(self, wo: Direction) -> Spectrum:
        """The lobe's albedo, about: it decides how many samples follow it."""
        raise NotImplementedError

    def _focus(self) -> Scalar | float:
        """How much narrower than the cosine the lobe is, 0 to 1: what it does not need, the cosine samples better."""
        return 1.0

    def _diffuse(self, wo: Direction, wi: Direction) -> Spectrum:
        """f |cos theta_i| of the diffuse part."""
        return self._lambert * (wi.z * inv_pi)

    def _most(self) -> float | np.ndarray:
        """What the lobe's albedo stays below at every angle."""
        return math.inf

    @function
    def _share(self, wo: Direction) -> Scalar:
        """Probability of the lobe: its albedo against that of the diffuse part, less where it is as wide as that."""
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
        """Mixture of the cosine and the lobe's density, by their albedos."""
        above, o, i = lit(wo, wi)
        share = self._share(o)
        return where(above, (1.0 - share) * i.z * inv_pi + share * self._lobe_pdf(o, i), 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u1 picks a lobe; a direction below the surface is a failed sample."""
        o = where(wo.z > 0.0, wo, normal_like(wo))
        share = self._share(o)
        pick = u.x < share
        u_remapped = ops.vec3(ops.safe_div(u.x, share), u.y, u.z)
        wi = where(pick, self._lobe_sample(o, u_remapped), square_to_cosine_hemisphere(u.y, u.z))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def lossless(self) -> Self:
        """Itself: the two parts are simply added, so no values of theirs return all light without any loss."""
        return self

    def tint(self, wo: Direction) -> Spectrum:
        """The two albedos."""
        return self._lambert + maximum(self._lobe_albedo(where(wo.z > 0.0, wo, normal_like(wo))), 0.0)


def sum_breach(more: str = "") -> KnownViolation:
    """The breach of energy that adding two lobes is, with what makes the lobe itself gain energy."""
    return KnownViolation(
        f"{more}the two parts are added, and nothing keeps their sum below 1",
        lambda model: max(float(np.max(np.asarray(model.diffuse) + model._most())) - 1.0, 0.0),
        certain=False,  # the bound need not be met
    )


@function
def facet(wo: Direction, wi: Direction) -> tuple[Direction, Scalar]:
    """(half vector h, o.h): the cosine as half the length of o + i, which rounding makes neither 0 nor negative."""
    total = wo + wi
    size = sqrt(maximum(dot(total, total), TINY))
    return total * (1.0 / size), 0.5 * size


class _Lit(NamedTuple):
    above: Mask
    wo: Direction
    wi: Direction


def lit(wo: Direction, wi: Direction) -> _Lit:
    """(whether both are above the surface, both, with the normal in their place where they are not): what is masked
    anyway must not bring an infinity or a root of a negative number into a gradient."""
    above = (wo.z > 0.0) & (wi.z > 0.0)
    return _Lit(above, where(above, wo, normal_like(wo)), where(above, wi, normal_like(wi)))
