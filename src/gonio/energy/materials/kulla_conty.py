"""A material that keeps what it receives (Kulla2017)."""

from __future__ import annotations

from typing import ClassVar

from ...models.base import Breach, choice
from ...models.conductor import Conductor
from ...models.dielectric import Dielectric
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
    nothing is lost. Reciprocal. As alpha -> 0 the term vanishes, (1 - E)^2 faster than 1 - E_avg.

    Of a conductor or a dielectric E is a short polynomial met to 1e-4 (`gonio.energy.curves`), taken at any alpha, by
    textures and gradients too. A dielectric that transmits gets a reflected and a transmitted lobe on each side, of
    1 - E with E the power reflected and transmitted; the shares are those that reciprocity asks for (Kulla2017, p. 30).

    Any other base that only reflects, by a finite isotropic lobe, is measured once (`gonio.energy.measured`): E is its
    albedo with F = 1 and every declared share 1, F_avg the ratio of its own to that. Lambert misses nothing; Oren-Nayar
    the interreflections; a material without a declared share (Phong) whatever its brightest channel does not return.
    What a base gains stays its own. Its values must not vary over the surface, and it has no shader code.

    Of masking schlick-direct, G does not tend to 1 as alpha -> 0 (E_avg = .835 at roughness .05): compensation then
    lays a false bright rim on smooth surfaces.
    """

    breaks: ClassVar[dict[str, Breach]] = {
        "gradients": Breach(
            "a measured base is drawn from anew for each value, and samples that change lobes shift E by 1e-4",
            lambda model: 2.0 if model.measured else 0.0,
            certain=False,
        ),
        "energy": Breach(
            "tables of rough glass, and of two widths, are met to so much (benchmarks/energy.py)",
            lambda model: 0.007 if model.base.transmits else 0.008 if model.turned else 0.0,
            certain=False,
        ),
    }
    color: str = choice(default="bounce", doc="colour of the light that is given back", choices=COLORS)
    average: str = choice(
        default="exact", doc="how F_avg of a conductor or dielectric is found", choices=fresnel_average.KINDS
    )
    _takes_any = True

    @property
    def measured(self) -> bool:
        """Whether the base is one whose energy is measured, once for all rays."""
        return not isinstance(self.base, Conductor | Dielectric)

    @property
    def lossless(self) -> float:  # type: ignore[override]
        """What a white furnace may miss: the error of polynomials or of the measurement, see docs/energy.md."""
        if self.base.transmits:
            return 0.015  # near eta = 1.02; 4e-3 from 1.1 on, 2e-3 from 1.3 on
        return 0.01 if self.turned else 1e-3
