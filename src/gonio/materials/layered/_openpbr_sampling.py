"""Sampling of OpenPBR: a mixture of its lobes, weighted by their approximate albedos."""

from __future__ import annotations

from typing import NamedTuple

from ... import ops
from ...material import Sample
from ...ops import (
    Direction,
    Mask,
    Mode,
    Scalar,
    abs,
    clamp,
    inv_pi,
    maximum,
    mean,
    minimum,
    safe_div,
    vec2,
    vec3,
    where,
)
from ...optics import frame, fresnel
from ...optics.fresnel import exact
from ...optics.ndf import distribution
from ...optics.warp import square_to_cosine_hemisphere
from ..combined.mix import ALMOST_ONE
from ..historic.glossy import facet
from ..microfacet.microfacet import upper
from . import _openpbr_layers as layers
from . import _openpbr_lobes as lobes
from ._openpbr_formulas import lobe_value, mix
from ._openpbr_slabs import _OpenPBR


class Shares(NamedTuple):
    """Probabilities of the lobes: fuzz, coat, reflecting and refracting facets, and the cosine on wo's side (`near`)
    and on the opposite side (`far`)."""

    fuzz: Scalar
    coat: Scalar
    mirrored: Scalar
    refracted: Scalar
    near: Scalar
    far: Scalar


def shares_at(model: _OpenPBR, wo: Direction) -> Shares:
    """Probabilities proportional to each lobe's approximate albedo plus a small constant, which bounds the weights."""
    b = model.derived
    o = upper(wo)
    cos = maximum(o.z, 1e-4)
    zero, M, T = ops.zeros_like(cos), model.base_metalness, model.transmission_weight
    above = wo.z != 0.0 if model.geometry_thin_walled else wo.z > 0.0
    fuzz, coat, left = zero, zero, 1.0 + zero
    if model.has("fuzz_weight"):
        fuzz = where(above, model.fuzz_weight * layers.fuzz_lobe(model)._lobe(o).R, 0.0)
        left = left - fuzz
    if model.has("coat_weight"):
        coat = where(above, model.coat_weight * (1.0 - layers.coat_kept(model, o)), 0.0) * left
        left = left - coat
    # the mean effect of the film: evaluating it per channel would double the cost of the probabilities
    glossy = clamp(exact.dielectric(cos, fresnel.cos_transmitted(cos, b.ratio), b.ratio) + b.extra, 0.0, 1.0)
    body = model.base_color * model.base_weight
    thin = model.geometry_thin_walled and model.has("subsurface_weight")
    S = model.subsurface_weight
    even = mean(mix(body, model.subsurface_color, S)) * (1.0 - M) * (1.0 - T) * (1.0 - glossy)
    passed = zero
    if thin:
        passed = mean(model.subsurface_color) * S * (0.5 + 0.5 * model.subsurface_scatter_anisotropy)
        passed = passed * (1.0 - M) * (1.0 - T) * (1.0 - glossy)
    even = maximum(even - passed, 0.0)
    lost = b.metal.at(o)
    metal = mean(model.bare_metal(cos)) + abs(b.extra) if model.has("base_metalness") else zero
    refracted, back = zero, glossy
    near, far = lost * metal * M, zero
    if model.geometry_thin_walled and model.has("transmission_weight"):
        on = model.sheet(cos, glossy + ops.zeros_like(model.base_color), b.eta)
        back = mix(glossy, mean(on[0]), T)
        refracted = mean(on[1]) * (1.0 - M) * T
        near, far = near + lost * T * mean(on[0]), lost * T * mean(on[1])
    elif model.refracts:
        assert b.glass is not None, "derived if light is transmitted"
        cos_t = fresnel.cos_transmitted(cos, 1.0 / b.eta)
        inner = exact.dielectric(cos_t, fresnel.cos_transmitted(cos_t, b.ratio), b.ratio) + b.extra
        inner = clamp(where(cos_t > 0.0, inner, 1.0), 0.02, 0.98)
        here = where(wo.z > 0.0, clamp(glossy, 0.02, 1.0), inner)
        back = mix(glossy, here, T)
        refracted = (1.0 - here) * ((1.0 - M) * T)
        twice = b.glass.at(wo) * (1.0 - M) * T
        near, far = near + 0.5 * twice, 0.5 * twice
    mirrored = metal * M + back * (1.0 - M) * mean(model.specular_color) + 0.01
    near, far = even + near + 0.01, far + passed
    if model.geometry_thin_walled:
        far = far + 0.01 * (1.0 - M)
    elif model.refracts:  # a weight of 0 gives the same probabilities as a shader without this lobe
        far = far + where(T > 0.0, 0.01 * (1.0 - M), 0.0)
    mirrored, refracted, near, far = (left * share for share in (mirrored, refracted, near, far))
    total = 1.0 / (fuzz + coat + mirrored + refracted + near + far)
    return Shares(*(share * total for share in (fuzz, coat, mirrored, refracted, near, far)))


def density_of(model: _OpenPBR, shares: Shares, wo: Direction, wi: Direction) -> Scalar:
    """The mixture of the lobes' densities, weighted by their probabilities."""
    b = model.derived
    pair = lobes.sides(model, wo, wi)
    o, i = pair.wo, pair.wi
    h, _ = facet(o, i)
    ndf = distribution("ggx")
    smooth = model.smooth(b.alpha, "specular_roughness")
    mirrored = lobe_value(0.25 * ndf.visible_per_cosine(o, h, b.alpha), smooth, None)
    cosine = i.z * inv_pi
    density = shares.mirrored * mirrored + shares.near * cosine
    if model.has("coat_weight"):
        coat = 0.25 * ndf.visible_per_cosine(o, h, b.coat_alpha)
        density = density + shares.coat * lobe_value(coat, model.smooth(b.coat_alpha, "coat_roughness"), None)
    if model.has("fuzz_weight"):
        density = density + shares.fuzz * layers.fuzz_lobe(model).pdf(o, i)
    if not model.two_faced:
        return where(pair.near, density, 0.0)
    if model.geometry_thin_walled:
        through = shares.refracted * mirrored
    else:
        glass = lobes.interface(model)
        eta = glass._relative_eta(wo)
        at = glass._facet(wo, wi, eta)
        through = shares.refracted * lobe_value(where(at.reflects, 0.0, glass._density(at, eta)), smooth, None)
    through = through + shares.far * cosine
    return where(pair.near, density, where((wo.z != 0.0) & (wi.z != 0.0), through, 0.0))


def drawn(model: _OpenPBR, wo: Direction, u: Direction, mode: Mode) -> Sample:
    """A sample of the lobe that u.x selects."""
    b, shares = model.derived, shares_at(model, wo)
    pick = u.x
    if model.has_holes():
        covered = u.x < model.geometry_opacity
        pick = minimum(safe_div(u.x, model.geometry_opacity), ALMOST_ONE)
    o = upper(wo) if model.two_faced else wo
    o = where(o.z > 0.0, o, frame.normal_like(o))
    ends = [shares.fuzz]
    for share in shares[1:]:
        ends.append(ends[-1] + share)
    on_fuzz, on_coat = pick < ends[0], (pick >= ends[0]) & (pick < ends[1])
    on_facets, on_refracted = (pick >= ends[1]) & (pick < ends[2]), (pick >= ends[2]) & (pick < ends[3])
    on_near = (pick >= ends[3]) & (pick < ends[4])
    alpha = vec2(where(on_coat, b.coat_alpha.x, b.alpha.x), where(on_coat, b.coat_alpha.y, b.alpha.y))
    m = distribution("ggx").sample_visible(o, u.y, u.z, alpha)
    smooth = model.smooth(b.alpha, "specular_roughness")
    smooth_coat = model.smooth(b.coat_alpha, "coat_roughness") if model.has("coat_weight") else None
    ideal, probability = None, ops.zeros_like(pick)  # rays on smooth facets, and the probability of their direction
    for mirror, here, joins, share in (
        (smooth_coat, on_coat, on_coat | on_facets, shares.coat),
        (smooth, on_facets, on_coat | on_facets, shares.mirrored),
        (smooth, on_refracted, on_refracted, shares.refracted),
    ):
        if mirror is not None:
            ideal = here & mirror if ideal is None else ideal | (here & mirror)
            probability = probability + where(joins & mirror, share, 0.0)
    if ideal is not None:
        m = where(ideal, frame.normal_like(o), m)
    mirrored = frame.reflect(o, m)
    cosine = square_to_cosine_hemisphere(u.y, u.z)
    wi = where(on_coat | on_facets, mirrored, cosine)
    valid = wi.z > 0.0
    if model.has("fuzz_weight"):
        wi = where(on_fuzz, layers.fuzz_lobe(model).sample(o, u, mode).wi, wi)
        valid = wi.z > 0.0
    if model.two_faced:
        far = ~on_fuzz & ~on_coat & ~on_facets & ~on_near
        bent, passes = _transmitted(model, wo, o, m, mirrored)
        below = vec3(wi.x, wi.y, -wi.z)
        wi = where(on_refracted, bent, where(far, below, wi))
        valid = where(on_refracted, passes, where(far, wi.z < 0.0, valid))
        wi = where(wo.z < 0.0, -wi, wi)
    density = density_of(model, shares, wo, wi)
    if ideal is not None:
        density = where(ideal, probability, density)
    density = where(valid, density, 0.0)
    weight = lobes.surface(model, wo, wi, mode, ideal) * safe_div(1.0, density)
    one = ops.ones_like(density)
    eta = one
    if model.refracts:
        eta = where(wo.z * wi.z > 0.0, one, where(wo.z >= 0.0, b.eta, 1.0 / b.eta))
    delta = density != density if ideal is None else ideal & valid
    sample = Sample(wi, weight, density, delta, eta)
    return _with_holes(model, wo, sample, covered) if model.has_holes() else sample


def _transmitted(
    model: _OpenPBR, wo: Direction, o: Direction, m: Direction, mirrored: Direction
) -> tuple[Direction, Mask]:
    """The direction refracted by a facet with normal m, and whether there is one."""
    if model.geometry_thin_walled:
        return vec3(mirrored.x, mirrored.y, -mirrored.z), mirrored.z > 0.0
    b = model.derived
    eta = where(wo.z >= 0.0, b.eta, 1.0 / b.eta)
    cos_t = fresnel.cos_transmitted(ops.dot(o, m), eta)
    bent = frame.refract(o, m, cos_t, eta)
    return bent, (cos_t > 0.0) & (bent.z < 0.0)


def _with_holes(model: _OpenPBR, wo: Direction, sample: Sample, covered: Mask) -> Sample:
    """The sample on the covered part of the surface; elsewhere light passes straight through."""
    one = ops.ones_like(sample.pdf)
    return Sample(
        where(covered, sample.wi, -wo),
        where(covered, sample.weight, one),
        where(covered, sample.pdf * model.geometry_opacity, 1.0 - model.geometry_opacity),
        ~covered | sample.delta,
        where(covered, sample.eta, one),
    )
