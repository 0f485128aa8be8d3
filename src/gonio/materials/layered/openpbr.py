"""OpenPBR, the surface of the Academy Software Foundation, as a composition of what this package has."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ... import ops
from ...errors import GonioWarning, InputError
from ...material import BSDF, Breach, Colour, Number, Sample, binding, choice, flag, method, number, spectrum
from ...material.bsdf import Delta, Interior
from ...ops import (
    Direction,
    Mask,
    Mode,
    Node,
    Pair,
    Scalar,
    Spectrum,
    abs,
    backend,
    clamp,
    function,
    inv_pi,
    log,
    maximum,
    minimum,
    safe_sqrt,
    sqr,
    sqrt,
    vec2,
    vec3,
    where,
)
from ...optics import frame, fresnel, masking
from ...optics.fresnel import exact, film
from ...optics.fresnel.f82 import GRAZING, f82
from ...optics.fresnel.schlick import schlick
from ...optics.ndf import distribution
from ...optics.roughness import SMOOTH
from ..diffuse.eon import Eon
from ..historic.glossy import facet
from ..microfacet.dielectric import Dielectric
from ..microfacet.microfacet import upper
from ..sheen.sheen import Sheen
from . import _openpbr_derived as derived
from . import _openpbr_layers as layers
from . import _openpbr_sampling as sampling
from . import _openpbr_tables as tables
from ._openpbr_derived import Between
from ._openpbr_formulas import covered, direction_at, lobe_value, mix, modulated, power, rough_along, total_of
from ._openpbr_layers import Sides

NARROWEST = 1e-3  # of two widths
NEAREST = 1.001  # index of refraction over the outside's: below it no facet can be told that refracts
MOST_RAYS = 1 << 18  # for which what is derived is kept, a hundred numbers each: it halves what is compiled
LAYERINGS = {
    "reciprocal": "a layer dims what lies under it at both ends, so that light may be turned round",
    "albedo": "by one minus its albedo seen from wo, as the specification's reduction to lobes",
}


class OpenPBR(BSDF):
    """OpenPBR 1.1 (OpenPBR2025): a base of metal, glass or a glossy diffuse body under a thin film, a coat and fuzz.

    f = opacity {F f_fuzz + (1 - F E_fuzz) [C f_coat + (1 - C + C T W D) f_base]} + the light that goes straight on
    f_base = M f_metal + (1 - M) {f_glossy + (1 - E_o) (1 - E_i) / (1 - E_avg) f_diffuse}, where opaque

    with the weights F, C, M of fuzz, coat and metal, E the albedo of a rough dielectric, T what the coat's colour
    leaves on both ways, D the darkening by light that bounces under it. W is what the coat's surface lets through: by
    `layering`, (1 - E_coat(wo)), as the specification reduces layers to lobes, or a product of one factor for each
    direction that keeps all light of a white base (docs/openpbr.md). f_diffuse is `eon`, f_fuzz `sheen`, metals are
    F82 with what they scatter twice, glass refracts as `dielectric` and keeps what it scatters twice.

    The parameters are the specification's. Below a roughness of .01 base and coat are mirrors. Indices run from 1 to 5.
    Subsurface scattering is local: with `geometry_thin_walled` as specified, else a diffuse lobe of its colour, the
    limit of radius 0, with a warning. Scattering inside, dispersion and emission are errors, as they are no matter of
    a surface. transmission_depth > 0 gives absorption inside, which Gonio's integrators follow.
    """

    name: ClassVar[str] = "openpbr"
    reads_wavelengths: ClassVar[bool] = True
    _masking: ClassVar[str] = "smith-correlated"

    base_weight: Number = number(default=1.0, doc="factor on the base's colour", low=0.0, high=1.0)
    base_color: Colour = spectrum(default=0.8, doc="diffuse colour; of metal, seen from above", low=0.0, high=1.0)
    base_diffuse_roughness: Number = number(
        default=0.0, doc="of the diffuse lobe, as `eon`", low=0.0, high=1.0, off=0.0
    )
    base_metalness: Number = number(default=0.0, doc="share of the surface that is metal", low=0.0, high=1.0, off=0.0)
    specular_weight: Number = number(default=1.0, doc="factor on F0 by the index, and on metal", low=0.0, high=4.0)
    specular_color: Colour = spectrum(
        default=1.0, doc="tint of what is reflected outside; of metal, at the edge", low=0.0, high=1.0
    )
    specular_roughness: Number = number(default=0.3, doc="root of alpha", low=0.0, high=1.0)
    specular_roughness_anisotropy: Number = number(
        default=0.0, doc="0 is round, 1 drawn out along x", low=0.0, high=1.0, off=0.0
    )
    specular_ior: Number = number(default=1.5, doc="index of the base", low=1.0, high=5.0)
    transmission_weight: Number = number(
        default=0.0, doc="share of the dielectric that light passes through", low=0.0, high=1.0, off=0.0
    )
    transmission_color: Colour = spectrum(
        default=1.0, doc="what is left of white light after `transmission_depth`; at depth 0 a tint", low=0.0, high=1.0
    )
    transmission_depth: Number = number(default=0.0, doc="0 tints at the surface", low=0.0, high=1e6)
    transmission_scatter: Colour = spectrum(
        default=0.0, doc="scattering inside, which no surface has: 0, or an error", low=0.0, inside=True
    )
    transmission_scatter_anisotropy: Number = number(
        default=0.0, doc="of that scattering", low=-1.0, high=1.0, inside=True
    )
    transmission_dispersion_scale: Number = number(
        default=0.0, doc="0, or an error: `dielectric` has substances that disperse", low=0.0, high=1.0, inside=True
    )
    transmission_dispersion_abbe_number: Number = number(default=20.0, doc="of that dispersion", low=0.0, inside=True)
    subsurface_weight: Number = number(
        default=0.0, doc="share of the opaque dielectric that scatters under its surface", low=0.0, high=1.0, off=0.0
    )
    subsurface_color: Colour = spectrum(default=0.8, doc="its colour", low=0.0, high=1.0)
    subsurface_radius: Number = number(
        default=1.0, doc="mean free path; taken for 0, with a warning", low=0.0, inside=True
    )
    subsurface_radius_scale: Colour = spectrum(
        default=(1.0, 0.5, 0.25), doc="factor on it, by colour", low=0.0, inside=True
    )
    subsurface_scatter_anisotropy: Number = number(
        default=0.0, doc="of a thin wall: 1 sends all light on, -1 all back", low=-1.0, high=1.0
    )
    coat_weight: Number = number(default=0.0, doc="share of the surface under the coat", low=0.0, high=1.0, off=0.0)
    coat_color: Colour = spectrum(
        default=1.0, doc="what the coat leaves of light that crosses it twice, straight", low=0.0, high=1.0
    )
    coat_roughness: Number = number(default=0.0, doc="root of alpha", low=0.0, high=1.0)
    coat_roughness_anisotropy: Number = number(
        default=0.0, doc="0 is round, 1 drawn out along x", low=0.0, high=1.0, off=0.0
    )
    coat_ior: Number = number(default=1.6, doc="index of the coat", low=1.0, high=5.0)
    coat_darkening: Number = number(
        default=1.0, doc="how much light that bounces under the coat darkens the base", low=0.0, high=1.0
    )
    fuzz_weight: Number = number(default=0.0, doc="share of the surface under fuzz", low=0.0, high=1.0, off=0.0)
    fuzz_color: Colour = spectrum(default=1.0, doc="factor on what the fuzz scatters", low=0.0, high=1.0)
    fuzz_roughness: Number = number(default=0.5, doc="0 is fibres along the normal, 1 dust", low=0.0, high=1.0)
    thin_film_weight: Number = number(
        default=0.0, doc="share of the base under a thin film", low=0.0, high=1.0, off=0.0
    )
    thin_film_thickness: Number = number(default=0.5, doc="of the film", low=0.0, high=3.0, unit="um")
    thin_film_ior: Number = number(default=1.4, doc="index of the film", low=1.0, high=3.0)
    emission_luminance: Number = number(
        default=0.0, doc="0, or an error: a shape's emitter shines", low=0.0, unit="nit", inside=True
    )
    emission_color: Colour = spectrum(default=1.0, doc="of that emission", low=0.0, inside=True)
    geometry_opacity: Number = number(
        default=1.0,
        doc="share of the surface that is there; light goes straight on elsewhere",
        low=0.0,
        high=1.0,
        off=1.0,
    )
    geometry_thin_walled: bool = flag(default=False, doc="whether it is a sheet without an inside")
    layering: str = choice("reciprocal", "how a coat dims what lies under it", LAYERINGS)

    breaks: ClassVar[Mapping[str, Breach]] = {
        "reciprocity": Breach(
            "fuzz is a table of the viewer's direction alone, and so is a coat where layering is albedo",
            lambda model: 4.0 if model._has("fuzz_weight") or model._by_albedo() else 0.0,
            certain=False,
        ),
        "energy": Breach(
            "tables of what layers let through are interpolated, and are of one width, which stands for two",
            lambda model: 0.15 if model._drawn_out else 0.01,
            certain=False,
        ),
        "linearity": Breach(
            "colours of layers multiply, and light that bounces takes them more than once", 10.0, certain=False
        ),
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self._has
        if given("emission_luminance"):
            hint = "give the shape an emitter in the scene"
            raise InputError("a surface that shines: emission_luminance 0 expected", "OpenPBR.emission_luminance", hint)
        bulk = given("transmission_weight") and not self.geometry_thin_walled
        if bulk and given("transmission_scatter") and given("transmission_depth"):
            hint = "transmission_scatter 0 leaves absorption, which paths follow; or subsurface_weight for a dense body"
            raise InputError("light scattered inside is no matter of a surface", "OpenPBR.transmission_scatter", hint)
        if bulk and given("transmission_dispersion_scale"):
            hint = 'Dielectric(eta="bk7") in a spectral render'
            raise InputError("dispersion is not followed", "OpenPBR.transmission_dispersion_scale", hint)
        if given("subsurface_weight") and given("subsurface_radius") and not self.geometry_thin_walled:
            text = (
                "subsurface_radius is taken for 0: light leaves where it enters, as a diffuse lobe of subsurface_color"
            )
            warnings.warn(f"OpenPBR: {text}", GonioWarning, stacklevel=3)

    def _has(self, name: str) -> bool:
        """Whether a weight may be other than 0, known before anything runs: then its part of the code is there. In a
        recording all parts are, as their weights are yet to come."""
        value = getattr(self.plain, name)
        if isinstance(getattr(self, name), Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) != 0.0))

    def _by_albedo(self) -> bool:
        return self.layering == "albedo" and self._has("coat_weight")

    @property
    def _two_widths(self) -> bool:
        """Whether the base has, or may have, two widths; never for what is only recorded."""
        return self._is_drawn_out("specular_roughness_anisotropy")

    @property
    def _drawn_out(self) -> bool:
        return self._two_widths or (self._has("coat_weight") and self._is_drawn_out("coat_roughness_anisotropy"))

    def _is_drawn_out(self, name: str) -> bool:
        value = getattr(self.plain, name)
        return backend.is_drjit(value) or bool(np.any(np.asarray(value, float) != 0.0))

    def _has_holes(self) -> bool:
        value = self.plain.geometry_opacity
        if isinstance(self.geometry_opacity, Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) != 1.0))

    def _may_be_smooth(self, name: str) -> bool:
        """Whether a roughness may be so small that its lobe is a mirror's."""
        value = getattr(self.plain, name)
        if isinstance(getattr(self, name), Node) or backend.is_drjit(value):
            return True
        return bool(np.any(np.asarray(value, float) ** 2 < SMOOTH))

    @property
    def _refracts(self) -> bool:
        """Whether light goes on into a body."""
        return not self.geometry_thin_walled and self._has("transmission_weight")

    @property
    def _two_faced(self) -> bool:
        """Whether there is anything to see from below."""
        return self.geometry_thin_walled or self._refracts

    # ------------------------------------------------------------------ what follows from the parameters

    @function
    def _widths(self, roughness: Scalar, anisotropy: Scalar) -> Pair:
        """alpha along x and y, whose squares add up to twice roughness^4, held at 1, where the tables end."""
        low = 1.0 - anisotropy
        along = sqr(roughness) * sqrt(2.0 / (1.0 + sqr(low)))
        # of a lobe that is no mirror neither width: a thread of 1e-4 is narrower than samples resolve
        across = maximum(along * low, minimum(along, NARROWEST))
        return vec2(clamp(along, SMOOTH, 1.0), clamp(across, SMOOTH, 1.0))

    def _smooth(self, alpha: Pair, name: str) -> Mask | None:
        """Where facets of these widths are a mirror; None where they are nowhere."""
        return (alpha.x <= SMOOTH) & (alpha.y <= SMOOTH) if self._may_be_smooth(name) else None

    @function
    def _roughened(self) -> Scalar:
        """Roughness of the base, whose facets are seen through a rough coat."""
        own, over = sqr(sqr(self.specular_roughness)), sqr(sqr(self.coat_roughness))
        under = sqrt(sqrt(clamp(own + 2.0 * over, 1e-12, 1.0)))
        return mix(self.specular_roughness, under, self.coat_weight)

    @function
    def _indices(self) -> tuple[Scalar, Scalar, Scalar]:
        """(index by which the base reflects, by which it refracts, index of what lies above it).

        The coat bends light before it meets the base, so that a coat of the higher index reflects nothing totally: as
        specified, the ratio is turned round then.
        """
        base, coat = self.specular_ior, self.coat_ior
        ratio = base / coat
        met = mix(base, maximum(ratio, 1.0 / ratio), self.coat_weight)
        below = mix(base, ratio, self.coat_weight)
        medium = base / below
        eta = maximum(medium * modulated(below, self.specular_weight), NEAREST)
        return modulated(met, self.specular_weight), eta, medium

    def derive(self) -> Between:
        """Widths and indices, means over the hemisphere, and what facets scatter twice."""
        return derived.derive(self)

    def _settled(self) -> Self:
        """A copy that holds what is derived, where that differs from ray to ray: it is asked for in many places."""
        if self._derived is not None:
            return self
        derived = binding.settled(self, MOST_RAYS) if self.wavelengths is None else None
        return binding.with_derived(self, self.derive() if derived is None else derived)

    def prepare(self) -> None:
        """Find the tables, before a loop is recorded."""
        tables.prepare(self._masking)

    # ------------------------------------------------------------------ reflectances

    def _film(self, cos: Scalar, eta: Spectrum, k: Spectrum | None, medium: Scalar) -> Spectrum:
        """R of the film over a base of index eta + i k, both over the medium's, under a cosine outside."""
        inner = safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(medium))
        thickness = 1000.0 * self.thin_film_thickness
        one = film.Film(eta, k, self.thin_film_ior / medium, thickness, "belcour-barla", self.wavelengths)
        return film.reflectance(inner, one)

    @function
    def _clear_film(self, cos: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """R of the film over the dielectric."""
        white = ops.ones_like(self.base_color)
        # one value for all channels, so that compilers do the work for one
        alike = ops.of_channels(white, [eta / medium] * len(ops.channels(white)))
        return self._film(cos, alike, None, medium)

    def _glossy(self, cos: Scalar, ratio: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """F of the dielectric from outside, without its tint."""
        bare = ops.ones_like(self.base_color) * exact.dielectric(cos, fresnel.cos_transmitted(cos, ratio), ratio)
        if not self._has("thin_film_weight"):
            return bare
        return mix(bare, self._clear_film(cos, eta, medium), self.thin_film_weight)

    @function
    def _bare_metal(self, cos: Scalar) -> Spectrum:
        """F82 by its colours."""
        r0 = self.base_color * self.base_weight
        return f82(cos, r0, self.specular_color * schlick(GRAZING, r0)) * minimum(self.specular_weight, 1.0)

    @function
    def _metal(self, cos: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """F of the metal; under a film of the index that Gulbrandsen2014 finds for them."""
        bare = self._bare_metal(cos)
        if not self._has("thin_film_weight"):
            return bare
        r0 = self.base_color * self.base_weight
        r = clamp(r0, 1e-4, 0.999)
        least, root = (1.0 - r) / (1.0 + r), sqrt(r)
        n = self.specular_color * least + (1.0 - self.specular_color) * ((1.0 + root) / (1.0 - root))
        k = safe_sqrt((r * sqr(n + 1.0) - sqr(n - 1.0)) / (1.0 - r))
        filmed = self._film(cos, n, k, medium) * minimum(self.specular_weight, 1.0)
        return mix(bare, filmed, self.thin_film_weight)

    def _sheet(self, cos: Scalar, f: Spectrum, eta: Scalar) -> tuple[Spectrum, Spectrum]:
        """What a thin sheet whose faces reflect f sends back and lets through, all bounces between them together."""
        inner = safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(eta))
        t = power(self.transmission_color, 1.0 / maximum(inner, 0.05))
        rest = sqr(1.0 - f) * t / maximum(1.0 - sqr(f * t), 1e-6)
        return f + rest * f * t, rest

    def _let_in(self, w: Direction) -> Spectrum:
        """1 - E of the base's dielectric surface; of two widths that of the one that stands for them along w."""
        b = self.derived
        rough = b.rough
        if self._two_widths:
            rough = rough_along(w, b.alpha, b.ratio)
        return self._kept_below(w.z, rough, b.ratio, b.filmed)

    def _kept_below(self, cos: Scalar, rough: Scalar, ratio: Scalar, filmed: tuple[Spectrum, ...]) -> Spectrum:
        """The same by what follows from the parameters."""
        E = tables.reflected(cos, rough, ratio, self._masking) + ops.zeros_like(self.base_color)
        return 1.0 - covered(E, filmed, tables.faced(cos, rough, self._masking) if filmed else ())

    @property
    def _bends(self) -> bool:
        return self.layering == "reciprocal" and self._has("base_diffuse_roughness")

    # ------------------------------------------------------------------ layers

    # ------------------------------------------------------------------ lobes

    def _fuzz(self) -> Sheen:
        return binding.bound_copy(Sheen(), {"albedo": self.fuzz_color, "roughness": self.fuzz_roughness})

    def _interface(self) -> Dielectric:
        """The geometry of refraction at the base's facets; how much goes that way is said elsewhere."""
        b, zero = self.derived, ops.zeros_like(self.base_color)
        kind = Dielectric(alpha=(0.1, 0.2) if self._two_widths else 0.1, masking=self._masking)
        clear = {"rotation": None, "albedo": 1.0 + zero, "absorption": zero, "priority": ops.zeros_like(b.eta)}
        return binding.bound_copy(kind, {"eta": b.eta, "alpha": b.alpha, **clear})

    def _pair(self, wo: Direction, wi: Direction) -> Sides:
        """Both turned up; a thin wall looks alike from both sides."""
        near = wo.z * wi.z > 0.0
        above = wo.z > 0.0
        valid = (wo.z != 0.0) & (wi.z != 0.0)
        if self.geometry_thin_walled:
            above = wo.z != 0.0
            wi = where(wo.z < 0.0, -wi, wi)
            wi = where(near, wi, vec3(wi.x, wi.y, -wi.z))
        elif not self._two_faced:
            valid = near = near & above
        o, i = upper(wo), where(wi.z < 0.0, -wi, wi)
        return Sides(where(valid, o, frame.upright(o)), where(valid, i, frame.upright(i)), near & valid, above)

    def _diffuse(self, pair: Sides, let_in: tuple[Spectrum, Spectrum]) -> tuple[Spectrum, Spectrum]:
        """What the body under the dielectric reflects and, of a thin wall, lets through, times cos theta_i."""
        b = self.derived
        white = ops.ones_like(self.base_color)
        values = {"roughness": self.base_diffuse_roughness}
        base = (
            binding.bound_copy(Eon(), {**values, "albedo": self.base_color}).eval(pair.wo, pair.wi) * self.base_weight
        )
        dimmed = let_in[0] * let_in[1] / b.sheer
        dimmed = dimmed * ((1.0 - self.base_metalness) * (1.0 - self.transmission_weight))
        if self._bends:
            dimmed = dimmed * (layers.even(self, pair.wo, False) * layers.even(self, pair.wi, False))
        if not self._has("subsurface_weight"):
            return base * dimmed, ops.zeros_like(white)
        S = self.subsurface_weight
        if not self.geometry_thin_walled:
            below = binding.bound_copy(Eon(), {**values, "albedo": self.subsurface_color}).eval(pair.wo, pair.wi)
            return mix(base, below, S) * dimmed, ops.zeros_like(white)
        even = binding.bound_copy(Eon(), {**values, "albedo": white}).eval(pair.wo, pair.wi)
        half, g = even * self.subsurface_color * (0.5 * S), self.subsurface_scatter_anisotropy
        return (base * (1.0 - S) + half * (1.0 - g)) * dimmed, half * (1.0 + g) * dimmed

    def _returned(self, wo: Direction, wi: Direction) -> Scalar:
        """What facets that lose nothing scatter more than once, times cos theta_i."""
        lost = self.derived.metal
        return lost.at(wo) * lost.at(wi) * lost.over_average(wi) * wi.z

    def _twice(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """What facets of glass scatter more than once, to both sides, times |cos theta_i|."""
        lost, other = self.derived.glass, self.derived.other
        assert lost is not None, "derived where light is transmitted"
        cos = abs(wi.z) * lost.radiance(wo, wi, mode)
        if other is None:
            bare = lost.at(wo) * lost.at(wi) * lost.over_average(wi) * lost.share(wo, wi)
            return ops.ones_like(self.base_color) * (bare * cos)
        into = where(wo.z > 0.0, other.into, other.out)
        share = where(wo.z * wi.z > 0.0, 1.0 - into, into)
        level = where(wi.z > 0.0, other.thin, other.dense)
        return self._missed(wo) * self._missed(wi) * share * (cos * inv_pi) / level

    def _missed(self, w: Direction) -> Spectrum:
        """What glass misses at a direction, from its own side."""
        b = self.derived
        assert b.glass is not None and b.other is not None, "derived where light is transmitted"
        shares = tables.spared(abs(w.z), b.rough, b.eta, self._masking)
        count = len(b.other.less)
        more = [
            one * where(w.z > 0.0, thin, dense)
            for one, thin, dense in zip(b.other.less, shares[:count], shares[count:], strict=True)
        ]
        return maximum(b.glass.at(w) + total_of(more), 0.0)

    # ------------------------------------------------------------------ values

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of all lobes times |cos theta_i|; mirrors and the light that goes straight on are delta lobes."""
        value = self._settled()._surface(wo, wi, mode)
        return value * self.geometry_opacity if self._has_holes() else value

    def _surface(self, wo: Direction, wi: Direction, mode: Mode, ideal: Mask | None = None) -> Spectrum:
        """Where the surface is there.

        ideal  rays whose two directions smooth facets join: there the value is what those send on
        """
        b = self.derived
        pair = self._pair(wo, wi)
        o, i = pair.wo, pair.wi
        M, T = self.base_metalness, self.transmission_weight
        zero = ops.zeros_like(self.base_color) * o.z
        h, cos = facet(o, i)
        smooth = self._smooth(b.alpha, "specular_roughness")
        facets = lobe_value(self._facets(o, i, h, b.alpha), smooth, ideal)
        again = lobe_value(self._returned(o, i), None, ideal)
        through = zero
        if self._refracts:
            glossy, dielectric, through = self._glass(wo, wi, pair, cos, mode, facets, smooth, ideal)
        else:
            glossy = self._glossy(cos, b.ratio, b.eta, b.medium)
            dielectric = glossy * self.specular_color * facets
        if self.geometry_thin_walled and self._has("transmission_weight"):
            assert b.sheet_again is not None, "derived where walls are thin"
            back, on = self._sheet(cos, glossy, b.eta)
            sheet = (back * facets + b.sheet_again[0] * again) * self.specular_color
            dielectric = mix(dielectric, sheet, T)
            through = (on * facets + b.sheet_again[1] * again) * ((1.0 - M) * T)
        base = dielectric * (1.0 - M)
        if self._has("base_metalness"):
            metal = self._metal(cos, b.eta, b.medium) * facets + b.metal_again * again
            base = base + metal * M
        let_in = self._let_in(pair.wo), self._let_in(pair.wi)
        body, passed = (lobe_value(one, None, ideal) for one in self._diffuse(pair, let_in))
        if self._has("coat_weight"):
            by_facets, by_body = layers.through_coat(self, pair, let_in)
            coat = self._coat(o, i, h, cos, ideal) * self.coat_weight
            base = base * by_facets + where(pair.above, coat, 0.0)
            body, passed = body * by_body, passed * by_body
            if self.geometry_thin_walled:
                through = through * by_facets
        total = base + body
        if self.geometry_thin_walled:
            through = through + passed
        if self._has("fuzz_weight"):
            fuzz = self._fuzz()
            left = 1.0 - self.fuzz_weight * fuzz._lobe(o).R
            over = lobe_value(fuzz.eval(o, i), None, ideal) * self.fuzz_weight
            total = where(pair.above, total * left + over, total)
            if self.geometry_thin_walled:
                through = through * left
        if not self._two_faced:
            return where(pair.near, total, 0.0)
        return where(pair.near, total, where((wo.z != 0.0) & (wi.z != 0.0), through, 0.0))

    def _facets(self, o: Direction, i: Direction, h: Direction, alpha: Pair) -> Scalar:
        """D G / (4 cos theta_o), which is the lobe of facets at F = 1, times cos theta_i."""
        ndf = distribution("ggx")
        g = masking.masking_shadowing(self._masking, ndf, o, i, h, alpha)
        return ndf.D(h, alpha) * g / (4.0 * o.z)

    def _coat(self, o: Direction, i: Direction, h: Direction, cos: Scalar, ideal: Mask | None) -> Scalar:
        """The coat's own lobe, times cos theta_i."""
        alpha = self.derived.coat_alpha
        f = exact.dielectric(cos, fresnel.cos_transmitted(cos, self.coat_ior), self.coat_ior)
        return f * lobe_value(self._facets(o, i, h, alpha), self._smooth(alpha, "coat_roughness"), ideal)

    def _glass(
        self,
        wo: Direction,
        wi: Direction,
        pair: Sides,
        cos: Scalar,
        mode: Mode,
        facets: Scalar,
        smooth: Mask | None,
        ideal: Mask | None,
    ) -> tuple[Spectrum, Spectrum, Spectrum]:
        """(F, what glass reflects, what it lets through) of a pair of directions, from either side."""
        b, glass, T = self.derived, self._interface(), self.transmission_weight
        white, above = ops.ones_like(self.base_color), wo.z > 0.0
        eta = glass._relative_eta(wo)
        at = glass._facet(wo, wi, eta)
        # F is a matter of the cosine outside, wherever light comes from
        cos_t = fresnel.cos_transmitted(cos, 1.0 / b.eta)
        joined, outside = where(above, abs(at.dot_o), abs(at.dot_i)), where(above, pair.wo, pair.wi)
        crosses = joined if ideal is None else where(ideal, outside.z, joined)
        outer = where(pair.near, where(above, cos, maximum(cos_t, 1e-4)), crosses)
        f = self._glossy(outer, b.ratio, b.eta, b.medium)
        # from inside, what coat and fuzz would send back comes back with what the base reflects
        inner = where(cos_t > 0.0, f, white)
        inner = 1.0 - (1.0 - inner) * layers.past_layers(self, direction_at(maximum(cos_t, 1e-4)))
        twice = lobe_value(self._twice(wo, wi, mode), None, ideal)
        # what is no glass looks from below as from above
        opaque = self._glossy(cos, b.ratio, b.eta, b.medium)
        mirrored = where(above, f * self.specular_color, mix(opaque, inner, T))
        tint = where(above, self.specular_color, white)
        reflected = mirrored * facets + tint * (twice * T)
        spread = lobe_value(where(at.reflects, 0.0, glass._value(at)), smooth, ideal, 1.0 / sqr(eta))
        spread = spread * sqr(eta) if mode == "importance" else spread
        colour = where(self.transmission_depth > 0.0, white, self.transmission_color)
        left = layers.past_layers(self, outside) * colour
        through = ((1.0 - f) * spread + twice) * left * ((1.0 - self.base_metalness) * T)
        return f, reflected, through

    # ------------------------------------------------------------------ sampling

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the lobes' densities."""
        model = self._settled()
        density = sampling.density_of(model, sampling.shares_at(model, wo), wo, wi)
        return density * self.geometry_opacity if self._has_holes() else density

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u1 picks the lobe."""
        return sampling.drawn(self._settled(), wo, u, mode)

    # ------------------------------------------------------------------ facts

    @property
    def transmits(self) -> bool:
        return self._two_faced or self._has_holes()

    @property
    def delta(self) -> Delta:
        mirror = self._may_be_smooth("specular_roughness")
        mirror = mirror or (self._has("coat_weight") and self._may_be_smooth("coat_roughness"))
        return "maybe" if mirror or self._has_holes() else "never"

    @property
    def isotropic(self) -> bool:
        plain = self.plain
        if isinstance(self.specular_roughness_anisotropy, Node):  # a recording's may take any value
            return False
        widths = plain.specular_roughness_anisotropy, plain.coat_roughness_anisotropy
        return all(isinstance(one, int | float) and one == 0 for one in widths)

    @property
    def interior(self) -> Interior | None:
        if self.geometry_thin_walled or not self.plain._has("transmission_weight"):
            return None
        if not self.is_bound:
            types = backend.types("float64")
            return self.bind(types).interior
        some = self.transmission_depth > 0.0
        colour = maximum(self.transmission_color, 1e-6)
        loss = where(some, -log(colour) / where(some, self.transmission_depth, 1.0), 0.0)
        return Interior(self._indices()[1], loss, ops.zeros_like(self.transmission_depth))

    def tint(self, wo: Direction) -> Spectrum:
        """The base's colours under a cosine."""
        b = self.derived
        cos = abs(wo.z)
        f = self._glossy(cos, b.ratio, b.eta, b.medium)
        body = mix(self.base_color * self.base_weight, self.subsurface_color, self.subsurface_weight)
        body = mix(body, self.transmission_color, self.transmission_weight)
        dielectric = f * self.specular_color + (1.0 - f) * body
        return mix(dielectric, self._metal(cos, b.eta, b.medium), self.base_metalness)


# --------------------------------------------------------------------------- small formulas
