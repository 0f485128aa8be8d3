"""The ideal mirror."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, Delta, InnerAlbedo
from ...material.calling import method
from ...material.parameters import Colour, spectrum
from ...material.polarization import Polarized
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, ones_like, where, zeros_like
from ...optics import frame
from ...optics.fresnel.polarization import Diattenuation


class Mirror(BSDF):
    """An ideal mirror, whose BRDF is a delta lobe (course notes, part B).

    All light is reflected into the direction theta_o = theta_i, phi_o = phi_i + pi.
    """

    albedo: Colour = spectrum(default=1.0, doc="fraction of light that is reflected", low=0.0, high=1.0, soft_high=True)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """0: a delta lobe has no finite value."""
        return self.albedo * zeros_like(wo.z)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """0: a delta lobe has no density."""
        return zeros_like(wo.z)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """wo mirrored about the normal."""
        above = wo.z > 0.0
        one = where(above, ones_like(wo.z), 0.0)
        return Sample(frame.mirror(wo), self.albedo * one, one, above, ones_like(wo.z))

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """All light: s changes sign and p does not, as at a perfect conductor."""
        zero = zeros_like(wo.z)
        value = self.albedo * where(delta & (wo.z > 0.0), 1.0 + zero, 0.0)
        return (Polarized(value, frame.normal_like(wo), Diattenuation(zero, zero - 1.0, zero)),)

    @property
    def delta(self) -> Delta:
        return "always"

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64]:
        """`albedo` from above, 0 from below."""
        return np.where(mu > 0.0, 1.0, 0.0)[:, None] * np.broadcast_to(np.asarray(self.albedo, float), (len(mu), 3))
