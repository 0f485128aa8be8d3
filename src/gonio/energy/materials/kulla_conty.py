"""A microfacet material that keeps what it receives (Kulla2017)."""

from __future__ import annotations

from ...models.base import choice
from .. import fresnel_average
from ._added import _Added

COLORS = {
    "sheet": "F_avg E_avg / (1 - F_avg (1 - E_avg)), the homework's and the talk's",
    "bounce": "F_avg^2 E_avg / (1 - F_avg (1 - E_avg)): light that is reflected twice or more, and no other",
}


class KullaConty(_Added):
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

    color: str = choice(default="bounce", doc="colour of the light that is given back", choices=COLORS)
    average: str = choice(default="exact", doc="how F_avg is found", choices=fresnel_average.KINDS)

    @property
    def lossless(self) -> float:  # type: ignore[override]
        """What a white furnace may miss: the polynomials' error, see docs/energy.md."""
        if self.base.transmits:
            return 0.015  # near eta = 1.1; 2e-3 from eta 1.33 on
        return 0.01 if self.turned else 1e-3
