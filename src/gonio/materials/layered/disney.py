"""Disney's principled BRDF of 2012."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple, Self

from ... import ops
from ...material.bsdf import BSDF, KnownViolation, Limit
from ...material.calling import method
from ...material.parameters import Angle, Colour, Number, number, spectrum
from ...material.sample import Sample
from ...ops import (
    Direction,
    Mode,
    Node,
    Pair,
    Scalar,
    Spectrum,
    clamp,
    function,
    inv_pi,
    log,
    maximum,
    mean,
    sqr,
    sqrt,
    vec2,
    vec3,
    where,
)
from ...optics import frame, masking
from ...optics.frame import lit
from ...optics.ndf import distribution
from ...optics.warp import square_to_cosine_hemisphere
from ..historic.glossy import facet
from ..microfacet import microfacet

SMALLEST = 0.001  # smallest width, as in the code of Burley2012
COAT_WIDTH = 0.25  # alpha of the coat's masking term, for any gloss (Burley2012, sec. 5.6)


class Pieces(NamedTuple):
    """The terms of the model, times cos theta_i.

    diffuse   diffuse lobe with retro-reflection at grazing angles, blended with the subsurface lobe
    specular  GTR2 lobe
    sheen     lobe proportional to Schlick's (1 - cos)^5 at the half vector
    coat      GTR1 lobe
    """

    diffuse: Spectrum
    specular: Spectrum
    sheen: Spectrum
    coat: Spectrum


class Disney(BSDF):
    """Disney's principled BRDF, with eleven parameters from 0 to 1 (Burley2012 and the code published with it).

    f = (1 - metallic) (base / pi mix(f_d, f_ss, subsurface) + f_sheen) + F D G / (4 (n.o)(n.i)) + clearcoat / 4 f_r
    f_d = (1 + (F_D90 - 1) (1 - n.i)^5) (1 + (F_D90 - 1) (1 - n.o)^5),  F_D90 = 1/2 + 2 roughness (i.h)^2

    base is `base_color`, and mix(a, b, x) = (1 - x) a + x b. f_d is the diffuse lobe, f_ss the lobe that approximates
    subsurface scattering, and f_sheen the sheen lobe. D is GTR2 (GGX) with alpha = roughness^2, stretched by
    1 / aspect, where aspect^2 = 1 - 0.9 anisotropic. G is Smith's masking term. F is Schlick's approximation; F0 is
    0.08 specular, with an optional tint, for a dielectric and the base color for a metal. f_r is the clearcoat lobe,
    GTR1 with a width from 0.1 to 0.001 and F0 = 0.04. The tint is the base color divided by the mean of its channels
    (in the paper, by its luminance).

    The lobes are simply added, as artists preferred. At grazing angles, or if several parameters are large, the model
    therefore reflects more light than it receives. Rough metal, on the other hand, loses multiply scattered light. The
    model is reciprocal.
    """

    base_color: Colour = spectrum(default=0.5, doc="color of the surface", low=0.0, high=1.0)
    subsurface: Number = number(
        default=0.0, doc="weight of the flat diffuse lobe that approximates subsurface scattering", low=0.0, high=1.0
    )
    metallic: Number = number(default=0.0, doc="0 for a dielectric, 1 for a metal", low=0.0, high=1.0)
    specular: Number = number(default=0.5, doc="F0 of a dielectric, divided by 0.08", low=0.0, high=1.0)
    specular_tint: Number = number(default=0.0, doc="amount by which the base color tints F0", low=0.0, high=1.0)
    roughness: Number = number(default=0.5, doc="roughness, the square root of alpha", low=0.0, high=1.0)
    anisotropic: Number = number(
        default=0.0, doc="anisotropy, from 0 (isotropic) to 1 (stretched along x)", low=0.0, high=1.0
    )
    rotation: Angle = microfacet.rotation_angle()
    sheen: Number = number(
        default=0.0, doc="strength of an additional lobe at grazing angles, for cloth", low=0.0, high=1.0
    )
    sheen_tint: Number = number(default=0.5, doc="amount by which the base color tints the sheen", low=0.0, high=1.0)
    clearcoat: Number = number(default=0.0, doc="strength of the clearcoat lobe", low=0.0, high=1.0)
    clearcoat_gloss: Number = number(
        default=1.0, doc="gloss of the clearcoat: 0 is satin, 1 is glossy", low=0.0, high=1.0
    )

    fits_factors: ClassVar[bool] = True  # clearcoat_gloss is 1 by default but is not a factor
    limits: ClassVar[tuple[Limit, ...]] = (
        Limit({"sheen": 0.0}, mutes=("sheen_tint",)),
        Limit({"clearcoat": 0.0}, mutes=("clearcoat_gloss",)),
        Limit({"specular": 0.0}, mutes=("specular_tint",)),
        Limit({"metallic": 1.0}, mutes=("subsurface", "specular", "specular_tint", "sheen", "sheen_tint")),
        Limit({"anisotropic": 0.0}, mutes=("rotation",)),
    )
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "the sum of the lobes is unbounded, and rough diffuse reflection gains energy at grazing angles",
            2.5,
            certain=False,
        ),
        "linearity": KnownViolation("tints are ratios of the base color to its mean", 10.0, certain=False),
    }

    @property
    def isotropic(self) -> bool:
        if isinstance(self.anisotropic, Node):  # unknown in a recording
            return False
        return isinstance(self.plain.anisotropic, int | float) and self.plain.anisotropic == 0

    def lossless(self) -> Self:
        """The material itself: no parameter values make the sum of the lobes reflect exactly all light."""
        return self

    @function
    def _widths(self) -> Pair:
        """alpha along x and y."""
        aspect = sqrt(1.0 - 0.9 * self.anisotropic)
        alpha = sqr(self.roughness)
        return vec2(maximum(alpha / aspect, SMALLEST), maximum(alpha * aspect, SMALLEST))

    @function
    def _coat_width(self) -> Scalar:
        """alpha of the clearcoat: 0.1 for satin to 0.001 for gloss."""
        return 0.1 + self.clearcoat_gloss * (0.001 - 0.1)

    @function
    def _tint(self) -> Spectrum:
        """The base color divided by its mean; 1 for black."""
        level = mean(self.base_color)
        some = level > 0.0
        return where(some, self.base_color / where(some, level, 1.0), ops.ones_like(self.base_color))

    @function
    def _normal_reflectance(self) -> Spectrum:
        """F0, the reflectance at normal incidence."""
        tinted = 1.0 + (self._tint() - 1.0) * self.specular_tint
        dielectric = tinted * (0.08 * self.specular)
        return dielectric + (self.base_color - dielectric) * self.metallic

    @function
    def _coat_density(self, h: Direction) -> Scalar:
        """GTR1: (a^2 - 1) / (pi log(a^2) (sin^2 + a^2 cos^2)), 1/sr."""
        a2 = sqr(self._coat_width())
        return (a2 - 1.0) * inv_pi / (log(a2) * (frame.sin2(h) + a2 * sqr(h.z)))

    def _pieces(self, wo: Direction, wi: Direction) -> Pieces:
        """The four terms for two directions above the surface."""
        h, cos = facet(wo, wi)
        at_o, at_i, at_h = _schlick(wo.z), _schlick(wi.z), _schlick(cos)
        rough = self.roughness * sqr(cos)
        edge = 0.5 + 2.0 * rough
        diffuse = _mix(1.0, edge, at_i) * _mix(1.0, edge, at_o)
        even = _mix(1.0, rough, at_i) * _mix(1.0, rough, at_o)
        below = 1.25 * (even * (1.0 / (wo.z + wi.z) - 0.5) + 0.5)
        body = (1.0 - self.metallic) * wi.z
        alpha, ndf = self._widths(), distribution("ggx")
        m, o, i = (frame.rotate(w, self.rotation) for w in (h, wo, wi))
        g = masking.masking_shadowing("smith-separable", ndf, o, i, m, alpha)
        f0 = self._normal_reflectance()
        four = 4.0 * wo.z
        specular = (f0 + (1.0 - f0) * at_h) * (ndf.D(m, alpha) * g / four)
        satin = vec2(COAT_WIDTH + ops.zeros_like(cos), COAT_WIDTH + ops.zeros_like(cos))
        coat_g = masking.masking_shadowing("smith-separable", ndf, wo, wi, h, satin)
        strength = (0.01 + 0.24 * at_h) * self.clearcoat  # a quarter of F
        coat = self._coat_density(h) * coat_g * strength / four
        tint = 1.0 + (self._tint() - 1.0) * self.sheen_tint
        return Pieces(
            self.base_color * (_mix(diffuse, below, self.subsurface) * body * inv_pi),
            specular,
            tint * (at_h * self.sheen * body),
            coat + ops.zeros_like(self.base_color),
        )

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of the terms, above the surface."""
        above, o, i = lit(wo, wi)
        parts = self._pieces(o, i)
        return where(above, parts.diffuse + parts.specular + parts.sheen + parts.coat, 0.0)

    @method
    def terms(self, wo: Direction, wi: Direction) -> Pieces:
        """Diffuse, specular, sheen and coat."""
        above, o, i = lit(wo, wi)
        parts = self._pieces(o, i)
        return Pieces(*(where(above, part, 0.0) for part in parts))

    @function
    def _shares(self, wo: Direction) -> Direction:
        """Probabilities of the specular lobe, the coat and the cosine, proportional to their approximate albedos."""
        at_o = _schlick(wo.z)
        f0 = mean(self._normal_reflectance())
        specular = _mix(f0, 1.0, at_o)
        coat = 0.25 * self.clearcoat * (0.04 + 0.96 * at_o)
        diffuse = (1.0 - self.metallic) * (mean(self.base_color) + 0.2 * self.sheen)
        total = specular + coat + diffuse + 0.05
        return vec3(specular / total, coat / total, (diffuse + 0.05) / total)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of visible normals, the coat's normals and the cosine."""
        above, o, i = lit(wo, wi)
        shares = self._shares(o)
        h, cos = facet(o, i)
        ndf = distribution("ggx")
        visible = ndf.visible_per_cosine(frame.rotate(o, self.rotation), frame.rotate(h, self.rotation), self._widths())
        coat = self._coat_density(h) * h.z / cos
        return where(above, 0.25 * (shares.x * visible + shares.y * coat) + shares.z * i.z * inv_pi, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A sample of the lobe that u.x selects."""
        o = where(wo.z > 0.0, wo, frame.normal_like(wo))
        shares = self._shares(o)
        wo_local = frame.rotate(o, self.rotation)
        m = distribution("ggx").sample_visible(wo_local, u.y, u.z, self._widths())
        specular = frame.rotate_back(frame.reflect(wo_local, m), self.rotation)
        # GTR1: cos^2 = (1 - a^(2 - 2 u)) / (1 - a^2)
        a2 = sqr(self._coat_width())
        sin2 = clamp((ops.exp(log(a2) * (1.0 - u.y)) - a2) / (1.0 - a2), 0.0, 1.0)
        sin, (s, c) = sqrt(sin2), ops.sincos((2.0 * ops.pi) * u.z)
        coat = frame.reflect(o, vec3(sin * c, sin * s, sqrt(1.0 - sin2)))
        on_coat = u.x < shares.x + shares.y
        wi = where(u.x < shares.x, specular, where(on_coat, coat, square_to_cosine_hemisphere(u.y, u.z)))
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def tint(self, wo: Direction) -> Spectrum:
        """The sum of the diffuse color and F0."""
        return self.base_color * (1.0 - self.metallic) + self._normal_reflectance()


@function
def _schlick(cos: Scalar) -> Scalar:
    """(1 - cos)^5."""
    x = clamp(1.0 - cos, 0.0, 1.0)
    x2 = sqr(x)
    return sqr(x2) * x


@function
def _mix(a: Scalar | float, b: Scalar | float, share: Scalar) -> Scalar:
    """Linear interpolation: a at share = 0, b at share = 1."""
    return a + (b - a) * share
