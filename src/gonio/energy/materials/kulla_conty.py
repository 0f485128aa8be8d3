"""A microfacet material that keeps what it receives (Kulla2017)."""

from __future__ import annotations

from typing import Any

from ... import ops
from ...models.base import BSDF, Sample, bsdf, choice
from ...ops import safe_div, vec3, where
from .. import fresnel_average, missing

COLORS = {
    "sheet": "F_avg E_avg / (1 - F_avg (1 - E_avg)), the homework's and the talk's",
    "bounce": "F_avg^2 E_avg / (1 - F_avg (1 - E_avg)): light that is reflected twice or more, and no other",
}


class KullaConty(BSDF):
    """f_base + f_add f_ms: the light that single scattering forgets, given back as a broad lobe (Kulla2017).

    With E(mu) the albedo of the base at F = 1, E_avg = 2 int E mu dmu and F_avg likewise:
    f_ms = (1 - E(mu_o)) (1 - E(mu_i)) / (pi (1 - E_avg)), whose albedo is 1 - E(mu_o), and f_add by `color`. At F = 1
    nothing is lost. E comes from short polynomials met to 1e-4 (`gonio.energy.curves`). Reciprocal. As alpha -> 0 the
    term vanishes, (1 - E)^2 faster than 1 - E_avg.

    A transmitting base (rough glass) gets a reflected and a transmitted lobe on each side, of 1 - E with E the power
    reflected and transmitted; the shares are those that reciprocity asks for (Kulla2017, p. 30).

    The base is a Conductor or a Dielectric. Of masking schlick-direct, G does not tend to 1 as alpha -> 0
    (E_avg = .835 at roughness .05): compensation then lays a false bright rim on smooth surfaces.
    """

    base: BSDF = bsdf("the material to be compensated: a conductor or a dielectric")
    color: str = choice("bounce", "colour of the light that is given back", COLORS)
    average: str = choice("exact", "how F_avg is found", fresnel_average.KINDS)

    def __post_init__(self) -> None:
        super().__post_init__()
        missing.check_base(self.base, "KullaConty.base", transmitting=True)

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def delta(self) -> str:
        return self.base.delta

    def tint(self, wo: Any) -> Any:
        """The base's."""
        return self.base.tint(wo)

    def derive(self) -> Any:
        """What does not depend on directions."""
        return missing.rule(self.base).derive(self)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """The base, plus f_add f_ms |cos theta_i|."""
        added = missing.rule(self.base).added(self, self.derived(), wo, wi, mode)
        return self.base.eval(wo, wi, mode) + added

    def pdf(self, wo: Any, wi: Any) -> Any:
        """The base's density and that of a lobe proportional to (1 - E(mu_i)) mu_i, mixed by the energy each carries."""
        rule, found = missing.rule(self.base), self.derived()
        share = rule.share(self, found, wo)
        return self.base.pdf(wo, wi) * (1.0 - share) + rule.pdf(self, found, wo, wi) * share

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """u1 picks the base or the lobe, and is stretched to serve again."""
        rule, found = missing.rule(self.base), self.derived()
        share = rule.share(self, found, wo)
        broad = u.x < share
        again = where(broad, safe_div(u.x, share), safe_div(u.x - share, 1.0 - share))
        u = vec3(ops.minimum(again, ALMOST_ONE), u.y, u.z)
        s = self.base.sample(wo, u, mode)
        wi = where(broad, rule.sample(self, found, wo, u), s.wi)
        delta = s.delta & ~broad
        valid = broad | (s.pdf > 0.0)
        density = self.pdf(wo, wi)
        pdf = where(valid, where(delta, s.pdf * (1.0 - share), density), 0.0)
        value = self.eval(wo, wi, mode) * where(valid & ~delta, safe_div(1.0, pdf), 0.0)
        eta = where(broad, rule.eta(self, wo, wi), s.eta)
        # where the base is smooth nothing is missing: share = 0
        return Sample(wi, where(delta, s.weight * safe_div(1.0, 1.0 - share), value), pdf, delta, eta)


ALMOST_ONE = 0.99999994  # the largest float32 under 1
