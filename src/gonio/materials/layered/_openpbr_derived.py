"""Values that depend only on the parameters of OpenPBR: widths, indices, means over the hemisphere."""

from __future__ import annotations

from typing import NamedTuple

from ...energy.compensation.glass import Glass
from ...energy.compensation.lobe import NOTHING, MissingEnergy
from ...energy.compensation.missing import missing_energy
from ...material import binding
from ...ops import Pair, Scalar, Spectrum, maximum, mean, ones_like, sqr, sqrt, zeros_like
from ...optics import fresnel
from ...optics.fresnel import exact
from ...optics.special import gauss
from ..microfacet.conductor import Conductor
from ..microfacet.dielectric import Dielectric
from . import _openpbr_tables as tables
from ._openpbr_formulas import averaged, colour_again, covered, over_pi, seen_by, total_of
from ._openpbr_slabs import _OpenPBR
from ._openpbr_tables import FEW_PLACES, FROM_PLACES, HATS, NODES, PLACES

STEPS = 4  # number of steps of the iteration in `balanced`
WEIGHTS = [2.0 * float(w) * x for x, w in zip(PLACES, gauss(len(PLACES))[1], strict=True)]  # of cosine-weighted means


class Other(NamedTuple):
    """Energy lost by glass facets whose reflectance differs from that of bare glass: under a film, or under a coat,
    where reflection depends on the index relative to the coat, and refraction on that relative to the outside. The loss
    is M + sum_j less_j D_j, where M is the loss of bare glass, D_j is `spared`, and j is an index into `FEW_PLACES`.

    less         difference of F from that of bare glass, at `FEW_PLACES`
    thin, dense  mean of the loss, from outside and from inside
    into, out    fraction of the lost light that passes to the other side (`compensation.glass`)
    """

    less: tuple[Spectrum, ...]
    thin: Spectrum
    dense: Spectrum
    into: Spectrum
    out: Spectrum


class Between(NamedTuple):
    """Values that depend only on the parameters.

    alpha        widths of the base, roughened by the coat, along x and y
    rough        roughness of the base; the square root of alpha if it is isotropic
    coat_alpha   widths of the coat
    ratio        index for the base's reflection, relative to the medium above it, at least 1
    eta          index for the base's refraction, relative to the outside
    medium       index of the medium above the base, relative to the outside
    sheer        fraction of diffuse light that the base's surface transmits: the mean of 1 minus its albedo
    joint        fraction of diffuse light that the surfaces of base and coat transmit together, divided by `sheer`
    bent         relative deviations from the means of 1 minus the albedo, for the base and for base and coat together,
                 at nodes of the cosine, each times the weight of the node
    filmed       change of F by the film at `PLACES`; empty without a film
    extra        mean of `filmed` over cosines and channels
    facets       factor on the lobe of facets under the coat, at nodes of the cosine; empty without a coat
    returned     mean loss of a dielectric's facets relative to white facets, which the body below receives
    metal        energy lost by single scattering at F = 1
    metal_again  color of a metal's compensation
    sheet_again  colors of a thin sheet's compensation, reflected and transmitted
    glass        energy lost by bare glass; None if nothing is transmitted
    other        correction of that loss for the actual reflectance of the glass; None if it is bare
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


def derive(model: _OpenPBR) -> Between:
    """Widths and indices, means over the hemisphere, and multiple scattering between facets."""
    rough = model.roughened()
    alpha = model.widths(rough, model.specular_roughness_anisotropy)
    coat_alpha = model.widths(model.coat_roughness, model.coat_roughness_anisotropy)
    ratio, eta, medium = model.indices()
    zero, white = zeros_like(model.base_color), ones_like(model.base_color)
    two = model.anisotropic
    kind = Conductor(alpha=(0.1, 0.2) if two else 0.1, fresnel="one", masking=model.masking)
    values = {"eta": zero, "k": zero, "alpha": alpha, "rotation": None, "albedo": white}
    metal = missing_energy(binding.bound_copy(kind, values))
    bare, filmed, extra = at_places(model, ratio, eta, medium)
    weights = [4.0 * w * x**3 for x, w in zip(NODES, gauss(len(NODES))[1].tolist(), strict=True)]
    under = kept_at_nodes(model, rough, ratio, filmed)
    over = [1.0 - E for E in tables.reflected_at_nodes(model.coat_roughness, model.coat_ior, model.masking)]
    over_hats, over = over[:HATS], over[HATS:]
    facets: tuple[Scalar, ...] = ()
    returned = zeros_like(rough)
    if model.has("coat_weight"):
        facets = balanced(model, rough, over_hats)
        returned = returned_less(model, rough, ratio, over_hats, facets)
    total = total_of(weights)
    sheer = total_of([one * (w / total) for one, w in zip(under, weights, strict=True)])
    both = [one * other for one, other in zip(under, over, strict=True)]
    joint = total_of([one * (w / total) for one, w in zip(both, weights, strict=True)])
    bent = tuple(
        tuple(mean(one / level - 1.0) * w for one, w in zip(parts, weights, strict=True))
        for parts, level in ((under, sheer), (both, joint))
    )
    f_metal = mean_of_metal(model, eta, medium, bool(filmed))
    sheet = colors_of_sheet(model, bare, filmed, rough, eta) if model.geometry_thin_walled else None
    glass, other = None, None
    if model.refracts:
        glass = missed_by_glass(model, eta, alpha)
        if filmed or model.has("coat_weight"):
            other = misses_otherwise(model, glass, bare, filmed, rough, eta)
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
        metal_again=colour_again(f_metal, metal.average),
        sheet_again=sheet,
        glass=glass,
        other=other,
    )


def mean_of_metal(model: _OpenPBR, eta: Scalar, medium: Scalar, filmed: bool) -> Spectrum:
    """Mean over the hemisphere of the metal's F, including its film if there is one; 1 without a metal."""
    if not model.has("base_metalness"):
        return ones_like(model.base_color)
    f_metal = averaged([model.bare_metal(x + zeros_like(eta)) for x in PLACES])
    if filmed:
        few = [x + zeros_like(eta) for x in FEW_PLACES]
        f_metal = f_metal + averaged([model.metal(x, eta, medium) - model.bare_metal(x) for x in few])
    return f_metal


def colors_of_sheet(
    model: _OpenPBR, bare: list[Scalar], filmed: tuple[Spectrum, ...], rough: Scalar, eta: Scalar
) -> tuple[Spectrum, Spectrum]:
    """Mean colors of the light that a thin sheet reflects and transmits."""
    f = [ones_like(model.base_color) * one for one in bare]
    if filmed:
        f = [one + more for one, more in zip(f, filmed, strict=True)]
    both_ways = [model.sheet(x + zeros_like(rough), one, eta) for x, one in zip(PLACES, f, strict=True)]
    return averaged([back for back, _ in both_ways]), averaged([on for _, on in both_ways])


def missed_by_glass(model: _OpenPBR, eta: Scalar, alpha: Pair) -> Glass:
    """The energy lost by single scattering in bare glass of index eta."""
    kind = Dielectric(alpha=(0.1, 0.2) if model.anisotropic else 0.1, masking=model.masking)
    zero, white = zeros_like(model.base_color), ones_like(model.base_color)
    values = {"eta": eta, "alpha": alpha, "rotation": None, "albedo": white, "absorption": zero}
    lost = missing_energy(binding.bound_copy(kind, {**values, "priority": zeros_like(eta)}))
    assert isinstance(lost, Glass), "a dielectric's"
    return lost


def at_places(
    model: _OpenPBR, ratio: Scalar, eta: Scalar, medium: Scalar
) -> tuple[list[Scalar], tuple[Spectrum, ...], Scalar]:
    """F of the bare dielectric at `PLACES`, its change by a film there, and the mean of that change."""
    cosines = [x + zeros_like(ratio) for x in PLACES]
    bare = [exact.dielectric(cos, fresnel.cos_transmitted(cos, ratio), ratio) for cos in cosines]
    if not model.has("thin_film_weight"):
        return bare, (), zeros_like(ratio)
    filmed = tuple(model.clear_film(cos, eta, medium) * model.thin_film_weight for cos in cosines)
    return bare, filmed, mean(averaged(list(filmed)))


def misses_otherwise(
    model: _OpenPBR, glass: Glass, bare: list[Scalar], filmed: tuple[Spectrum, ...], rough: Scalar, eta: Scalar
) -> Other:
    """The energy lost by glass under a film or a coat, as a correction of that lost by bare glass of index eta."""
    white = ones_like(model.base_color)
    less, reflected = [], white * fresnel.kind("exact").dielectric_average(eta)
    for n, (x, one, weight) in enumerate(zip(PLACES, bare, WEIGHTS, strict=True)):
        cos = x + zeros_like(eta)
        known = exact.dielectric(cos, fresnel.cos_transmitted(cos, eta), eta)
        less.append(white * (one - known) + filmed[n] if filmed else white * (one - known))
        reflected = reflected + less[-1] * weight
    few = tuple(total_of([one * share for one, share in zip(less, row, strict=True)]) for row in FROM_PLACES)
    shares = tables.spared_on_average(rough, eta, model.masking)
    count = len(few)
    thin, dense = (
        maximum(over_pi(side.true_scale) + total_of([one * d for one, d in zip(few, part, strict=True)]), 2.0 * NOTHING)
        for side, part in ((glass.thin, shares[:count]), (glass.dense, shares[count:]))
    )
    enters = (1.0 - reflected) / (thin + dense)
    return Other(few, thin, dense, enters * dense, enters * thin / sqr(eta))


def kept_at_nodes(model: _OpenPBR, rough: Scalar, ratio: Scalar, filmed: tuple[Spectrum, ...]) -> list[Spectrum]:
    """1 - E of the base's dielectric surface at the cosines whose square roots are `NODES`."""
    kept_of = []
    E_of = tables.reflected_at_nodes(rough, ratio, model.masking)[HATS:]
    faced = tables.faced_at_nodes(rough, model.masking) if filmed else [()] * len(E_of)
    for E, shares in zip(E_of, faced, strict=True):
        kept_of.append(1.0 - covered(E + zeros_like(model.base_color), filmed, shares))
    return kept_of


def balanced(model: _OpenPBR, rough: Scalar, transmitted: list[Scalar]) -> tuple[Scalar, ...]:
    """The solution w of w(o) int w(i) P(o, i) di = 1 - E_coat(o) at nodes of the cosine, where P is the scattering by
    white facets.

    It is computed by damped steps of Sinkhorn's iteration. The initial w is that of facets that scatter a fraction b of
    the light uniformly and mirror the rest, w [(1 - b) w + b q] = 1 - E_coat, where b increases toward grazing angles
    and q is w at the cosine of most of the light.

    transmitted  1 - E_coat at the nodes
    """
    rows, w = tables.scattered_at_nodes(rough, model.masking), []
    q = sqrt(transmitted[round(0.67 * (HATS - 1))])  # at the cosine of most of the light
    for n, one in enumerate(transmitted):
        cos = (n / (HATS - 1.0)) ** 2
        b = sqr(rough) / (sqr(rough) + cos + 1e-3)
        w.append(2.0 * one / (b * q + sqrt(sqr(b * q) + 4.0 * (1.0 - b) * one + 1e-12)))
    for _ in range(STEPS):
        gathered = [total_of([p * one for p, one in zip(row, w, strict=True)]) for row in rows]
        w = [sqrt(one * share / maximum(m, 1e-4)) for one, share, m in zip(w, transmitted, gathered, strict=True)]
    return tuple(w)


def returned_less(
    model: _OpenPBR, rough: Scalar, ratio: Scalar, transmitted: list[Scalar], facets: tuple[Scalar, ...]
) -> Scalar:
    """The cosine-weighted mean of E (1 - E_coat - w <w>), with <w> from `seen_by`: see `returned` of `Between`."""
    E_of = tables.reflected_at_nodes(rough, ratio, model.masking)[:HATS]
    rows = tables.scattered_at_nodes(rough, model.masking)
    less = []
    for n, (E, one, w, row) in enumerate(zip(E_of, transmitted, facets, rows, strict=True)):
        cos = (n / (HATS - 1.0)) ** 2 + zeros_like(rough)
        less.append(E * (one - w * seen_by(cos, ratio, row, facets)) * tables.means()[n])
    return total_of(less)
