"""OpenPBR, the surface of the Academy Software Foundation, as a composition of what this package has."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import ClassVar, NamedTuple, Self

import numpy as np

from ... import ops
from ...errors import GonioWarning, InputError
from ...models import BSDF, Breach, Colour, Number, Sample, binding, choice, flag, method, number, spectrum
from ...models.conductor import Conductor
from ...models.dielectric import Dielectric
from ...models.eon import AVERAGE as MEAN_LOSS
from ...models.eon import GRAZING as GRAZING_LOSS
from ...models.eon import Eon
from ...models.glossy import facet
from ...models.material import Delta, Interior
from ...models.microfacet import SMOOTH, upper
from ...models.mix import ALMOST_ONE
from ...models.sheen import Sheen
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
    mean,
    minimum,
    safe_div,
    safe_sqrt,
    sqr,
    sqrt,
    vec2,
    vec3,
    where,
)
from ...ops.backend import Array
from ...optics import frame, fresnel, masking
from ...optics.fresnel import exact, film
from ...optics.fresnel.f82 import GRAZING, f82
from ...optics.fresnel.schlick import schlick
from ...optics.ndf import distribution
from ...optics.special import gauss
from ...optics.warp import square_to_cosine_hemisphere
from ..compensation.glass import Glass
from ..compensation.lobe import NOTHING, MissingEnergy
from ..compensation.missing import missing_energy
from . import _openpbr_tables as tables
from ._openpbr_tables import FEW_PLACES, FROM_PLACES, HATS, LARGEST, NODES, PLACES

NARROWEST = 1e-3  # of two widths
NEAREST = 1.001  # index of refraction over the outside's: below it no facet can be told that refracts
MOST_RAYS = 1 << 18  # for which what is derived is kept, a hundred numbers each: it halves what is compiled
STEPS = 4  # of the iteration in `_balanced`
WEIGHTS = [2.0 * float(w) * x for x, w in zip(PLACES, gauss(len(PLACES))[1], strict=True)]  # of means with the cosine
LAYERINGS = {
    "reciprocal": "a layer dims what lies under it at both ends, so that light may be turned round",
    "albedo": "by one minus its albedo seen from wo, as the specification's reduction to lobes",
}


class Other(NamedTuple):
    """What facets of glass miss that reflects otherwise than bare glass: under a film, or under a coat, by whose index
    it reflects, while light is bent as by both. Missing are M + sum of less D (`spared`), M that of bare glass.

    less         by how much F differs at `FEW_PLACES`
    thin, dense  the mean of what is missing, from outside and from inside
    into, out    the share of it that passes to the other side (`compensation.glass`)
    """

    less: tuple[Spectrum, ...]
    thin: Spectrum
    dense: Spectrum
    into: Spectrum
    out: Spectrum


class Between(NamedTuple):
    """What follows from the parameters alone.

    alpha        of the base, roughened by the coat, along x and y
    rough        its roughness; the root of alpha with one width
    coat_alpha   of the coat
    ratio        index by which the base reflects, over what lies above it, 1 and more
    eta          index by which it refracts, over the outside's
    medium       index of what lies above the base, over the outside's
    sheer        share of diffuse light that the base's surface lets through: its albedo's complement, averaged
    joint        the same seen through the coat's
    bent         by nodes of the cosine, how far that is off its mean; both of them
    filmed       by how much the film changes F at `PLACES`; empty without one
    extra        the mean of that
    facets       factor of facets under the coat, by nodes of the cosine; empty without one
    returned     what those of a dielectric return less than white ones would, averaged: the body below gets it
    metal        what single scattering misses at F = 1
    metal_again  colour of what a metal gives back
    sheet_again  colours of what a thin sheet gives back, reflected and transmitted
    glass        what it misses of bare glass; None where nothing is transmitted
    other        what it misses more or less, as glass reflects otherwise there; None where it is bare
    """

    alpha: Pair
    rough: Scalar
    coat_alpha: Pair
    ratio: Scalar
    eta: Scalar
    medium: Scalar
    sheer: Spectrum
    joint: Spectrum
    bent: tuple[tuple[Scalar, ...], tuple[Scalar, ...]]
    filmed: tuple[Spectrum, ...]
    extra: Scalar
    facets: tuple[Scalar, ...]
    returned: Scalar
    metal: MissingEnergy
    metal_again: Spectrum
    sheet_again: tuple[Spectrum, Spectrum] | None
    glass: Glass | None
    other: Other | None


class _Pair(NamedTuple):
    """A pair of directions, both turned up.

    wo, wi   above the surface; the normal where a pair is not to be evaluated
    near     whether wi lies on wo's side
    above    whether coat and fuzz lie on that side
    """

    wo: Direction
    wi: Direction
    near: Mask
    above: Mask


class Shares(NamedTuple):
    """Probabilities of the lobes: fuzz, coat, facets that mirror and that refract, cosines on both sides."""

    fuzz: Scalar
    coat: Scalar
    mirrored: Scalar
    refracted: Scalar
    near: Scalar
    far: Scalar


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
    base_diffuse_roughness: Number = number(default=0.0, doc="of the diffuse lobe, as `eon`", low=0.0, high=1.0)
    base_metalness: Number = number(default=0.0, doc="share of the surface that is metal", low=0.0, high=1.0)
    specular_weight: Number = number(default=1.0, doc="factor on F0 by the index, and on metal", low=0.0, high=4.0)
    specular_color: Colour = spectrum(
        default=1.0, doc="tint of what is reflected outside; of metal, at the edge", low=0.0, high=1.0
    )
    specular_roughness: Number = number(default=0.3, doc="root of alpha", low=0.0, high=1.0)
    specular_roughness_anisotropy: Number = number(
        default=0.0, doc="0 is round, 1 drawn out along x", low=0.0, high=1.0
    )
    specular_ior: Number = number(default=1.5, doc="index of the base", low=1.0, high=5.0)
    transmission_weight: Number = number(
        default=0.0, doc="share of the dielectric that light passes through", low=0.0, high=1.0
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
        default=0.0, doc="share of the opaque dielectric that scatters under its surface", low=0.0, high=1.0
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
    coat_weight: Number = number(default=0.0, doc="share of the surface under the coat", low=0.0, high=1.0)
    coat_color: Colour = spectrum(
        default=1.0, doc="what the coat leaves of light that crosses it twice, straight", low=0.0, high=1.0
    )
    coat_roughness: Number = number(default=0.0, doc="root of alpha", low=0.0, high=1.0)
    coat_roughness_anisotropy: Number = number(default=0.0, doc="0 is round, 1 drawn out along x", low=0.0, high=1.0)
    coat_ior: Number = number(default=1.6, doc="index of the coat", low=1.0, high=5.0)
    coat_darkening: Number = number(
        default=1.0, doc="how much light that bounces under the coat darkens the base", low=0.0, high=1.0
    )
    fuzz_weight: Number = number(default=0.0, doc="share of the surface under fuzz", low=0.0, high=1.0)
    fuzz_color: Colour = spectrum(default=1.0, doc="factor on what the fuzz scatters", low=0.0, high=1.0)
    fuzz_roughness: Number = number(default=0.5, doc="0 is fibres along the normal, 1 dust", low=0.0, high=1.0)
    thin_film_weight: Number = number(default=0.0, doc="share of the base under a thin film", low=0.0, high=1.0)
    thin_film_thickness: Number = number(default=0.5, doc="of the film", low=0.0, high=3.0, unit="um")
    thin_film_ior: Number = number(default=1.4, doc="index of the film", low=1.0, high=3.0)
    emission_luminance: Number = number(
        default=0.0, doc="0, or an error: a shape's emitter shines", low=0.0, unit="nit", inside=True
    )
    emission_color: Colour = spectrum(default=1.0, doc="of that emission", low=0.0, inside=True)
    geometry_opacity: Number = number(
        default=1.0, doc="share of the surface that is there; light goes straight on elsewhere", low=0.0, high=1.0
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
        return _mix(self.specular_roughness, under, self.coat_weight)

    @function
    def _indices(self) -> tuple[Scalar, Scalar, Scalar]:
        """(index by which the base reflects, by which it refracts, index of what lies above it).

        The coat bends light before it meets the base, so that a coat of the higher index reflects nothing totally: as
        specified, the ratio is turned round then.
        """
        base, coat = self.specular_ior, self.coat_ior
        ratio = base / coat
        met = _mix(base, maximum(ratio, 1.0 / ratio), self.coat_weight)
        below = _mix(base, ratio, self.coat_weight)
        medium = base / below
        eta = maximum(medium * _modulated(below, self.specular_weight), NEAREST)
        return _modulated(met, self.specular_weight), eta, medium

    def derive(self) -> Between:
        """Widths and indices, means over the hemisphere, and what facets scatter twice."""
        rough = self._roughened()
        alpha = self._widths(rough, self.specular_roughness_anisotropy)
        coat_alpha = self._widths(self.coat_roughness, self.coat_roughness_anisotropy)
        ratio, eta, medium = self._indices()
        zero, white = 0.0 * self.base_color, 1.0 + 0.0 * self.base_color
        two = self._two_widths
        kind = Conductor(alpha=(0.1, 0.2) if two else 0.1, fresnel="one", masking=self._masking)
        values = {"eta": zero, "k": zero, "alpha": alpha, "rotation": None, "albedo": white}
        metal = missing_energy(binding.bound_copy(kind, values))
        bare, filmed, extra = self._at_places(ratio, eta, medium)
        weights = [4.0 * w * x**3 for x, w in zip(NODES, gauss(len(NODES))[1].tolist(), strict=True)]
        under = self._kept_at_nodes(rough, ratio, filmed)
        over = [1.0 - E for E in tables.reflected_at_nodes(self.coat_roughness, self.coat_ior, self._masking)]
        over_hats, over = over[:HATS], over[HATS:]
        facets: tuple[Scalar, ...] = ()
        returned = 0.0 * rough
        if self._has("coat_weight"):
            facets = self._balanced(rough, over_hats)
            returned = self._returned_less(rough, ratio, over_hats, facets)
        total = sum(weights)
        sheer = _sum([one * (w / total) for one, w in zip(under, weights, strict=True)])
        both = [one * other for one, other in zip(under, over, strict=True)]
        joint = _sum([one * (w / total) for one, w in zip(both, weights, strict=True)])
        bent = tuple(
            tuple(mean(one / level - 1.0) * w for one, w in zip(parts, weights, strict=True))
            for parts, level in ((under, sheer), (both, joint))
        )
        f_metal = white
        if self._has("base_metalness"):
            places = FEW_PLACES if filmed else PLACES
            f_metal = _averaged([self._metal(x + 0.0 * rough, eta, medium) for x in places])
        sheet = None
        if self.geometry_thin_walled:
            f = [white * one for one in bare]
            if filmed:
                f = [one + more for one, more in zip(f, filmed, strict=True)]
            both_ways = [self._sheet(x + 0.0 * rough, one, eta) for x, one in zip(PLACES, f, strict=True)]
            sheet = _averaged([back for back, _ in both_ways]), _averaged([on for _, on in both_ways])
        glass, other = None, None
        if self._refracts:
            kind_too = Dielectric(alpha=(0.1, 0.2) if two else 0.1, masking=self._masking)
            clear = {"eta": eta, "alpha": alpha, "rotation": None, "albedo": white, "absorption": zero}
            found = missing_energy(binding.bound_copy(kind_too, {**clear, "priority": 0.0 * eta}))
            assert isinstance(found, Glass), "a dielectric's"
            glass = found
            if filmed or self._has("coat_weight"):
                other = self._misses_otherwise(glass, bare, filmed, rough, eta)
        return Between(
            alpha=alpha,
            rough=rough,
            coat_alpha=coat_alpha,
            ratio=ratio,
            eta=eta,
            medium=medium,
            sheer=sheer,
            joint=(joint + returned) / sheer,
            bent=bent,  # type: ignore[arg-type]
            filmed=filmed,
            extra=extra,
            facets=facets,
            returned=returned,
            metal=metal,
            metal_again=_again(f_metal, metal.average),
            sheet_again=sheet,
            glass=glass,
            other=other,
        )

    def _at_places(
        self, ratio: Scalar, eta: Scalar, medium: Scalar
    ) -> tuple[list[Scalar], tuple[Spectrum, ...], Scalar]:
        """F of the bare dielectric at `PLACES`, what a film adds there, and the mean of that."""
        cosines = [x + 0.0 * ratio for x in PLACES]
        bare = [exact.dielectric(cos, fresnel.cos_transmitted(cos, ratio), ratio) for cos in cosines]
        if not self._has("thin_film_weight"):
            return bare, (), 0.0 * ratio
        filmed = tuple(
            (self._clear_film(cos, eta, medium) - one) * self.thin_film_weight
            for cos, one in zip(cosines, bare, strict=True)
        )
        return bare, filmed, mean(_averaged(list(filmed)))

    def _misses_otherwise(
        self, glass: Glass, bare: list[Scalar], filmed: tuple[Spectrum, ...], rough: Scalar, eta: Scalar
    ) -> Other:
        """What that glass misses more or less than bare glass of index eta."""
        white = 1.0 + 0.0 * self.base_color
        less, reflected = [], white * fresnel.kind("exact").dielectric_average(eta)
        for n, (x, one, weight) in enumerate(zip(PLACES, bare, WEIGHTS, strict=True)):
            cos = x + 0.0 * eta
            known = exact.dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)
            less.append(white * (one - known) + filmed[n] if filmed else white * (one - known))
            reflected = reflected + less[-1] * weight
        few = tuple(_sum([one * share for one, share in zip(less, row, strict=True)]) for row in FROM_PLACES)
        shares = tables.spared_on_average(rough, eta, self._masking)
        count = len(few)
        thin, dense = (
            maximum(_over_pi(side.whole) + _sum([one * d for one, d in zip(few, part, strict=True)]), 2.0 * NOTHING)
            for side, part in ((glass.thin, shares[:count]), (glass.dense, shares[count:]))
        )
        enters = (1.0 - reflected) / (thin + dense)
        return Other(few, thin, dense, enters * dense, enters * thin / sqr(eta))

    def _settled(self) -> Self:
        """A copy that holds what is derived, where that differs from ray to ray: it is asked for in many places."""
        if self._derived is not None:
            return self
        derived = binding.settled(self, MOST_RAYS) if self.wavelengths is None else None
        return binding.with_derived(self, self.derive() if derived is None else derived)

    def prepare(self) -> None:
        """Find the tables, before a loop is recorded."""
        tables.prepare(self._masking)

    def _kept_at_nodes(self, rough: Scalar, ratio: Scalar, filmed: tuple[Spectrum, ...]) -> list[Spectrum]:
        """1 - E of the base's dielectric surface at the roots of cosines `NODES`."""
        found = []
        E_of = tables.reflected_at_nodes(rough, ratio, self._masking)[HATS:]
        faced = tables.faced_at_nodes(rough, self._masking) if filmed else [()] * len(E_of)
        for E, shares in zip(E_of, faced, strict=True):
            found.append(1.0 - _covered(E + 0.0 * self.base_color, filmed, shares))
        return found

    def _balanced(self, rough: Scalar, kept: list[Scalar]) -> tuple[Scalar, ...]:
        """w at nodes of the cosine, with w(o) int w(i) P(o, i) = 1 - E_coat(o), P what white facets scatter.

        A few steps of Sinkhorn's iteration, damped. It starts at the solution for facets that send a share b of their
        light all over and the rest on, w [(1 - b) w + b q] = 1 - E, with a b that grows toward grazing views.

        kept  1 - E_coat at the nodes
        """
        rows, w = tables.scattered_at_nodes(rough, self._masking), []
        q = sqrt(kept[round(0.67 * (HATS - 1))])  # where most light is
        for n, one in enumerate(kept):
            cos = (n / (HATS - 1.0)) ** 2
            b = sqr(rough) / (sqr(rough) + cos + 1e-3)
            w.append(2.0 * one / (b * q + sqrt(sqr(b * q) + 4.0 * (1.0 - b) * one + 1e-12)))
        for _ in range(STEPS):
            met = [_sum([p * one for p, one in zip(row, w, strict=True)]) for row in rows]
            w = [sqrt(one * share / maximum(m, 1e-4)) for one, share, m in zip(w, kept, met, strict=True)]
        return tuple(w)

    def _returned_less(self, rough: Scalar, ratio: Scalar, kept: list[Scalar], facets: tuple[Scalar, ...]) -> Scalar:
        """The mean of E (1 - E_coat - w <w>), see `_spared`."""
        E_of = tables.reflected_at_nodes(rough, ratio, self._masking)[:HATS]
        rows = tables.scattered_at_nodes(rough, self._masking)
        less = []
        for n, (E, one, w, row) in enumerate(zip(E_of, kept, facets, rows, strict=True)):
            cos = (n / (HATS - 1.0)) ** 2 + 0.0 * rough
            less.append(E * (one - w * _seen_by(cos, ratio, row, facets)) * tables.MEANS[n])
        return _sum(less)

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
        white = 1.0 + 0.0 * self.base_color
        # one value for all channels, so that compilers do the work for one
        alike = ops.of_channels(white, [eta / medium] * len(ops.channels(white)))
        return self._film(cos, alike, None, medium)

    def _glossy(self, cos: Scalar, ratio: Scalar, eta: Scalar, medium: Scalar) -> Spectrum:
        """F of the dielectric from outside, without its tint."""
        bare = (1.0 + 0.0 * self.base_color) * exact.dielectric(cos, fresnel.cos_transmitted(cos, ratio), ratio)
        if not self._has("thin_film_weight"):
            return bare
        return _mix(bare, self._clear_film(cos, eta, medium), self.thin_film_weight)

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
        return _mix(bare, filmed, self.thin_film_weight)

    def _sheet(self, cos: Scalar, f: Spectrum, eta: Scalar) -> tuple[Spectrum, Spectrum]:
        """What a thin sheet whose faces reflect f sends back and lets through, all bounces between them together."""
        inner = safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(eta))
        t = _power(self.transmission_color, 1.0 / maximum(inner, 0.05))
        rest = sqr(1.0 - f) * t / maximum(1.0 - sqr(f * t), 1e-6)
        return f + rest * f * t, rest

    def _let_in(self, w: Direction) -> Spectrum:
        """1 - E of the base's dielectric surface; of two widths that of the one that stands for them along w."""
        b = self.derived
        rough = b.rough
        if self._two_widths:
            rough = _rough_along(w, b.alpha, b.ratio)
        return self._kept_below(w.z, rough, b.ratio, b.filmed)

    def _kept_below(self, cos: Scalar, rough: Scalar, ratio: Scalar, filmed: tuple[Spectrum, ...]) -> Spectrum:
        """The same by what follows from the parameters."""
        E = tables.reflected(cos, rough, ratio, self._masking) + 0.0 * self.base_color
        return 1.0 - _covered(E, filmed, tables.faced(cos, rough, self._masking) if filmed else ())

    def _even(self, w: Direction, coated: bool) -> Scalar:
        """Factor of the rough diffuse lobe at a direction, under the base's surface or the coat's too.

        The lobe sends more light to some cosines than Lambert's, and those surfaces let less through there. Its mean
        over azimuth is known: the factor makes a white base whole to second order.
        """
        rough = self.base_diffuse_roughness
        lobe = binding.bound_copy(Eon(energy="fit"), {"albedo": 1.0 + 0.0 * self.base_color, "roughness": rough})
        sin, lost, total = safe_sqrt(1.0 - sqr(w.z)), lobe._lost(w), 0.0 * w.z
        nodes = [x * x for x in NODES]
        for node, off in zip(nodes, self.derived.bent[coated], strict=True):
            slant = sin * (math.sqrt(1.0 - node * node) * inv_pi) * (1.0 / maximum(w.z, node) - 1.0)
            twice = lost * (lobe._lost(_at(node + 0.0 * w.z)) / (GRAZING_LOSS - MEAN_LOSS))
            total = total + off * (slant + twice)
        return 1.0 / (1.0 + lobe._single() * rough * total)

    @property
    def _bends(self) -> bool:
        return self.layering == "reciprocal" and self._has("base_diffuse_roughness")

    def _coat_kept(self, w: Direction) -> Scalar:
        """1 - E of the coat's surface; of two widths as `_let_in`."""
        rough = self.coat_roughness
        if self._is_drawn_out("coat_roughness_anisotropy"):
            rough = _rough_along(w, self.derived.coat_alpha, self.coat_ior)
        return 1.0 - tables.reflected(w.z, rough, self.coat_ior, self._masking)

    # ------------------------------------------------------------------ layers

    @function
    def _inside(self, cos: Scalar) -> Scalar:
        """The cosine in the coat."""
        return maximum(safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(self.coat_ior)), 0.05)

    @function
    def _darkened(self, cos: Scalar) -> Spectrum:
        """(1 - K) / (1 - E_b K), K what the coat sends back down, E_b the base's albedo from above."""
        b = self.derived
        outer = exact.dielectric(cos, fresnel.cos_transmitted(cos, self.coat_ior), self.coat_ior)
        broad = 1.0 - (1.0 - fresnel.kind("exact").dielectric_average(self.coat_ior)) / sqr(self.coat_ior)
        f0 = fresnel.r0_dielectric(b.ratio)
        rough = _mix(1.0, self.specular_roughness, f0)
        K = _mix(outer, broad, _mix(rough, self.specular_roughness, self.base_metalness))
        body = _mix(self.base_color * self.base_weight, self.subsurface_color, self.subsurface_weight)
        body = _mix(body, 1.0 + 0.0 * body, self.transmission_weight)
        metal = self.base_color * (self.base_weight * minimum(self.specular_weight, 1.0))
        E_b = _mix(f0 + (1.0 - f0) * body, metal, self.base_metalness)
        return _mix(1.0, (1.0 - K) / (1.0 - E_b * K), self.coat_darkening)

    def _under(self, w: Direction) -> tuple[Scalar, Spectrum, Scalar, Scalar]:
        """At a direction outside: what the coat's surface lets through, what its colour leaves of one crossing with
        the root of the darkening, the factor of a lobe of facets, and what those of a dielectric, for all that they
        reflect, send out less than white ones: they reflect most where light grazes, and the coat covers most there.

        A last step of the iteration (`_balanced`): of a mirror the root of 1 - E, as exact as that itself.
        """
        b, cos = self.derived, w.z
        kept = self._coat_kept(w)
        tint = _power(self.coat_color, 0.5 / self._inside(cos)) * sqrt(self._darkened(cos))
        place = sqrt(maximum(cos, 0.0)) * (HATS - 1.0)
        here = _sum([maximum(1.0 - abs(place - float(n)), 0.0) * w for n, w in enumerate(b.facets)])
        row = tables.scattered(cos, b.rough, self._masking)
        met = _sum([p * w for p, w in zip(row, b.facets, strict=True)])
        facets = sqrt(here * kept / maximum(met, 1e-4))
        return kept, tint, facets, kept - facets * _seen_by(cos, b.ratio, row, b.facets)

    def _through_coat(self, pair: _Pair, let_in: tuple[Spectrum, Spectrum]) -> tuple[Spectrum, Spectrum]:
        """Factors of the base's facets and of its diffuse lobe, of which those let in so much from both directions; 1
        where there is no coat on their side."""
        C = self.coat_weight
        kept_o, tint_o, facet_o, less_o = self._under(pair.wo)
        if self.layering == "albedo":
            coated = _mix(1.0, self._darkened(pair.wo.z), C)
            tint = _power(self.coat_color, 0.5 / self._inside(pair.wo.z) + 0.5 / self._inside(pair.wi.z))
            both = coated * ((1.0 - C) + tint * (kept_o * C))
            both = where(pair.above, both, 1.0)
            return both, both
        kept_i, tint_i, facet_i, less_i = self._under(pair.wi)
        tint = tint_o * tint_i
        facets = (1.0 - C) + tint * (facet_o * facet_i * C)
        both = 1.0 / self.derived.joint
        for kept, less, let in ((kept_o, less_o, let_in[0]), (kept_i, less_i, let_in[1])):
            both = both * _covered_less(kept, less, let)
        if self._bends:
            for w in (pair.wo, pair.wi):
                both = both * (self._even(w, True) / self._even(w, False))
        diffuse = (1.0 - C) + tint * (both * C)
        return where(pair.above, facets, 1.0), where(pair.above, diffuse, 1.0)

    def _past_layers(self, w: Direction) -> Spectrum:
        """What coat and fuzz leave of light that passes them once, on its way in or out."""
        left = 1.0 + 0.0 * self.base_color
        if self._has("coat_weight"):
            kept, tint, _, less = self._under(w)
            left = _mix(1.0, tint * _covered_less(kept, less, self._let_in(w)), self.coat_weight) * left
        if self._has("fuzz_weight"):
            left = left * (1.0 - self.fuzz_weight * self._fuzz()._lobe(w).R)
        return left

    # ------------------------------------------------------------------ lobes

    def _fuzz(self) -> Sheen:
        return binding.bound_copy(Sheen(), {"albedo": self.fuzz_color, "roughness": self.fuzz_roughness})

    def _interface(self) -> Dielectric:
        """The geometry of refraction at the base's facets; how much goes that way is said elsewhere."""
        b, zero = self.derived, 0.0 * self.base_color
        kind = Dielectric(alpha=(0.1, 0.2) if self._two_widths else 0.1, masking=self._masking)
        clear = {"rotation": None, "albedo": 1.0 + zero, "absorption": zero, "priority": 0.0 * b.eta}
        return binding.bound_copy(kind, {"eta": b.eta, "alpha": b.alpha, **clear})

    def _pair(self, wo: Direction, wi: Direction) -> _Pair:
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
        return _Pair(where(valid, o, frame.upright(o)), where(valid, i, frame.upright(i)), near & valid, above)

    def _diffuse(self, pair: _Pair, let_in: tuple[Spectrum, Spectrum]) -> tuple[Spectrum, Spectrum]:
        """What the body under the dielectric reflects and, of a thin wall, lets through, times cos theta_i."""
        b = self.derived
        white = 1.0 + 0.0 * self.base_color
        values = {"roughness": self.base_diffuse_roughness}
        base = (
            binding.bound_copy(Eon(), {**values, "albedo": self.base_color}).eval(pair.wo, pair.wi) * self.base_weight
        )
        dimmed = let_in[0] * let_in[1] / b.sheer
        dimmed = dimmed * ((1.0 - self.base_metalness) * (1.0 - self.transmission_weight))
        if self._bends:
            dimmed = dimmed * (self._even(pair.wo, False) * self._even(pair.wi, False))
        if not self._has("subsurface_weight"):
            return base * dimmed, 0.0 * white
        S = self.subsurface_weight
        if not self.geometry_thin_walled:
            below = binding.bound_copy(Eon(), {**values, "albedo": self.subsurface_color}).eval(pair.wo, pair.wi)
            return _mix(base, below, S) * dimmed, 0.0 * white
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
            return (1.0 + 0.0 * self.base_color) * (bare * cos)
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
        return maximum(b.glass.at(w) + _sum(more), 0.0)

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
        zero = 0.0 * self.base_color * o.z
        h, cos = facet(o, i)
        smooth = self._smooth(b.alpha, "specular_roughness")
        facets = _lobe(self._facets(o, i, h, b.alpha), smooth, ideal)
        again = _lobe(self._returned(o, i), None, ideal)
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
            dielectric = _mix(dielectric, sheet, T)
            through = (on * facets + b.sheet_again[1] * again) * ((1.0 - M) * T)
        base = dielectric * (1.0 - M)
        if self._has("base_metalness"):
            metal = self._metal(cos, b.eta, b.medium) * facets + b.metal_again * again
            base = base + metal * M
        let_in = self._let_in(pair.wo), self._let_in(pair.wi)
        body, passed = (_lobe(one, None, ideal) for one in self._diffuse(pair, let_in))
        if self._has("coat_weight"):
            by_facets, by_body = self._through_coat(pair, let_in)
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
            over = _lobe(fuzz.eval(o, i), None, ideal) * self.fuzz_weight
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
        return f * _lobe(self._facets(o, i, h, alpha), self._smooth(alpha, "coat_roughness"), ideal)

    def _glass(
        self,
        wo: Direction,
        wi: Direction,
        pair: _Pair,
        cos: Scalar,
        mode: Mode,
        facets: Scalar,
        smooth: Mask | None,
        ideal: Mask | None,
    ) -> tuple[Spectrum, Spectrum, Spectrum]:
        """(F, what glass reflects, what it lets through) of a pair of directions, from either side."""
        b, glass, T = self.derived, self._interface(), self.transmission_weight
        white, above = 1.0 + 0.0 * self.base_color, wo.z > 0.0
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
        inner = 1.0 - (1.0 - inner) * self._past_layers(_at(maximum(cos_t, 1e-4)))
        twice = _lobe(self._twice(wo, wi, mode), None, ideal)
        # what is no glass looks from below as from above
        opaque = self._glossy(cos, b.ratio, b.eta, b.medium)
        mirrored = where(above, f * self.specular_color, _mix(opaque, inner, T))
        tint = where(above, self.specular_color, white)
        reflected = mirrored * facets + tint * (twice * T)
        spread = _lobe(where(at.reflects, 0.0, glass._value(at)), smooth, ideal, 1.0 / sqr(eta))
        spread = spread * sqr(eta) if mode == "importance" else spread
        colour = where(self.transmission_depth > 0.0, white, self.transmission_color)
        left = self._past_layers(outside) * colour
        through = ((1.0 - f) * spread + twice) * left * ((1.0 - self.base_metalness) * T)
        return f, reflected, through

    # ------------------------------------------------------------------ sampling

    def _shares(self, wo: Direction) -> Shares:
        """Of each lobe about what it reflects or lets through, with a little of all, so that no weight grows."""
        b = self.derived
        o = upper(wo)
        cos = maximum(o.z, 1e-4)
        zero, M, T = 0.0 * cos, self.base_metalness, self.transmission_weight
        above = wo.z != 0.0 if self.geometry_thin_walled else wo.z > 0.0
        fuzz, coat, left = zero, zero, 1.0 + zero
        if self._has("fuzz_weight"):
            fuzz = where(above, self.fuzz_weight * self._fuzz()._lobe(o).R, 0.0)
            left = left - fuzz
        if self._has("coat_weight"):
            coat = where(above, self.coat_weight * (1.0 - self._coat_kept(o)), 0.0) * left
            left = left - coat
        # a film's part by its mean: its colours would double the work, for probabilities
        glossy = clamp(exact.dielectric(cos, fresnel.cos_transmitted(cos, b.ratio), b.ratio) + b.extra, 0.0, 1.0)
        body = self.base_color * self.base_weight
        thin = self.geometry_thin_walled and self._has("subsurface_weight")
        S = self.subsurface_weight
        even = mean(_mix(body, self.subsurface_color, S)) * (1.0 - M) * (1.0 - T) * (1.0 - glossy)
        passed = zero
        if thin:
            passed = mean(self.subsurface_color) * S * (0.5 + 0.5 * self.subsurface_scatter_anisotropy)
            passed = passed * (1.0 - M) * (1.0 - T) * (1.0 - glossy)
        even = maximum(even - passed, 0.0)
        lost = b.metal.at(o)
        metal = mean(self._bare_metal(cos)) + abs(b.extra) if self._has("base_metalness") else zero
        refracted, back = zero, glossy
        near, far = lost * metal * M, zero
        if self.geometry_thin_walled and self._has("transmission_weight"):
            on = self._sheet(cos, glossy + 0.0 * self.base_color, b.eta)
            back = _mix(glossy, mean(on[0]), T)
            refracted = mean(on[1]) * (1.0 - M) * T
            near, far = near + lost * T * mean(on[0]), lost * T * mean(on[1])
        elif self._refracts:
            assert b.glass is not None, "derived where light is transmitted"
            cos_t = fresnel.cos_transmitted(cos, 1.0 / b.eta)
            inner = exact.dielectric(cos_t, fresnel.cos_transmitted(cos_t, b.ratio), b.ratio) + b.extra
            inner = clamp(where(cos_t > 0.0, inner, 1.0), 0.02, 0.98)
            here = where(wo.z > 0.0, clamp(glossy, 0.02, 1.0), inner)
            back = _mix(glossy, here, T)
            refracted = (1.0 - here) * ((1.0 - M) * T)
            twice = b.glass.at(wo) * (1.0 - M) * T
            near, far = near + 0.5 * twice, 0.5 * twice
        mirrored = metal * M + back * (1.0 - M) * mean(self.specular_color) + 0.01
        near, far = even + near + 0.01, far + passed
        if self._two_faced:
            far = far + 0.01 * (1.0 - M)
        mirrored, refracted, near, far = (left * share for share in (mirrored, refracted, near, far))
        total = 1.0 / (fuzz + coat + mirrored + refracted + near + far)
        return Shares(*(share * total for share in (fuzz, coat, mirrored, refracted, near, far)))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the lobes' densities."""
        model = self._settled()
        density = model._density(model._shares(wo), wo, wi)
        return density * self.geometry_opacity if self._has_holes() else density

    def _density(self, shares: Shares, wo: Direction, wi: Direction) -> Scalar:
        b = self.derived
        pair = self._pair(wo, wi)
        o, i = pair.wo, pair.wi
        h, _ = facet(o, i)
        ndf = distribution("ggx")
        smooth = self._smooth(b.alpha, "specular_roughness")
        mirrored = _lobe(0.25 * ndf.visible_per_cosine(o, h, b.alpha), smooth, None)
        cosine = i.z * inv_pi
        density = shares.mirrored * mirrored + shares.near * cosine
        if self._has("coat_weight"):
            coat = 0.25 * ndf.visible_per_cosine(o, h, b.coat_alpha)
            density = density + shares.coat * _lobe(coat, self._smooth(b.coat_alpha, "coat_roughness"), None)
        if self._has("fuzz_weight"):
            density = density + shares.fuzz * self._fuzz().pdf(o, i)
        if not self._two_faced:
            return where(pair.near, density, 0.0)
        if self.geometry_thin_walled:
            through = shares.refracted * mirrored
        else:
            glass = self._interface()
            eta = glass._relative_eta(wo)
            at = glass._facet(wo, wi, eta)
            through = shares.refracted * _lobe(where(at.reflects, 0.0, glass._density(at, eta)), smooth, None)
        through = through + shares.far * cosine
        return where(pair.near, density, where((wo.z != 0.0) & (wi.z != 0.0), through, 0.0))

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u1 picks the lobe."""
        return self._settled()._drawn(wo, u, mode)

    def _drawn(self, wo: Direction, u: Direction, mode: Mode) -> Sample:
        b, shares = self.derived, self._shares(wo)
        pick = u.x
        if self._has_holes():
            covered = u.x < self.geometry_opacity
            pick = minimum(safe_div(u.x, self.geometry_opacity), ALMOST_ONE)
        o = upper(wo) if self._two_faced else wo
        o = where(o.z > 0.0, o, frame.upright(o))
        ends = [shares.fuzz]
        for share in shares[1:]:
            ends.append(ends[-1] + share)
        on_fuzz, on_coat = pick < ends[0], (pick >= ends[0]) & (pick < ends[1])
        on_facets, on_refracted = (pick >= ends[1]) & (pick < ends[2]), (pick >= ends[2]) & (pick < ends[3])
        on_near = (pick >= ends[3]) & (pick < ends[4])
        alpha = vec2(where(on_coat, b.coat_alpha.x, b.alpha.x), where(on_coat, b.coat_alpha.y, b.alpha.y))
        m = distribution("ggx").sample_visible(o, u.y, u.z, alpha)
        smooth = self._smooth(b.alpha, "specular_roughness")
        smooth_coat = self._smooth(b.coat_alpha, "coat_roughness") if self._has("coat_weight") else None
        ideal, found = None, 0.0 * pick  # rays on smooth facets, and the probability of their direction
        for mirror, here, joins, share in (
            (smooth_coat, on_coat, on_coat | on_facets, shares.coat),
            (smooth, on_facets, on_coat | on_facets, shares.mirrored),
            (smooth, on_refracted, on_refracted, shares.refracted),
        ):
            if mirror is not None:
                ideal = here & mirror if ideal is None else ideal | (here & mirror)
                found = found + where(joins & mirror, share, 0.0)
        if ideal is not None:
            m = where(ideal, frame.upright(o), m)
        mirrored = frame.reflect(o, m)
        cosine = square_to_cosine_hemisphere(u.y, u.z)
        wi = where(on_coat | on_facets, mirrored, cosine)
        valid = wi.z > 0.0
        if self._has("fuzz_weight"):
            wi = where(on_fuzz, self._fuzz().sample(o, u, mode).wi, wi)
            valid = wi.z > 0.0
        if self._two_faced:
            far = ~on_fuzz & ~on_coat & ~on_facets & ~on_near
            if self.geometry_thin_walled:
                bent, passes = mirrored, mirrored.z > 0.0
                bent = vec3(bent.x, bent.y, -bent.z)
            else:
                eta = where(wo.z >= 0.0, b.eta, 1.0 / b.eta)
                cos_m = ops.dot(o, m)
                cos_t = fresnel.cos_transmitted(cos_m, eta)
                bent = frame.refract(o, m, cos_t, eta)
                passes = (cos_t > 0.0) & (bent.z < 0.0)
            below = vec3(wi.x, wi.y, -wi.z)
            wi = where(on_refracted, bent, where(far, below, wi))
            valid = where(on_refracted, passes, where(far, wi.z < 0.0, valid))
            wi = where(wo.z < 0.0, -wi, wi)
        density = self._density(shares, wo, wi)
        if ideal is not None:
            density = where(ideal, found, density)
        density = where(valid, density, 0.0)
        weight = self._surface(wo, wi, mode, ideal) * safe_div(1.0, density)
        one = 1.0 + 0.0 * density
        eta = one
        if self._refracts:
            eta = where(wo.z * wi.z > 0.0, one, where(wo.z >= 0.0, b.eta, 1.0 / b.eta))
        delta = density != density if ideal is None else ideal & valid
        if self._has_holes():
            through = 1.0 - self.geometry_opacity
            wi, weight = where(covered, wi, -wo), where(covered, weight, one)
            density = where(covered, density * self.geometry_opacity, through)
            eta, delta = where(covered, eta, one), ~covered | delta
        return Sample(wi, weight, density, delta, eta)

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
        return Interior(self._indices()[1], loss, 0.0 * self.transmission_depth)

    def tint(self, wo: Direction) -> Spectrum:
        """The base's colours under a cosine."""
        b = self.derived
        cos = abs(wo.z)
        f = self._glossy(cos, b.ratio, b.eta, b.medium)
        body = _mix(self.base_color * self.base_weight, self.subsurface_color, self.subsurface_weight)
        body = _mix(body, self.transmission_color, self.transmission_weight)
        dielectric = f * self.specular_color + (1.0 - f) * body
        return _mix(dielectric, self._metal(cos, b.eta, b.medium), self.base_metalness)


# --------------------------------------------------------------------------- small formulas


def _mix(a: Array, b: Array, share: Scalar) -> Array:
    """a at share 0, b at share 1."""
    return a * (1.0 - share) + b * share


@function
def _modulated(ratio: Scalar, weight: Scalar) -> Scalar:
    """The index whose F0 is that of `ratio` times a weight, held at index 5."""
    root = (ratio - 1.0) / (ratio + 1.0)
    epsilon = ops.copysign(minimum(abs(root) * sqrt(maximum(weight, 1e-24)), LARGEST), root)
    return (1.0 + epsilon) / (1.0 - epsilon)


def _sum(terms: list[Array]) -> Array:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _seen_by(cos: Scalar, ratio: Scalar, row: tuple[Scalar, ...], facets: tuple[Scalar, ...]) -> Scalar:
    """<w>: the mean factor of facets over what those of a dielectric send to a direction of a cosine. They reflect most
    where light grazes: shares of the light are white facets' times F of the facet half way between."""
    sin, r0 = safe_sqrt(1.0 - sqr(cos)), fresnel.r0_dielectric(ratio)
    met, total = 0.0 * cos, 0.0 * cos
    for n, (share, w) in enumerate(zip(row, facets, strict=True)):
        other = (n / (HATS - 1.0)) ** 2
        half = safe_sqrt(0.5 + 0.5 * (other * cos - math.sqrt(1.0 - other * other) * sin))
        one = share * schlick(half, r0)
        met, total = met + one * w, total + one
    return met / maximum(total, 1e-9)


@function
def _rough_along(w: Direction, alpha: Pair, index: Scalar) -> Scalar:
    """The roughness of which a dielectric of one width reflects about as much as of two, seen along a direction:
    straight down by the root of their mean square, where light grazes by the one seen. Met to .02 at a ratio of 3."""
    total, sin2 = 0.5 * (sqr(alpha.x) + sqr(alpha.y)), frame.sin2(w)
    seen2 = (sqr(alpha.x * w.x) + sqr(alpha.y * w.y) + 1e-6 * total) / (sin2 + 1e-6)
    share = (1.0 - w.z) * (1.2 - (index - 1.0) / (index + 1.0))
    return minimum(sqrt(sqrt(total * ops.exp(share * log(seen2 / total)))), 1.0)


def _covered_less(kept: Scalar, less: Scalar, let_in: Spectrum) -> Spectrum:
    """What a coat leaves of light that facets let in: its own, and what they send out less than white ones."""
    return kept + less * (1.0 - let_in) / maximum(let_in, 1e-3)


def _covered(E: Spectrum, filmed: tuple[Spectrum, ...], shares: tuple[Scalar, ...]) -> Spectrum:
    """The albedo of facets under a film: what it changes at `PLACES`, by how much these count."""
    if not filmed:
        return E
    return clamp(E + _sum([one * share for one, share in zip(filmed, shares, strict=True)]), 0.0, 1.0)


def _averaged(values: list[Array]) -> Array:
    """2 int F mu dmu of what F is at `PLACES`, or at `FEW_PLACES`."""
    x, w = gauss(len(values))
    return _sum([value * weight for value, weight in zip(values, (2.0 * w * x).tolist(), strict=True)])


@function
def _over_pi(scale: Scalar) -> Scalar:
    """The mean whose inverse over pi that is; 0 of 0."""
    return safe_div(inv_pi, scale)


def _again(f: Spectrum, lost: Scalar) -> Spectrum:
    """Colour of light that facets scatter twice or more: F^2 E_avg / (1 - F (1 - E_avg))."""
    return sqr(f) * (1.0 - lost) / (1.0 - f * lost)


@function
def _power(colour: Spectrum, exponent: Scalar) -> Spectrum:
    """A colour to a power; black stays black."""
    return ops.exp(log(maximum(colour, 1e-6)) * exponent)


def _at(cos: Scalar) -> Direction:
    """A direction of a cosine, half way between the axes of two widths."""
    sin = math.sqrt(0.5) * safe_sqrt(1.0 - sqr(cos))
    return vec3(sin, sin, cos)


def _lobe(value: Array, smooth: Mask | None, ideal: Mask | None, mirror: Scalar | float = 1.0) -> Array:
    """A lobe's value; 0 where its facets are smooth, and of what is ideal `mirror` of smooth ones alone."""
    if ideal is None:
        return value if smooth is None else where(smooth, 0.0, value)
    rough = where(ideal, 0.0, value)
    return rough if smooth is None else where(smooth, where(ideal, mirror, 0.0), rough)
