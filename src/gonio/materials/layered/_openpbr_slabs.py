"""The parameters of OpenPBR, tests for the presence of its lobes, and the reflectances of its slabs."""

from __future__ import annotations

import warnings
from typing import ClassVar

import numpy as np

from ... import ops
from ...errors import GonioWarning, InputError
from ...material import BSDF, Colour, Number, choice, flag, number, spectrum
from ...material.bsdf import Delta, Interior, Limit
from ...ops import (
    Direction,
    Mask,
    Node,
    Pair,
    Scalar,
    Spectrum,
    abs,
    backend,
    clamp,
    function,
    log,
    maximum,
    minimum,
    safe_sqrt,
    sqr,
    sqrt,
    vec2,
    where,
)
from ...ops.backend import Array
from ...optics import fresnel
from ...optics.fresnel import exact, film
from ...optics.fresnel.f82 import GRAZING, f82
from ...optics.fresnel.schlick import schlick
from ...optics.roughness import SMOOTH
from ._openpbr_formulas import mix, modulated, power

NARROWEST = 1e-3  # lower limit of the smaller of two widths
NEAREST = 1.001  # smallest relative index; closer to 1, the refracting facet cannot be determined
LAYERINGS = {
    "reciprocal": "light from below is attenuated along both directions, which makes the model reciprocal",
    "albedo": "light from below is multiplied by one minus the layer's albedo for wo, as in the specification",
}


class _OpenPBR(BSDF):
    """The parameters of OpenPBR and facts that do not depend on directions. `OpenPBR` adds the lobes."""

    masking: ClassVar[str] = "smith-correlated"

    base_weight: Number = number(default=1.0, doc="scale factor for `base_color`", low=0.0, high=1.0)
    base_color: Colour = spectrum(
        default=0.8, doc="diffuse color; for metal, the color at normal incidence", low=0.0, high=1.0
    )
    base_diffuse_roughness: Number = number(
        default=0.0, doc="roughness of the diffuse lobe, as in `eon`", low=0.0, high=1.0, off=0.0
    )
    base_metalness: Number = number(
        default=0.0, doc="fraction of the surface that is metal", low=0.0, high=1.0, off=0.0
    )
    specular_weight: Number = number(
        default=1.0, doc="scale factor for F0 of the dielectric and for F of metal", low=0.0, high=4.0
    )
    specular_color: Colour = spectrum(
        default=1.0, doc="tint of the reflection from outside; for metal, the tint at the edge", low=0.0, high=1.0
    )
    specular_roughness: Number = number(
        default=0.3, doc="roughness of the base, the square root of alpha", low=0.0, high=1.0
    )
    specular_roughness_anisotropy: Number = number(
        default=0.0, doc="anisotropy, from 0 (isotropic) to 1 (stretched along x)", low=0.0, high=1.0, off=0.0
    )
    specular_ior: Number = number(default=1.5, doc="refractive index of the base", low=1.0, high=5.0)
    transmission_weight: Number = number(
        default=0.0, doc="fraction of the dielectric that transmits light", low=0.0, high=1.0, off=0.0
    )
    transmission_color: Colour = spectrum(
        default=1.0,
        doc="color of white light after the distance `transmission_depth`; if the distance is 0, a tint of the surface",
        low=0.0,
        high=1.0,
    )
    transmission_depth: Number = number(
        default=0.0,
        doc="distance after which white light has `transmission_color`; if it is 0, the surface is tinted",
        low=0.0,
        high=1e6,
    )
    transmission_scatter: Colour = spectrum(
        default=0.0, doc="volume scattering; must be 0, because it is not a property of a surface", low=0.0, inside=True
    )
    transmission_scatter_anisotropy: Number = number(
        default=0.0, doc="anisotropy of the volume scattering", low=-1.0, high=1.0, inside=True
    )
    transmission_dispersion_scale: Number = number(
        default=0.0, doc="strength of dispersion; must be 0 (use `dielectric` instead)", low=0.0, high=1.0, inside=True
    )
    transmission_dispersion_abbe_number: Number = number(
        default=20.0, doc="Abbe number of the dispersion", low=0.0, inside=True
    )
    subsurface_weight: Number = number(
        default=0.0, doc="fraction of the opaque dielectric with subsurface scattering", low=0.0, high=1.0, off=0.0
    )
    subsurface_color: Colour = spectrum(default=0.8, doc="color of the subsurface scattering", low=0.0, high=1.0)
    subsurface_radius: Number = number(
        default=1.0, doc="mean free path; values other than 0 are treated as 0, with a warning", low=0.0, inside=True
    )
    subsurface_radius_scale: Colour = spectrum(
        default=(1.0, 0.5, 0.25), doc="scale factor for `subsurface_radius` for each channel", low=0.0, inside=True
    )
    subsurface_scatter_anisotropy: Number = number(
        default=0.0, doc="for a thin wall: 1 scatters all light forward, -1 all light backward", low=-1.0, high=1.0
    )
    coat_weight: Number = number(default=0.0, doc="fraction of the surface under the coat", low=0.0, high=1.0, off=0.0)
    coat_color: Colour = spectrum(
        default=1.0, doc="transmittance of the coat for two crossings at normal incidence", low=0.0, high=1.0
    )
    coat_roughness: Number = number(
        default=0.0, doc="roughness of the coat, the square root of alpha", low=0.0, high=1.0
    )
    coat_roughness_anisotropy: Number = number(
        default=0.0, doc="anisotropy, from 0 (isotropic) to 1 (stretched along x)", low=0.0, high=1.0, off=0.0
    )
    coat_ior: Number = number(default=1.6, doc="refractive index of the coat", low=1.0, high=5.0)
    coat_darkening: Number = number(
        default=1.0, doc="strength of the darkening by interreflection under the coat", low=0.0, high=1.0
    )
    fuzz_weight: Number = number(default=0.0, doc="fraction of the surface under fuzz", low=0.0, high=1.0, off=0.0)
    fuzz_color: Colour = spectrum(default=1.0, doc="scale factor for light scattered by the fuzz", low=0.0, high=1.0)
    fuzz_roughness: Number = number(
        default=0.5, doc="roughness of the fuzz: 0 for fibers along the normal, 1 for dust", low=0.0, high=1.0
    )
    thin_film_weight: Number = number(
        default=0.0, doc="fraction of the base under a thin film", low=0.0, high=1.0, off=0.0
    )
    thin_film_thickness: Number = number(default=0.5, doc="thickness of the film", low=0.0, high=3.0, unit="um")
    thin_film_ior: Number = number(default=1.4, doc="refractive index of the film", low=1.0, high=3.0)
    emission_luminance: Number = number(
        default=0.0, doc="luminance of the emission; must be 0 (use an emitter)", low=0.0, unit="nit", inside=True
    )
    emission_color: Colour = spectrum(default=1.0, doc="color of the emission", low=0.0, inside=True)
    geometry_opacity: Number = number(
        default=1.0,
        doc="fraction of the surface that is covered; light passes straight through elsewhere",
        low=0.0,
        high=1.0,
        off=1.0,
    )
    geometry_thin_walled: bool = flag(default=False, doc="whether the surface is a thin sheet without an interior")
    layering: str = choice("reciprocal", "how a coat attenuates the layers below", LAYERINGS)

    limits: ClassVar[tuple[Limit, ...]] = (
        Limit({"base_weight": 0.0}, mutes=("base_color",)),
        Limit({"base_metalness": 1.0}, mutes=("base_diffuse_roughness", "transmission_*", "subsurface_*")),
        Limit({"transmission_weight": 0.0}, mutes=("transmission_*",)),
        Limit({"transmission_weight": 1.0}, mutes=("base_diffuse_roughness", "subsurface_*")),
        Limit({"subsurface_weight": 0.0}, mutes=("subsurface_*",)),
        Limit({"coat_weight": 0.0}, mutes=("coat_*",)),
        Limit({"fuzz_weight": 0.0}, mutes=("fuzz_*",)),
        Limit({"thin_film_weight": 0.0}, mutes=("thin_film_*",)),
        Limit({"thin_film_thickness": 0.0}, mutes=("thin_film_*",)),
        Limit({"thin_film_ior": 1.0, "coat_weight": 0.0}, mutes=("thin_film_*",)),  # a coat lies above the film
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.has
        if given("emission_luminance"):
            hint = "give the shape an emitter in the scene"
            raise InputError("emission given, emission_luminance 0 expected", "OpenPBR.emission_luminance", hint)
        bulk = given("transmission_weight") and not self.geometry_thin_walled
        if bulk and given("transmission_scatter") and given("transmission_depth"):
            hint = "set transmission_scatter to 0 to keep only absorption, or use subsurface_weight for a dense body"
            raise InputError("volume scattering is not a property of a surface", "OpenPBR.transmission_scatter", hint)
        if bulk and given("transmission_dispersion_scale"):
            hint = 'use Dielectric(eta="bk7") in a spectral render'
            raise InputError("dispersion is not supported", "OpenPBR.transmission_dispersion_scale", hint)
        if given("subsurface_weight") and given("subsurface_radius") and not self.geometry_thin_walled:
            text = (
                "subsurface_radius is treated as 0: light leaves where it enters, as a diffuse lobe of subsurface_color"
            )
            warnings.warn(f"OpenPBR: {text}", GonioWarning, stacklevel=3)

    def has(self, name: str) -> bool:
        """Whether a weight may differ from 0, as known statically, so that the code of its component is included. A
        recording includes all components, because their weights are unknown."""
        value = getattr(self.plain, name)
        if isinstance(getattr(self, name), Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) != 0.0))

    def by_albedo(self) -> bool:
        return self.layering == "albedo" and self.has("coat_weight")

    @property
    def anisotropic(self) -> bool:
        """Whether the base has, or may have, two widths; False in recordings."""
        return self.may_be_anisotropic("specular_roughness_anisotropy")

    @property
    def any_anisotropic(self) -> bool:
        return self.anisotropic or (self.has("coat_weight") and self.may_be_anisotropic("coat_roughness_anisotropy"))

    def may_be_anisotropic(self, name: str) -> bool:
        value = getattr(self.plain, name)
        return backend.is_drjit(value) or bool(np.any(np.asarray(value, float) != 0.0))

    def has_holes(self) -> bool:
        value = self.plain.geometry_opacity
        if isinstance(self.geometry_opacity, Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) != 1.0))

    def times_opacity(self, value: Array) -> Array:
        """A value times the covered fraction of the surface."""
        return value * self.geometry_opacity if self.has_holes() else value

    def may_be_smooth(self, name: str) -> bool:
        """Whether a roughness may be so small that its lobe is a mirror reflection."""
        value = getattr(self.plain, name)
        if isinstance(getattr(self, name), Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) ** 2 < SMOOTH))

    @property
    def refracts(self) -> bool:
        """Whether light is refracted into a body."""
        return not self.geometry_thin_walled and self.has("transmission_weight")

    @property
    def two_faced(self) -> bool:
        """Whether the surface is visible from below."""
        return self.geometry_thin_walled or self.refracts

    # ------------------------------------------------------------------ values derived from the parameters

    @function
    def widths(self, roughness: Scalar, anisotropy: Scalar) -> Pair:
        """alpha along x and y. Their squares sum to 2 roughness^4; they are limited to 1, where the tables end."""
        low = 1.0 - anisotropy
        along = sqr(roughness) * sqrt(2.0 / (1.0 + sqr(low)))
        # in a rough lobe, neither width may be tiny: a strip of 1e-4 is narrower than samples can resolve
        across = maximum(along * low, minimum(along, NARROWEST))
        return vec2(clamp(along, SMOOTH, 1.0), clamp(across, SMOOTH, 1.0))

    def smooth(self, alpha: Pair, name: str) -> Mask | None:
        """A mask of the rays for which facets of these widths are a mirror; None if there are no such rays.

        name  the parameter from which the widths were computed
        """
        return (alpha.x <= SMOOTH) & (alpha.y <= SMOOTH) if self.may_be_smooth(name) else None

    @function
    def roughened(self) -> Scalar:
        """Roughness of the base as seen through a rough coat."""
        own, over = sqr(sqr(self.specular_roughness)), sqr(sqr(self.coat_roughness))
        under = sqrt(sqrt(clamp(own + 2.0 * over, 1e-12, 1.0)))
        return mix(self.specular_roughness, under, self.coat_weight)

    @function
    def indices(self) -> tuple[Scalar, Scalar, Scalar]:
        """The index for the base's reflection, that for its refraction, and that of the medium above it.

        The coat refracts light before it reaches the base, so a coat with a higher index than the base causes no total
        reflection; as specified, the ratio is then inverted.
        """
        base, coat = self.specular_ior, self.coat_ior
        ratio = base / coat
        reflecting = mix(base, maximum(ratio, 1.0 / ratio), self.coat_weight)
        below = mix(base, ratio, self.coat_weight)
        medium = base / below
        eta = maximum(medium * modulated(below, self.specular_weight), NEAREST)
        return modulated(reflecting, self.specular_weight), eta, medium

    # ------------------------------------------------------------------ reflectances

    def film_change(self, cos: Scalar, eta: Spectrum, k: Spectrum | None, medium: Scalar) -> Spectrum:
        """Change in R due to the film, on a base of index eta + i k relative to the medium, at the cosine `cos`
        outside.

        It is R with the film minus R with a film of thickness 0, both by the same formula. A difference is used because
        the bare base has its own reflectance (for a metal, the F82 curve), which the formula does not reproduce, and
        because the formula's three harmonics do not sum to Fresnel's equations. With the difference, a film of
        thickness 0, or with the index of the medium, has no effect.
        """
        inner = safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(medium))
        thickness = 1000.0 * self.thin_film_thickness
        index = self.thin_film_ior / medium
        filmed, bare = (
            film.reflectance(inner, film.Film(eta, k, index, one, "belcour-barla", self.wavelengths))
            for one in (thickness, 0.0 * thickness)
        )
        return filmed - bare

    @function
    def clear_film(self, cos: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """Change in the dielectric's R due to the film."""
        white = ops.ones_like(self.base_color)
        # the same value for all channels, so that compilers evaluate it once
        alike = ops.of_channels(white, [eta / medium] * len(ops.channels(white)))
        return self.film_change(cos, alike, None, medium)

    def glossy(self, cos: Scalar, ratio: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """F of the dielectric from outside, without its tint."""
        bare = ops.ones_like(self.base_color) * exact.dielectric(cos, fresnel.cos_transmitted(cos, ratio), ratio)
        if not self.has("thin_film_weight"):
            return bare
        return clamp(bare + self.clear_film(cos, eta, medium) * self.thin_film_weight, 0.0, 1.0)

    @function
    def bare_metal(self, cos: Scalar) -> Spectrum:
        """F of the metal without a film: F82 from its colors."""
        r0 = self.base_color * self.base_weight
        return f82(cos, r0, self.specular_color * schlick(GRAZING, r0)) * minimum(self.specular_weight, 1.0)

    @function
    def metal(self, cos: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """F of the metal; under a film, with the index that Gulbrandsen2014 assigns to its colors."""
        bare = self.bare_metal(cos)
        if not self.has("thin_film_weight"):
            return bare
        r0 = self.base_color * self.base_weight
        r = clamp(r0, 1e-4, 0.999)
        least, root = (1.0 - r) / (1.0 + r), sqrt(r)
        n = self.specular_color * least + (1.0 - self.specular_color) * ((1.0 + root) / (1.0 - root))
        k = safe_sqrt((r * sqr(n + 1.0) - sqr(n - 1.0)) / (1.0 - r))
        added = self.film_change(cos, n, k, medium) * minimum(self.specular_weight, 1.0)
        return clamp(bare + added * self.thin_film_weight, 0.0, 1.0)

    def sheet(self, cos: Scalar, f: Spectrum, eta: Scalar) -> tuple[Spectrum, Spectrum]:
        """Fractions of the light that a thin sheet reflects and transmits, all bounces included.

        f  reflectance of one face
        """
        inner = safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(eta))
        t = power(self.transmission_color, 1.0 / maximum(inner, 0.05))
        rest = sqr(1.0 - f) * t / maximum(1.0 - sqr(f * t), 1e-6)
        return f + rest * f * t, rest

    @property
    def balances_diffuse(self) -> bool:
        return self.layering == "reciprocal" and self.has("base_diffuse_roughness")

    # ------------------------------------------------------------------ facts

    @property
    def transmits(self) -> bool:
        return self.two_faced or self.has_holes()

    @property
    def delta(self) -> Delta:
        mirror = self.may_be_smooth("specular_roughness")
        mirror = mirror or (self.has("coat_weight") and self.may_be_smooth("coat_roughness"))
        return "maybe" if mirror or self.has_holes() else "never"

    @property
    def isotropic(self) -> bool:
        plain = self.plain
        if isinstance(self.specular_roughness_anisotropy, Node):  # unknown in a recording
            return False
        widths = plain.specular_roughness_anisotropy, plain.coat_roughness_anisotropy
        return all(isinstance(one, int | float) and one == 0 for one in widths)

    @property
    def interior(self) -> Interior | None:
        if self.geometry_thin_walled or not self.plain.has("transmission_weight"):
            return None
        if not self.is_bound:
            types = backend.types("float64")
            return self.bind(types).interior
        some = self.transmission_depth > 0.0
        colour = maximum(self.transmission_color, 1e-6)
        loss = where(some, -log(colour) / where(some, self.transmission_depth, 1.0), 0.0)
        return Interior(self.indices()[1], loss, ops.zeros_like(self.transmission_depth))

    def tint(self, wo: Direction) -> Spectrum:
        """The color of the base at the cosine of wo."""
        b = self.derived
        cos = abs(wo.z)
        f = self.glossy(cos, b.ratio, b.eta, b.medium)
        body = mix(self.base_color * self.base_weight, self.subsurface_color, self.subsurface_weight)
        body = mix(body, self.transmission_color, self.transmission_weight)
        dielectric = f * self.specular_color + (1.0 - f) * body
        return mix(dielectric, self.metal(cos, b.eta, b.medium), self.base_metalness)
