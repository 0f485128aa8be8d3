"""Lambert's diffuse reflection."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, InnerAlbedo
from ...material.calling import method
from ...material.parameters import Colour, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, abs, inv_pi, where


class Lambert(BSDF):
    """Ideal diffuse reflection: f = albedo / pi in every direction (course notes, part B).

    The model is reciprocal and conserves energy if albedo <= 1. Directions are sampled with a density proportional to
    the cosine.
    """

    albedo: Colour = spectrum(default=0.5, doc="fraction of light that is reflected", low=0.0, high=1.0, soft_high=True)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """albedo / pi |cos theta_i| above the surface."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        return self.albedo * where(above, abs(wi.z) * inv_pi, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """cos theta_i / pi above the surface."""
        return where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A cosine-weighted direction."""
        return self.sample_cosine(wo, u, mode)

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64]:
        """`albedo` from above, 0 from below."""
        return np.where(mu > 0.0, 1.0, 0.0)[:, None] * np.broadcast_to(np.asarray(self.albedo, float), (len(mu), 3))
