"""The lobes of OpenPBR's surface, and their sum."""

from __future__ import annotations

from typing import NamedTuple

from ... import ops
from ...material import binding
from ...ops import Direction, Mask, Mode, Pair, Scalar, Spectrum, abs, inv_pi, maximum, sqr, vec3, where
from ...optics import frame, fresnel, masking
from ...optics.fresnel import exact
from ...optics.ndf import distribution
from ..diffuse.eon import Eon
from ..historic.glossy import facet
from ..microfacet.dielectric import Dielectric
from ..microfacet.microfacet import upper
from . import _openpbr_layers as layers
from . import _openpbr_tables as tables
from ._openpbr_formulas import direction_at, lobe_value, mix, total_of
from ._openpbr_layers import Sides
from ._openpbr_slabs import _OpenPBR


class Facets(NamedTuple):
    """The facets that mirror one direction into the other.

    cos     cosine of the angle between their normal and either direction
    value   their lobe at F = 1
    smooth  rays for which all facets are parallel; None if there are no such rays
    """

    cos: Scalar
    value: Scalar
    smooth: Mask | None


def surface(model: _OpenPBR, wo: Direction, wi: Direction, mode: Mode, ideal: Mask | None = None) -> Spectrum:
    """The sum of all lobes of the covered part of the surface, times |cos theta_i|.

    ideal  rays whose two directions are connected by smooth facets; their value is the weight of the delta lobe
    """
    b = model.derived
    pair = sides(model, wo, wi)
    o, i = pair.wo, pair.wi
    M, T = model.base_metalness, model.transmission_weight
    zero = ops.zeros_like(model.base_color) * o.z
    h, cos = facet(o, i)
    smooth = model.smooth(b.alpha, "specular_roughness")
    facets = lobe_value(facet_lobe(model, o, i, h, b.alpha), smooth, ideal)
    multiple = lobe_value(multiple_scattering(model, o, i), None, ideal)
    through = zero
    if model.refracts:
        glossy, dielectric, through = glass_lobes(model, wo, wi, pair, Facets(cos, facets, smooth), mode, ideal)
    else:
        glossy = model.glossy(cos, b.ratio, b.eta, b.medium)
        dielectric = glossy * model.specular_color * facets
    if model.geometry_thin_walled and model.has("transmission_weight"):
        assert b.sheet_again is not None, "derived for thin walls"
        back, on = model.sheet(cos, glossy, b.eta)
        sheet = (back * facets + b.sheet_again[0] * multiple) * model.specular_color
        dielectric = mix(dielectric, sheet, T)
        through = (on * facets + b.sheet_again[1] * multiple) * ((1.0 - M) * T)
    base = dielectric * (1.0 - M)
    if model.has("base_metalness"):
        metal = model.metal(cos, b.eta, b.medium) * facets + b.metal_again * multiple
        base = base + metal * M
    let_in = layers.let_in(model, pair.wo), layers.let_in(model, pair.wi)
    body, passed = (lobe_value(one, None, ideal) for one in diffuse_lobes(model, pair, let_in))
    if model.has("coat_weight"):
        by_facets, by_body = layers.through_coat(model, pair, let_in)
        coat = coat_lobe(model, o, i, h, cos, ideal) * model.coat_weight
        base = base * by_facets + where(pair.above, coat, 0.0)
        body, passed = body * by_body, passed * by_body
        if model.geometry_thin_walled:
            through = through * by_facets
    total = base + body
    if model.geometry_thin_walled:
        through = through + passed
    if model.has("fuzz_weight"):
        fuzz = layers.fuzz_lobe(model)
        left = 1.0 - model.fuzz_weight * fuzz._lobe(o).R
        over = lobe_value(fuzz.eval(o, i), None, ideal) * model.fuzz_weight
        total = where(pair.above, total * left + over, total)
        if model.geometry_thin_walled:
            through = through * left
    if not model.two_faced:
        return where(pair.near, total, 0.0)
    return where(pair.near, total, where((wo.z != 0.0) & (wi.z != 0.0), through, 0.0))


def facet_lobe(model: _OpenPBR, o: Direction, i: Direction, h: Direction, alpha: Pair) -> Scalar:
    """D G / (4 cos theta_o), the lobe of facets at F = 1, times cos theta_i."""
    ndf = distribution("ggx")
    g = masking.masking_shadowing(model.masking, ndf, o, i, h, alpha)
    return ndf.D(h, alpha) * g / (4.0 * o.z)


def coat_lobe(model: _OpenPBR, o: Direction, i: Direction, h: Direction, cos: Scalar, ideal: Mask | None) -> Scalar:
    """The coat's own lobe, times cos theta_i."""
    alpha = model.derived.coat_alpha
    f = exact.dielectric(cos, fresnel.cos_transmitted(cos, model.coat_ior), model.coat_ior)
    return f * lobe_value(facet_lobe(model, o, i, h, alpha), model.smooth(alpha, "coat_roughness"), ideal)


def glass_lobes(
    model: _OpenPBR,
    wo: Direction,
    wi: Direction,
    pair: Sides,
    facets: Facets,
    mode: Mode,
    ideal: Mask | None,
) -> tuple[Spectrum, Spectrum, Spectrum]:
    """F, the light reflected by glass, and the light transmitted by it, for a pair of directions, from either side."""
    cos, b, glass, T = facets.cos, model.derived, interface(model), model.transmission_weight
    white, above = ops.ones_like(model.base_color), wo.z > 0.0
    eta = glass._relative_eta(wo)
    at = glass._facet(wo, wi, eta)
    # F depends on the cosine outside for both directions of light
    cos_t = fresnel.cos_transmitted(cos, 1.0 / b.eta)
    joined, outside = where(above, abs(at.dot_o), abs(at.dot_i)), where(above, pair.wo, pair.wi)
    crosses = joined if ideal is None else where(ideal, outside.z, joined)
    outer = where(pair.near, where(above, cos, maximum(cos_t, 1e-4)), crosses)
    f = model.glossy(outer, b.ratio, b.eta, b.medium)
    # from inside, the light that coat and fuzz would reflect is added to the base's reflection
    inner = where(cos_t > 0.0, f, white)
    inner = 1.0 - (1.0 - inner) * layers.past_layers(model, direction_at(maximum(cos_t, 1e-4)))
    twice = lobe_value(scattered_twice(model, wo, wi, mode), None, ideal)
    # the opaque fraction looks the same from below as from above
    opaque = model.glossy(cos, b.ratio, b.eta, b.medium)
    mirrored = where(above, f * model.specular_color, mix(opaque, inner, T))
    tint = where(above, model.specular_color, white)
    reflected = mirrored * facets.value + tint * (twice * T)
    spread = lobe_value(where(at.reflects, 0.0, glass._value(at)), facets.smooth, ideal, 1.0 / sqr(eta))
    spread = spread * sqr(eta) if mode == "importance" else spread
    colour = where(model.transmission_depth > 0.0, white, model.transmission_color)
    left = layers.past_layers(model, outside) * colour
    through = ((1.0 - f) * spread + twice) * left * ((1.0 - model.base_metalness) * T)
    return f, reflected, through


def interface(model: _OpenPBR) -> Dielectric:
    """The geometry of refraction at the base's facets, without weights."""
    b, zero = model.derived, ops.zeros_like(model.base_color)
    kind = Dielectric(alpha=(0.1, 0.2) if model.anisotropic else 0.1, masking=model.masking)
    clear = {"rotation": None, "albedo": 1.0 + zero, "absorption": zero, "priority": ops.zeros_like(b.eta)}
    return binding.bound_copy(kind, {"eta": b.eta, "alpha": b.alpha, **clear})


def sides(model: _OpenPBR, wo: Direction, wi: Direction) -> Sides:
    """The pair mapped to the upper side. A thin wall looks the same from both sides."""
    near = wo.z * wi.z > 0.0
    above = wo.z > 0.0
    valid = (wo.z != 0.0) & (wi.z != 0.0)
    if model.geometry_thin_walled:
        above = wo.z != 0.0
        wi = where(wo.z < 0.0, -wi, wi)
        wi = where(near, wi, vec3(wi.x, wi.y, -wi.z))
    elif not model.two_faced:
        valid = near = near & above
    o, i = upper(wo), where(wi.z < 0.0, -wi, wi)
    return Sides(where(valid, o, frame.normal_like(o)), where(valid, i, frame.normal_like(i)), near & valid, above)


def diffuse_lobes(model: _OpenPBR, pair: Sides, let_in: tuple[Spectrum, Spectrum]) -> tuple[Spectrum, Spectrum]:
    """Reflection by the body below the dielectric and, for a thin wall, its transmission, times cos theta_i."""
    b = model.derived
    white = ops.ones_like(model.base_color)
    values = {"roughness": model.base_diffuse_roughness}
    base = binding.bound_copy(Eon(), {**values, "albedo": model.base_color}).eval(pair.wo, pair.wi) * model.base_weight
    dimmed = let_in[0] * let_in[1] / b.sheer
    dimmed = dimmed * ((1.0 - model.base_metalness) * (1.0 - model.transmission_weight))
    if model.balances_diffuse:
        dimmed = dimmed * (layers.even(model, pair.wo, False) * layers.even(model, pair.wi, False))
    if not model.has("subsurface_weight"):
        return base * dimmed, ops.zeros_like(white)
    S = model.subsurface_weight
    if not model.geometry_thin_walled:
        below = binding.bound_copy(Eon(), {**values, "albedo": model.subsurface_color}).eval(pair.wo, pair.wi)
        return mix(base, below, S) * dimmed, ops.zeros_like(white)
    even = binding.bound_copy(Eon(), {**values, "albedo": white}).eval(pair.wo, pair.wi)
    half, g = even * model.subsurface_color * (0.5 * S), model.subsurface_scatter_anisotropy
    return (base * (1.0 - S) + half * (1.0 - g)) * dimmed, half * (1.0 + g) * dimmed


def multiple_scattering(model: _OpenPBR, wo: Direction, wi: Direction) -> Scalar:
    """Multiple scattering between lossless facets, times cos theta_i."""
    lost = model.derived.metal
    return lost.at(wo) * lost.at(wi) * lost.over_average(wi) * wi.z


def scattered_twice(model: _OpenPBR, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
    """Multiple scattering between facets of glass, to both sides, times |cos theta_i|."""
    lost, other = model.derived.glass, model.derived.other
    assert lost is not None, "derived if light is transmitted"
    cos = abs(wi.z) * lost.radiance(wo, wi, mode)
    if other is None:
        bare = lost.at(wo) * lost.at(wi) * lost.over_average(wi) * lost.share(wo, wi)
        return ops.ones_like(model.base_color) * (bare * cos)
    into = where(wo.z > 0.0, other.into, other.out)
    share = where(wo.z * wi.z > 0.0, 1.0 - into, into)
    level = where(wi.z > 0.0, other.thin, other.dense)
    return missed(model, wo) * missed(model, wi) * share * (cos * inv_pi) / level


def missed(model: _OpenPBR, w: Direction) -> Spectrum:
    """The energy lost by single scattering in glass, for a direction on either side."""
    b = model.derived
    assert b.glass is not None and b.other is not None, "derived if light is transmitted"
    shares = tables.spared(abs(w.z), b.rough, b.eta, model.masking)
    count = len(b.other.less)
    more = [
        one * where(w.z > 0.0, thin, dense)
        for one, thin, dense in zip(b.other.less, shares[:count], shares[count:], strict=True)
    ]
    return maximum(b.glass.at(w) + total_of(more), 0.0)
