"""A mixture of two materials."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, Delta, InnerAlbedo, Limit
from ...material.calling import method
from ...material.parameters import Number, bsdf, number
from ...material.polarization import Polarized
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, safe_div, vec3, where


class Mix(BSDF):
    """(1 - weight) a + weight b: the weighted average of two materials, as in an unresolved patchwork of the two."""

    a: BSDF = bsdf("the material at weight 0")
    b: BSDF = bsdf("the material at weight 1")
    weight: Number = number(default=0.5, doc="weight of b", low=0.0, high=1.0)

    limits: ClassVar[tuple[Limit, ...]] = (
        Limit({"weight": 0.0}, equals=lambda one: one.a),
        Limit({"weight": 1.0}, equals=lambda one: one.b),
    )

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """(1 - weight) a + weight b."""
        return self.a.eval(wo, wi, mode) * (1.0 - self.weight) + self.b.eval(wo, wi, mode) * self.weight

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The weighted average of the two densities."""
        return self.a.pdf(wo, wi) * (1.0 - self.weight) + self.b.pdf(wo, wi) * self.weight

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects a material and is then rescaled. The pdf is that of the mixture, except for samples of a delta
        lobe."""
        w = self.weight
        pick_b = u.x < w
        u_remapped = where(pick_b, safe_div(u.x, w), safe_div(u.x - w, 1.0 - w))
        u = vec3(where(u_remapped < ALMOST_ONE, u_remapped, ALMOST_ONE), u.y, u.z)
        sa, sb = self.a.sample(wo, u, mode), self.b.sample(wo, u, mode)
        wi = where(pick_b, sb.wi, sa.wi)
        delta = where(pick_b, sb.delta, sa.delta)
        chosen_pdf = where(pick_b, sb.pdf * w, sa.pdf * (1.0 - w))
        valid = chosen_pdf > 0.0
        # the mixing weight cancels in a delta lobe's weight: w f / (w p)
        pdf = where(valid, where(delta, chosen_pdf, self.pdf(wo, wi)), 0.0)
        density_weight = self.eval(wo, wi, mode) * where(valid & ~delta, safe_div(1.0, pdf), 0.0)
        delta_weight = where(pick_b, sb.weight, sa.weight)
        return Sample(wi, where(delta, delta_weight, density_weight), pdf, delta, where(pick_b, sb.eta, sa.eta))

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The polarized parts of the two materials, multiplied by their weights."""
        a, b = self.a.polarized(wo, wi, delta, mode), self.b.polarized(wo, wi, delta, mode)
        return (*(part.times(1.0 - self.weight) for part in a), *(part.times(self.weight) for part in b))

    def tint(self, wo: Direction) -> Spectrum:
        """The weighted average of the two tints."""
        return self.a.tint(wo) * (1.0 - self.weight) + self.b.tint(wo) * self.weight

    @property
    def transmits(self) -> bool:
        return self.a.transmits or self.b.transmits

    @property
    def delta(self) -> Delta:
        return self.a.delta if self.a.delta == self.b.delta else "maybe"

    @property
    def two_sided(self) -> bool:
        return self.a.two_sided or self.b.two_sided

    @property
    def ambient(self) -> Spectrum | None:
        """The weighted average of the two ambient reflectances."""
        a, b = self.a.ambient, self.b.ambient
        if a is None:
            return None if b is None else b * self.weight
        return a * (1.0 - self.weight) if b is None else a * (1.0 - self.weight) + b * self.weight

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The weighted average of the two albedos."""
        a, b = inner(self.a, mu, phi), inner(self.b, mu, phi)
        weight = float(self.weight)  # type: ignore[arg-type]
        return None if a is None or b is None else a * (1.0 - weight) + b * weight


ALMOST_ONE = 0.99999994  # the largest float32 below 1
