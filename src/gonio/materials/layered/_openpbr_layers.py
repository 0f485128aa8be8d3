"""Attenuation of light by OpenPBR's coat and fuzz."""

from __future__ import annotations

import math
from typing import NamedTuple

from ... import ops
from ...material import binding
from ...ops import (
    Direction,
    Mask,
    Scalar,
    Spectrum,
    abs,
    function,
    inv_pi,
    maximum,
    minimum,
    ones_like,
    safe_sqrt,
    sqr,
    sqrt,
    where,
    zeros_like,
)
from ...optics import fresnel
from ...optics.fresnel import exact
from ..diffuse.eon import AVERAGE as MEAN_LOSS
from ..diffuse.eon import GRAZING as GRAZING_LOSS
from ..diffuse.eon import Eon
from ..sheen.sheen import Sheen
from . import _openpbr_tables as tables
from ._openpbr_formulas import covered, covered_less, direction_at, mix, power, rough_along, seen_by, total_of
from ._openpbr_slabs import _OpenPBR
from ._openpbr_tables import HATS, NODES


class Sides(NamedTuple):
    """A pair of directions, both on the upper side.

    wo, wi   the pair, above the surface; replaced by the normal if the pair is not evaluated
    near     whether wi is on wo's side
    above    whether coat and fuzz are on that side
    """

    wo: Direction
    wi: Direction
    near: Mask
    above: Mask


def let_in(model: _OpenPBR, w: Direction) -> Spectrum:
    """1 - E of the base's dielectric surface for w; if it is anisotropic, at the equivalent roughness along w."""
    b = model.derived
    rough = b.rough
    if model.anisotropic:
        rough = rough_along(w, b.alpha, b.ratio)
    return kept_below(model, w.z, rough, b.ratio, b.filmed)


def kept_below(model: _OpenPBR, cos: Scalar, rough: Scalar, ratio: Scalar, filmed: tuple[Spectrum, ...]) -> Spectrum:
    """`let_in` as a function of a cosine and derived values."""
    E = tables.reflected(cos, rough, ratio, model.masking) + ops.zeros_like(model.base_color)
    return 1.0 - covered(E, filmed, tables.faced(cos, rough, model.masking) if filmed else ())


def fuzz_lobe(model: _OpenPBR) -> Sheen:
    """The fuzz, as the `sheen` with its color and roughness."""
    return binding.bound_copy(Sheen(), {"albedo": model.fuzz_color, "roughness": model.fuzz_roughness})


def even(model: _OpenPBR, w: Direction, coated: bool) -> Scalar:
    """Factor on the rough diffuse lobe for a direction, under the surface of the base and, if `coated`, also of the
    coat.

    At some cosines, the lobe scatters more light than a Lambertian lobe, and the surfaces may transmit less than on
    average. The mean of the lobe over azimuth is known, and the factor makes a white base lossless to second order.
    """
    rough = model.base_diffuse_roughness
    lobe = binding.bound_copy(Eon(energy="fit"), {"albedo": ones_like(model.base_color), "roughness": rough})
    sin, lost, total = safe_sqrt(1.0 - sqr(w.z)), lobe._lost(w), zeros_like(w.z)
    nodes = [x * x for x in NODES]
    for node, off in zip(nodes, model.derived.bent[coated], strict=True):
        slant = sin * (math.sqrt(1.0 - node * node) * inv_pi) * (1.0 / maximum(w.z, node) - 1.0)
        twice = lost * (lobe._lost(direction_at(node + zeros_like(w.z))) / (GRAZING_LOSS - MEAN_LOSS))
        total = total + off * (slant + twice)
    return 1.0 / (1.0 + lobe._single() * rough * total)


def coat_kept(model: _OpenPBR, w: Direction) -> Scalar:
    """1 - E of the coat's surface for w; if it is anisotropic, as in `let_in`."""
    rough = model.coat_roughness
    if model.may_be_anisotropic("coat_roughness_anisotropy"):
        rough = rough_along(w, model.derived.coat_alpha, model.coat_ior)
    return 1.0 - tables.reflected(w.z, rough, model.coat_ior, model.masking)


@function
def inside(model: _OpenPBR, cos: Scalar) -> Scalar:
    """The cosine of the refracted direction in the coat."""
    return maximum(safe_sqrt(1.0 - (1.0 - sqr(cos)) / sqr(model.coat_ior)), 0.05)


@function
def darkened(model: _OpenPBR, cos: Scalar) -> Spectrum:
    """The darkening under the coat, (1 - K) / (1 - E_b K), where K is the fraction of the light from below that the
    coat reflects back down, and E_b is the albedo of the base inside the coat."""
    b = model.derived
    outer = exact.dielectric(cos, fresnel.cos_transmitted(cos, model.coat_ior), model.coat_ior)
    broad = 1.0 - (1.0 - fresnel.kind("exact").dielectric_average(model.coat_ior)) / sqr(model.coat_ior)
    f0 = fresnel.r0_dielectric(b.ratio)
    rough = mix(1.0, model.specular_roughness, f0)
    K = mix(outer, broad, mix(rough, model.specular_roughness, model.base_metalness))
    body = mix(model.base_color * model.base_weight, model.subsurface_color, model.subsurface_weight)
    body = mix(body, ones_like(body), model.transmission_weight)
    metal = model.base_color * (model.base_weight * minimum(model.specular_weight, 1.0))
    E_b = mix(f0 + (1.0 - f0) * body, metal, model.base_metalness)
    return mix(1.0, (1.0 - K) / (1.0 - E_b * K), model.coat_darkening)


def under(model: _OpenPBR, w: Direction) -> tuple[Scalar, Spectrum, Scalar, Scalar]:
    """Four values for a direction outside the coat: the transmittance of the coat's surface; the coat's color for one
    crossing times the square root of the darkening; the factor on a lobe of facets; and the loss of a dielectric's
    facets relative to white facets, which arises because they reflect most at grazing angles, where the coat transmits
    least.

    The factor includes a last step of the iteration in `balanced`. For a mirror, it is exactly the square root of
    1 - E.
    """
    b, cos = model.derived, w.z
    transmitted = coat_kept(model, w)
    tint = power(model.coat_color, 0.5 / inside(model, cos)) * sqrt(darkened(model, cos))
    place = sqrt(maximum(cos, 0.0)) * (HATS - 1.0)
    here = total_of([maximum(1.0 - abs(place - float(n)), 0.0) * w for n, w in enumerate(b.facets)])
    row = tables.scattered(cos, b.rough, model.masking)
    gathered = total_of([p * w for p, w in zip(row, b.facets, strict=True)])
    facets = sqrt(here * transmitted / maximum(gathered, 1e-4))
    return transmitted, tint, facets, transmitted - facets * seen_by(cos, b.ratio, row, b.facets)


def through_coat(model: _OpenPBR, pair: Sides, let_in: tuple[Spectrum, Spectrum]) -> tuple[Spectrum, Spectrum]:
    """Factors of the coat on the lobe of the base's facets and on its diffuse lobe; 1 on a side without a coat.

    let_in  transmittances of the base's surface along wo and wi
    """
    C = model.coat_weight
    kept_o, tint_o, facet_o, less_o = under(model, pair.wo)
    if model.layering == "albedo":
        coated = mix(1.0, darkened(model, pair.wo.z), C)
        tint = power(model.coat_color, 0.5 / inside(model, pair.wo.z) + 0.5 / inside(model, pair.wi.z))
        both = coated * ((1.0 - C) + tint * (kept_o * C))
        both = where(pair.above, both, 1.0)
        return both, both
    kept_i, tint_i, facet_i, less_i = under(model, pair.wi)
    tint = tint_o * tint_i
    facets = (1.0 - C) + tint * (facet_o * facet_i * C)
    both = 1.0 / model.derived.joint
    for transmitted, less, let in ((kept_o, less_o, let_in[0]), (kept_i, less_i, let_in[1])):
        both = both * covered_less(transmitted, less, let)
    if model.balances_diffuse:
        for w in (pair.wo, pair.wi):
            both = both * (even(model, w, True) / even(model, w, False))
    diffuse = (1.0 - C) + tint * (both * C)
    return where(pair.above, facets, 1.0), where(pair.above, diffuse, 1.0)


def past_layers(model: _OpenPBR, w: Direction) -> Spectrum:
    """Transmittance of coat and fuzz for light that crosses them once, inward or outward."""
    left = ones_like(model.base_color)
    if model.has("coat_weight"):
        transmitted, tint, _, less = under(model, w)
        left = mix(1.0, tint * covered_less(transmitted, less, let_in(model, w)), model.coat_weight) * left
    if model.has("fuzz_weight"):
        left = left * (1.0 - model.fuzz_weight * fuzz_lobe(model)._lobe(w).R)
    return left
