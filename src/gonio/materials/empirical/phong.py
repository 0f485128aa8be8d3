"""Phong's empirical model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ... import ops
from ...errors import InputError
from ...material.bsdf import BSDF, KnownViolation, Limit
from ...material.calling import method
from ...material.parameters import Colour, Number, flag, number, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, dot, function, inv_pi, mean, pow, where
from ...optics.frame import mirror
from ...optics.warp import square_to_cosine_hemisphere, square_to_power_lobe, square_to_power_lobe_pdf, to_frame


class _Empirical(BSDF):
    """Base of Phong's and Blinn's models: ambient, diffuse and specular terms, as published (Phong1975).

    `eval` is kd (n.l) + ks (highlight)^p, without the factor 1/pi, a normalization factor, or a cosine in the specular
    term; f = eval / cos theta_i is therefore unbounded at grazing incidence.
    """

    kd: Colour = spectrum(default=0.5, doc="diffuse coefficient", low=0.0)
    ks: Colour = spectrum(default=0.3, doc="specular coefficient", low=0.0)
    p: Number = number(default=32.0, doc="exponent of the highlight", low=0.0)
    ka: Colour = spectrum(default=0.0, doc="ambient coefficient, which multiplies the scene's ambient light", low=0.0)
    check_sum: bool = flag(default=False, doc="whether ka + kd + ks = 1 is required")

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"ks": 0.0}, mutes=("p", "ka")), Limit({"kd": 0.0}, mutes=("ka",)))
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "the specular term of `eval` lacks the factor cos theta_i, so the specular term of f is divided by "
            "cos theta_i",
            lambda model: 1.0 if np.any(np.asarray(model.ks) > 0) else 0.0,
        ),
        "energy": KnownViolation(
            "neither term is normalized; a diffuse term with kd = 1 reflects pi times the incident light",
            lambda model: np.max(np.pi * np.asarray(model.kd) + np.asarray(model.ks) * model._highlight_power()) - 1.0,
        ),
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.check_sum:
            total = np.asarray(self.ka) + np.asarray(self.kd) + np.asarray(self.ks)
            if not np.allclose(total, 1.0, atol=1e-6):
                raise InputError(
                    f"ka + kd + ks = {np.round(total, 6).tolist()}, 1 expected",
                    type(self).__name__,
                    "change a coefficient, or leave check_sum out",
                )

    @property
    def _exponent(self) -> Scalar:
        """p; mypy does not treat an inherited field of a subclass as a declared parameter."""
        return self.p

    def _highlight_power(self) -> np.ndarray:
        """The maximum over all wo of int (highlight)^p dwi."""
        raise NotImplementedError

    def _highlight(self, wo: Direction, wi: Direction) -> Scalar:
        """The base of the power: a cosine that is largest at the center of the highlight."""
        raise NotImplementedError

    def _peak(self, wo: Direction, wi: Direction) -> Scalar:
        """(highlight)^p."""
        return pow(self._highlight(wo, wi), self.p)

    def _highlight_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        raise NotImplementedError

    def _highlight_sample(self, wo: Direction, u1: Scalar, u2: Scalar) -> Direction:
        raise NotImplementedError

    @function
    def _specular_share(self, wo: Direction) -> Scalar:
        """Probability of the specular lobe: its fraction of the total power, ks 2 pi / (p + 1) + kd pi."""
        specular = mean(self.ks) * 2.0 / (self.p + 1.0)
        both = specular + mean(self.kd)
        return ops.safe_div(specular, both)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """kd (n.l) + ks (highlight)^p for light and viewer above the surface (course sheet, eq. 1)."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        return self.kd * where(above, wi.z, 0.0) + self.ks * where(above, self._peak(wo, wi), 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Mixture of the cosine density and the density of the highlight."""
        share = self._specular_share(wo)
        density = (1.0 - share) * wi.z * inv_pi + share * self._highlight_pdf(wo, wi)
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects a lobe; a direction below the surface is a failed sample."""
        diffuse = square_to_cosine_hemisphere(u.y, u.z)
        specular = self._highlight_sample(wo, u.y, u.z)
        wi = where(u.x < self._specular_share(wo), specular, diffuse)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def tint(self, wo: Direction) -> Spectrum:
        """The diffuse color kd."""
        return self.kd

    @property
    def ambient(self) -> Spectrum:
        """The ambient reflectance ka."""
        return self.ka


class Phong(_Empirical):
    """Phong's model: L = ka Ia + kd I (n.l) + ks I (v.r)^p (course sheet, eq. 1; Phong1975).

    Ia and I are the ambient and the direct light, n is the normal, l = wi, v = wo, and r is l mirrored about n. `eval`
    is kd cos theta_i + ks max(0, v.r)^p; the renderer applies the falloff of the light with distance. v.r is clamped to
    0, because an even p would otherwise cause a second highlight on the opposite side. Light from below the surface
    does not contribute. The model is neither reciprocal nor energy-conserving.
    """

    def _highlight_power(self) -> np.ndarray:
        """2 pi / (p + 1), reached at normal incidence."""
        return 2.0 * np.pi / (np.asarray(self.p) + 1.0)

    @function
    def _highlight(self, wo: Direction, wi: Direction) -> Scalar:
        """v.r, the cosine of the angle between the direction to the viewer and the mirrored direction to the light."""
        return dot(wo, mirror(wi))

    @function
    def _highlight_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of a cos^p lobe about the mirrored wo, 1/sr."""
        return square_to_power_lobe_pdf(dot(mirror(wo), wi), self._exponent)

    @function
    def _highlight_sample(self, wo: Direction, u1: Scalar, u2: Scalar) -> Direction:
        """A direction sampled from a cos^p lobe about the mirrored wo."""
        return to_frame(mirror(wo), square_to_power_lobe(u1, u2, self._exponent))
