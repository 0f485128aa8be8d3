"""A material whose layer can be left out of its shader, for tests of `off`."""

from __future__ import annotations

import gonio as go
from gonio.ops import exp, inv_pi, log, maximum


class Varnished(go.BSDF):
    """Lambert under a lobe of powers of the normal's cosine."""

    albedo: go.Colour = go.spectrum(0.5, "of the body", high=1.0)
    varnish: go.Number = go.number(0.0, "weight of the lobe", low=0.0, high=1.0, off=0.0)
    power: go.Number = go.number(5.0, "of the lobe", low=1.0, high=9.0)

    def eval(self, wo, wi, mode="radiance"):
        lobe = self.varnish * exp(self.power * log(maximum(wi.z, 1e-3)))
        return (self.albedo * ((1.0 - self.varnish) * inv_pi) + lobe) * maximum(wi.z, 0.0)
