"""Energy-conserving compensation by a broad lobe (Kulla2017)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ...energy.compensation.lobe import MissingEnergy
from ...energy.compensation.missing import missing_energy
from ...material import KnownViolation, choice, method
from ...ops import Direction, Mode, Scalar, Spectrum, abs, backend, function
from ...optics.fresnel.artist import AVERAGES
from ._compensated import GAIN_OF_TWO_WIDTHS, _Compensated, lobe_ratio

COLORS = {
    "sheet": "F_avg E_avg / (1 - F_avg (1 - E_avg)), as in Homework 4 of GAMES202 and in Kulla2017",
    "bounce": "F_avg^2 E_avg / (1 - F_avg (1 - E_avg)), which represents only light that is reflected twice or more",
}


class Derived(NamedTuple):
    """Values that do not depend on directions.

    missing  1 - E and 1 - E_avg of the base at F = 1
    f_add    color of the compensation
    ratio    mean of this color divided by that of single scattering, for sampling
    """

    missing: MissingEnergy
    f_add: Spectrum
    ratio: Scalar


@function
def f_add(lost: MissingEnergy, color: str) -> Spectrum:
    """The color f_add = F_avg E_avg / (1 - F_avg (1 - E_avg)) (Kulla2017), or F_avg times this value.

    lost   the energy lost by the base, with F_avg
    color  "sheet" for the formula above, "bounce" for F_avg times its value
    """
    F_avg, E_avg = lost.F_avg, 1.0 - lost.average
    sheet = F_avg * E_avg / (1.0 - F_avg * (1.0 - E_avg))
    return (sheet * F_avg if color == "bounce" else sheet) * lost.factor


class KullaConty(_Compensated):
    """f = f_base + f_add f_ms: a broad lobe restores the light that single-scattering models lose (Kulla2017).

    E(mu) is the albedo of the base at F = 1 for mu = cos theta, with E_avg = 2 int E mu dmu and F_avg = 2 int F mu dmu.
    The lobe f_ms = (1 - E(mu_o)) (1 - E(mu_i)) / (pi (1 - E_avg)) has the albedo 1 - E(mu_o), and its color f_add is
    determined by `color`. At F = 1, no light is lost. The model is reciprocal. As alpha -> 0, f_ms vanishes, because
    (1 - E)^2 tends to 0 faster than 1 - E_avg.

    For a conductor or a dielectric, E is a short polynomial that is accurate to 1e-4 for any alpha
    (`compensation.curves`); textures and gradients are supported. For a dielectric that transmits, E includes the
    reflected and the transmitted power. The compensation then consists of a reflected and a transmitted lobe on each
    side, whose albedos sum to 1 - E; their ratio follows from reciprocity (Kulla2017, p. 30).

    Any other base must be a finite isotropic lobe that only reflects; its albedo is computed once
    (`compensation.measured`). E is then the albedo of the lossless variant of the base, in which F and every color
    whose range ends at 1, such as an albedo, are 1, and F_avg is the ratio of the actual mean albedo to E_avg. By this
    definition, Lambert loses no light, and Oren-Nayar loses the interreflected light; a material without such colors,
    for example Phong, loses all light that its brightest channel does not reflect. An energy gain of the base is not
    corrected. The parameters of such a base must not vary over the surface, and no shader code is available.

    With the masking term schlick-direct, G does not tend to 1 as alpha -> 0 (E_avg = 0.835 at roughness 0.05); the
    compensation then adds a spurious bright rim to smooth surfaces.
    """

    color: str = choice(default="bounce", doc="color of the compensation", choices=COLORS)
    average: str = choice(default="exact", doc="how F_avg of a conductor or dielectric is computed", choices=AVERAGES)
    _takes_any = True
    _loss = 1e-3

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """f_base + f_add f_ms, times |cos theta_i|."""
        return self.base.eval(wo, wi, mode) + self.compensation(wo, wi, mode)

    def compensation(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """f_add f_ms |cos theta_i|, f_ms = (1 - E(mu_o)) (1 - E(mu_i)) / (pi (1 - E_avg)) (Kulla2017).

        M is 1 - E, computed without this subtraction, and `over_average` is 1 / (pi (1 - E_avg)). For glass, `share`
        divides the lobe between the two sides (p. 30).
        """
        lost = self.derived.missing
        f_ms = self.M(wo) * self.M(wi) * lost.over_average(wi) * lost.share(wo, wi)
        return self.derived.f_add * (f_ms * lost.radiance(wo, wi, mode) * abs(wi.z))

    def derive(self) -> Derived:
        """The energy lost by single scattering, and the color of the compensation."""
        lost = missing_energy(self.base, self.average)
        color = f_add(lost, self.color)
        return Derived(lost, color, lobe_ratio(color, lost))

    @property
    def needs_uniform(self) -> bool:
        """Whether the base has no tables, so that its albedo is computed once for all rays."""
        return self.base.microsurface is None

    # ------------------------------------------------------------------ measured error bounds

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "gradients": KnownViolation(
            "for a base without tables, the albedo is estimated anew for each parameter value; samples that then "
            "choose another lobe may change E by 1e-4",
            lambda model: 2.0 if model.needs_uniform else 0.0,
            certain=False,
        ),
        "precision": KnownViolation(
            "for a base without tables, the albedo is estimated separately in each precision",
            lambda model: 0.01 if model.needs_uniform else 0.0,
            certain=False,
        ),
        "energy": KnownViolation(
            "tables for rough glass and for anisotropic bases are interpolated; benchmarks/energy.py measures the "
            "error",
            lambda model: _furnace_error(model),
            certain=False,
        ),
    }

    @property
    def lossless_tolerance(self) -> float | None:  # type: ignore[override]
        """The loss allowed in a white furnace: the error of the polynomials or the computed albedo (docs/energy.md)."""
        if self.base.transmits and self.anisotropic:
            return 0.2
        if self.base.transmits:
            return 0.015  # near eta = 1.02; 4e-3 if eta >= 1.1, 2e-3 if eta >= 1.3
        return super().lossless_tolerance


def _furnace_error(model: KullaConty) -> float:
    """The largest error in a white furnace, measured for 21 indices from 0.2 to 5, eight widths and 18 view directions.
    If the indices of the two sides differ by less than 6 %, the lobe is narrower than the steps of the table, which
    increases the error. Anisotropic glass is approximated by isotropic tables (`curves.widths_along`)."""
    if not model.base.transmits:
        return GAIN_OF_TWO_WIDTHS if model.anisotropic else 0.0
    if model.anisotropic:
        return 0.15  # 0.02 for light from outside if one width is at most four times the other
    surface = model.base.microsurface
    near = (
        surface is not None
        and not backend.is_drjit(surface.eta)
        and np.any(np.abs(np.log(np.asarray(surface.eta, float))) < 0.06)
    )
    return 0.02 if near else 0.007
