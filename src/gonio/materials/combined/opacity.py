"""A material with holes, through which light passes unchanged."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, Delta, InnerAlbedo, Limit
from ...material.calling import method
from ...material.parameters import Number, bsdf, number
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, backend, minimum, ones_like, safe_div, vec3, where
from .mix import ALMOST_ONE


class Opacity(BSDF):
    """A base material that covers a fraction `opacity` of the surface. The rest consists of holes, through which light
    from either side passes straight and unchanged, as a delta lobe. A texture of zeros and ones represents cutouts such
    as leaves and fences; intermediate values represent fabrics with unresolved holes. A base that only reflects is
    black from below unless it is wrapped in `two-sided`.
    """

    base: BSDF = bsdf("the material between the holes")
    opacity: Number = number(default=0.5, doc="fraction of the surface that the base covers", low=0.0, high=1.0)

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"opacity": 1.0}, equals=lambda one: one.base),)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The base's value times opacity; the holes are a delta lobe."""
        return self.base.eval(wo, wi, mode) * self.opacity

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The base's density times opacity."""
        return self.base.pdf(wo, wi) * self.opacity

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects the base with probability `opacity`, which cancels in the weight, and is then rescaled."""
        covered = u.x < self.opacity
        s = self.base.sample(wo, vec3(minimum(safe_div(u.x, self.opacity), ALMOST_ONE), u.y, u.z), mode)
        through = 1.0 - self.opacity
        weight = where(covered, s.weight, ones_like(through))
        pdf = where(covered, s.pdf * self.opacity, through)
        eta = where(covered, s.eta, ones_like(through))
        return Sample(where(covered, s.wi, -wo), weight, pdf, s.delta | ~covered, eta)

    def tint(self, wo: Direction) -> Spectrum:
        """The base's tint times opacity, plus 1 - opacity for the holes."""
        return self.base.tint(wo) * self.opacity + (1.0 - self.opacity)

    @property
    def transmits(self) -> bool:
        return True

    @property
    def delta(self) -> Delta:
        opacity = self.plain.opacity
        if not backend.is_drjit(opacity) and np.all(np.asarray(opacity, float) == 1.0):
            return self.base.delta
        return "always" if self.base.delta == "always" else "maybe"

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The base's albedo times opacity, plus 1 - opacity for the holes."""
        of_base, opacity = inner(self.base, mu, phi), float(self.opacity)  # type: ignore[arg-type]
        return None if of_base is None else of_base * opacity + (1.0 - opacity)
