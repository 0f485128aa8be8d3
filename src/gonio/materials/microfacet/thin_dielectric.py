"""A thin sheet of glass."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, Delta, InnerAlbedo, Preset
from ...material.calling import method
from ...material.parameters import Colour, Member, Number, choice, number
from ...material.polarization import Polarized
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, abs, function, ones_like, sqr, where, zeros_like
from ...optics import frame, fresnel, indices
from ...optics.fresnel import exact
from ...optics.fresnel.polarization import Diattenuation, reflected_by_glass
from . import microfacet

BOUNCES = {
    "polarized": "bounces are summed separately for s and p polarization, which a smooth sheet does not mix",
    "mean": "bounces are summed for the mean of s and p, as in most renderers; outgoing light is unpolarized",
}


class _Sheet(NamedTuple):
    """Reflection and transmission by a sheet, all bounces included.

    s, p    reflectances of the two polarizations
    cross   product of the two reflected amplitudes
    passed  product of the two transmitted amplitudes
    """

    s: Scalar
    p: Scalar
    cross: Scalar
    passed: Scalar


class ThinDielectric(BSDF):
    """A thin sheet of clear glass, such as a window pane. Light that is not reflected passes straight through (PBRT4,
    sec. 9.5).

    If one face has the reflectance R and the transmittance T = 1 - R, the reflectance of the sheet, including all
    bounces between its faces, is R' = R + T^2 R + T^2 R^3 + ... = 2 R / (1 + R), and its transmittance is T' = 1 - R'.
    The sheet is assumed to be thicker than the coherence length of the light, but too thin to displace it visibly. By
    default, R' is the mean of its values for the two polarizations, which is 0.152 at 60 degrees for an index of 1.5.
    With `bounces="mean"`, R' is computed from the mean of R instead, as in renderers without polarization, which gives
    0.164.
    """

    eta: Number = number(default=1.5, doc="refractive index of the sheet, relative to the outside", low=0.2, high=5.0)
    fresnel: Member = microfacet.fresnel_choice()
    bounces: str = choice("polarized", "how the bounces inside the sheet are summed", BOUNCES)
    albedo: Colour = microfacet.albedo_factor("scale factor for all reflected and transmitted light")

    preset_kind: ClassVar[str] = "medium"

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """Transparent media by name, with eta for sodium light, because a sheet does not disperse light."""
        return {name: Preset(m.title, {"eta": m.sodium}, m.source) for name, m in indices.media().items()}

    @function
    def reflectance(self, cos: Scalar) -> Scalar:
        """R' at a cosine of incidence, from either side."""
        cos_t = fresnel.cos_transmitted(cos, self.eta)
        if self.fresnel == "exact" and self.bounces == "polarized":
            sheet = self._sheet(cos, cos_t)
            return where(cos_t > 0.0, 0.5 * (sheet.s + sheet.p), 1.0)
        return _all_bounces(fresnel.kind(self.fresnel).dielectric(cos, cos_t, self.eta))

    def _sheet(self, cos: Scalar, cos_t: Scalar) -> _Sheet:
        """The sum of all bounces; powers are added, because waves of different bounces are incoherent."""
        minus_r_s, r_p = exact.amplitudes(cos, cos_t, self.eta)
        s, p, once = sqr(minus_r_s), sqr(r_p), -minus_r_s * r_p
        through = (1.0 - s) * (1.0 - p)  # both faces
        rest = through / (1.0 - sqr(once) + 1e-12)
        return _Sheet(_all_bounces(s), _all_bounces(p), once * (1.0 + rest), rest)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """0: delta lobes have no finite value."""
        return self.albedo * zeros_like(wo.z)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """0: delta lobes have no density."""
        return zeros_like(wo.z)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects reflection with probability R'; otherwise the direction is -wo."""
        share = self.reflectance(abs(wo.z))
        reflects = u.x < share
        one = ones_like(wo.z)
        pdf = where(reflects, share, 1.0 - share)
        mirrored = frame.mirror(wo)
        return Sample(where(reflects, mirrored, -wo), self.albedo * one, pdf, pdf > 0.0, one)

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """All light; none for `bounces="mean"`, because polarization is then lost between the bounces."""
        if self.bounces == "mean":
            return ()
        cos = abs(wo.z)
        cos_t = fresnel.cos_transmitted(cos, self.eta)
        sheet, total = self._sheet(cos, cos_t), reflected_by_glass(cos, self.eta)
        reflects, crosses = wo.z * wi.z > 0.0, cos_t > 0.0
        s, p = where(reflects, sheet.s, 1.0 - sheet.s), where(reflects, sheet.p, 1.0 - sheet.p)
        over = 1.0 / (s + p + 1e-12)
        d, c = (s - p) * over, 2.0 * where(reflects, sheet.cross, sheet.passed) * over
        zero = zeros_like(cos)
        matrix = Diattenuation(where(crosses, d, zero), where(crosses, c, total.c), where(crosses, zero, total.s))
        share = self.reflectance(cos)
        value = self.albedo * where(delta, where(reflects, share, 1.0 - share), 0.0)
        return (Polarized(value, frame.normal_like(wo), matrix),)

    @property
    def transmits(self) -> bool:
        return True

    @property
    def delta(self) -> Delta:
        return "always"

    def normal_reflectance(self) -> Spectrum:
        """R' at normal incidence, times the albedo."""
        return self.albedo * self.reflectance(ones_like(self.eta))

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64]:
        """`albedo`, because no other light is lost."""
        return np.array(np.broadcast_to(np.asarray(self.albedo, float), (len(mu), 3)))


def _all_bounces(face: Scalar) -> Scalar:
    """2 R / (1 + R): the reflectance of the two faces together."""
    return 2.0 * face / (1.0 + face)
