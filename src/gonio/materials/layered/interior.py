"""Interreflections between a coat and the base below it.

When the base scatters light along w, the fraction T(w) t(w) of it leaves the coat, and the fraction
k(w) = (1 - T(w)) t(w)^2 returns to the base, mirrored. T is the transmittance of the interface from inside, and t is
that of one crossing of the coat. With the scattering operator B of the base, the light that leaves is the sum of the
series B + B k B + B k B k B + ...

The sum is computed for 33 directions, averaged over azimuth: the rows of a matrix P, which includes k, are sampled with
the lossless variant of the base (`BSDF.lossless`), and X = (1 - P)^-1 E1 solves the series, where E1 is the light that
leaves after the first bounce. A smooth interface transmits light along one direction. A rough interface is glass with
Kulla-Conty compensation, for which samples determine where light enters and how much of it leaves.

The Fresnel reflectance of the base is known for each of its channels: with every albedo set to 1, its values are
computed at the samples of the lossless variant. For any other color, it is interpolated between these channels, black
and white. The series is therefore valid for every channel of a metal, including the rise of its reflectance at grazing
angles, and for any color by which the rest of the base varies.

The light that leaves toward o is then divided into two terms whose sum is exact:

    lobe         the base's own lobe, refracted, times the largest factor for which it does not exceed this light at any
                 o. This is all of the light for a Lambertian base (Saunderson1942), and nearly all of it for a narrow
                 lobe under a smooth coat
    rest(o)      the remainder, as a separable lobe rest(o) rest(i) / norm, reciprocal like that of Kulla-Conty

Both terms are tables over the color a and over u, the transmittance of one crossing at normal incidence.
"""

from __future__ import annotations

import functools
from collections import OrderedDict
from typing import NamedTuple, Protocol

import numpy as np

from ... import ops
from ...energy.albedo.directional import albedo
from ...errors import InputError
from ...material import BSDF, tree
from ...material.parameters import pair_of
from ...ops import Direction, Spectrum, Table, backend
from ...ops.backend import Array
from ...optics.fresnel import exact
from ...optics.lattice import r_sequence
from ...optics.roughness import SMOOTH
from ..compensated.kulla_conty import KullaConty
from ..microfacet.dielectric import Dielectric
from ._nodes import EPSILON, Floats, Spread, at_nodes, directions, place_of, places

POINTS = 1 << 13  # samples per node
NODES = 97  # nodes of the tables, at equal steps of the root of the cosine outside, to resolve R at grazing angles
ROUGH = 33  # nodes at which a rough interface is sampled
COLOURS, LEFT = 13, 13  # steps of the color and of the transmittance u, see `colour_place` and `left_place`
MIN_LEFT = 0.03  # the smallest u, the first step
CACHE_SIZE = 32  # maximum number of sets of tables in memory


class LayerTables(NamedTuple):
    """The coat's interior as tables.

    coat     as a function of the square root of the cosine outside: the albedo R of the interface, the fraction of the
             base's samples to be replaced by a cosine, the transmittance of a rough interface for the base's lobe, and
             `_Interface.beyond`
    rest     as a function of that root, `colour_place` and `left_place`: the separable lobe divided by a u^2; None if
             there is none
    bounced  as a function of the latter two: 1 / factor of the lobe, and the norm of the separable lobe divided by
             a u^2
    """

    coat: Table
    rest: Table | None
    bounced: Table


def colour_place(a: Array) -> Array:
    """The coordinate of a color in the tables: a series 1 / (1 - a k) is nearly linear in a / (2 - a), and exactly
    linear for k = 1 / 2."""
    return a / (2.0 - a)


def left_place(u: Array) -> Array:
    """The coordinate of the transmittance u in the tables: denser near 1, where multiply reflected light decays slowly.
    u = 1 is the last node but one, so that a clear coat has a derivative with respect to its absorption."""
    return u / (3.0 - 2.0 * u) * ((LEFT - 2.0) / (LEFT - 1.0))


class Coated(Protocol):
    """The attributes of a coat that this module reads, as plain values."""

    base: BSDF
    index: object
    alpha: object
    ndf: str
    masking: str


_cache: OrderedDict[object, LayerTables] = OrderedDict()


def tables_of(coat: BSDF) -> LayerTables:
    """The tables of an unbound coat, from the cache if possible. Raises InputError if they must be computed while
    Dr.Jit records a loop."""
    own = vars(coat).get("_layer_tables")
    if own is None:
        key = _bright(tree.plain_values(coat))
        if key not in _cache:
            if backend.drjit().flag(backend.drjit().JitFlag.SymbolicScope):
                what = f"the interior of {type(coat).__name__} cannot be computed while a loop is recorded"
                raise InputError(what, "eval", "call its `eval` once before the loop")
            _cache[key] = find(key)  # type: ignore[arg-type]
            while len(_cache) > CACHE_SIZE:
                _cache.popitem(last=False)
        vars(coat)["_layer_tables"] = own = _cache[key]
    tables: LayerTables = own
    return tables


def _bright(coat: BSDF) -> BSDF:
    """The coat with fixed values of all parameters that do not affect the tables: no absorption, and every albedo in
    the base 1."""
    values: dict[str, object] = {"absorption": 0.0, "depth": 1.0, "bounces": "coloured"}
    for leaf in tree.leaves(coat):
        if leaf.parameter.numeric and leaf.parameter.white is not None and leaf.value is not None:
            values[leaf.path] = leaf.parameter.white
    return tree.replace(coat, values)


def colour_of(base: BSDF, up: Direction) -> Spectrum:
    """a, the tint of a bound base at normal incidence, divided by that of its lossless variant or, for a base that is
    its own lossless variant, by its brightest channel."""
    tint = base.tint(up)
    white = base.lossless()
    if white is base:
        return ops.safe_div(tint, functools.reduce(ops.maximum, ops.channels(tint)))
    return ops.safe_div(tint, white.tint(up))


def _colors(base: BSDF) -> Floats:
    """`colour_of` as three numbers."""
    kind = backend.types("float64")
    up = ops.vec3(kind.float(0.0), kind.float(0.0), kind.float(1.0))
    return backend.to_numpy(kind.vec3(1.0) * colour_of(base.bind(kind), up), 1)[0]


def find(coat: Coated) -> LayerTables:
    """Compute the tables of a coat with uniform values, all of whose albedos are 1."""
    index = float(coat.index)  # type: ignore[arg-type]
    outside = np.linspace(0.0, 1.0, NODES) ** 2
    face = _interface(coat, index)
    if coat.base.delta == "always":
        columns = [face.reflected(outside), 0.0 * outside, 1.0 - face.reflected(outside), face.beyond(outside)]
        once = Table("coat_again", np.array([1.0, 0.0]).reshape(1, 1, 2))
        return LayerTables(Table("coat", np.stack(columns, -1)), None, once)
    draws = _drawn(coat.base, index, face)
    t, v = np.linspace(0.0, 1.0, COLOURS), np.linspace(0.0, 1.0, LEFT - 1)
    colors = np.maximum(2.0 * t / (1.0 + t), 1e-4)
    sums = [_series(draws, colors, u, face) for u in np.maximum(3.0 * v / (1.0 + 2.0 * v), MIN_LEFT)]
    rest, over_factor, norm = (_continued([one[n] for one in sums]) for n in range(3))
    # fraction of cosine samples: those that replace totally reflected base samples, and those of the rest
    share = np.maximum(1.7 * np.interp(np.sqrt(outside), draws.place, draws.totally), 0.7 * sums[-1].share)
    columns = [face.reflected(outside), np.clip(share, 0.05, 0.95), face.lobe(outside), face.beyond(outside)]
    return LayerTables(
        Table("coat", np.stack(columns, -1)),
        Table("coat_rest", rest[..., None]) if rest.any() else None,
        Table("coat_again", np.stack([over_factor, norm], -1)),
    )


class _Curve(Protocol):
    def __call__(self, cosine: Floats, /) -> Floats: ...


class _Interface(NamedTuple):
    """The coat's surface.

    reflected  R from outside, as a function of the cosine outside
    out        T from inside, as a function of the position (`places`)
    beyond     R without the facets' first reflection, scaled so that beyond(o) beyond(i) is the lobe of this light
    entering   samples inside for `ROUGH` positions outside; None if the surface is smooth
    returning  the same for positions inside, for the light that is reflected back
    """

    reflected: _Curve
    out: _Curve
    beyond: _Curve
    entering: Spread | None
    returning: Spread | None

    def lobe(self, x: Floats) -> Floats:
        """The transmittance for the base's lobe, per direction: the geometric mean of those inward and outward."""
        crossing: Floats = np.sqrt((1.0 - self.reflected(x)) * self.out(np.sqrt(np.maximum(x, EPSILON))))
        return crossing


def _interface(coat: Coated, index: float) -> _Interface:
    glass = Dielectric(index, coat.alpha, ndf=coat.ndf, masking=coat.masking)  # type: ignore[arg-type]
    x_width, y_width = (float(width) for width in pair_of(coat.alpha))
    if max(x_width, y_width) < SMOOTH or index < 1.0 + 1e-5:

        def fresnel(cos: Floats) -> Floats:
            return exact.dielectric_array(np.maximum(cos, EPSILON), index)

        return _Interface(
            fresnel, lambda p: np.where(p > 0.0, 1.0 - fresnel(p * p), 0.0), lambda x: 0.0 * x, None, None
        )
    surface = KullaConty(glass)
    root = np.linspace(0.0, 1.0, ROUGH)
    lattice = r_sequence(POINTS, 4)
    wo, u = directions(np.maximum(root**2, 1e-4), lattice), np.tile(lattice[:, :3], (ROUGH, 1))
    up = surface.sample(wo, u, "importance", "float64")
    weight = np.where(up.pdf > 0.0, up.weight.mean(1), 0.0).reshape(ROUGH, POINTS)
    weight /= weight.sum(1, keepdims=True)
    cosine = up.wi[:, 2].reshape(ROUGH, POINTS)
    R = (weight * (cosine > 0.0)).sum(1)
    goes_in = np.where(cosine < 0.0, weight, 0.0)
    inside = np.clip(-cosine, 1e-4, 1.0)
    place, mu = places(index)
    down = surface.sample(-directions(mu, lattice), np.tile(lattice[:, :3], (len(mu), 1)), "importance", "float64")
    weight = np.where(down.pdf > 0.0, down.weight.mean(1), 0.0).reshape(len(mu), POINTS)
    weight /= weight.sum(1, keepdims=True)
    cosine = down.wi[:, 2].reshape(len(mu), POINTS)
    leaves = (weight * (cosine > 0.0)).sum(1)
    stays, returning_cosine = np.where(cosine < 0.0, weight, 0.0), np.clip(-cosine, 1e-4, 1.0)
    # R of one reflection, by quadrature, and the rest of R
    single = tree.replace(glass, {"transmission": False})
    angles = (0.0,) if x_width == y_width else (0.0, 0.25 * np.pi, 0.5 * np.pi)
    fine = np.linspace(0.0, 1.0, NODES)
    once = np.mean([albedo(single, mu=np.maximum(fine**2, 1e-4), phi=phi).value[:, 0] for phi in angles], axis=0)
    more = np.maximum(np.interp(fine, root, R) - once, 0.0)
    total = 2.0 * np.pi * np.trapezoid(more * 2.0 * fine**3, fine)
    scale = 1.0 / np.sqrt(total) if total > 1e-7 else 0.0
    return _Interface(
        lambda cos: np.interp(np.sqrt(cos), fine, once + more * (scale > 0.0)),
        lambda p: np.interp(p, place, leaves),
        lambda cos: np.interp(np.sqrt(cos), fine, more * scale),
        Spread.of(goes_in, inside, index),
        Spread.of(stays, returning_cosine, index),
    )


class _Draws(NamedTuple):
    """Samples of the lossless base for light inside the coat.

    place, mu  positions and cosines of the nodes
    samples    the samples at each node, (nodes, POINTS)
    totally    fraction of the light from each node that is totally reflected
    out        transmittance of the interface in the direction of each sample
    crossing   the same for the base's lobe
    colors     black, the base's channels and white, in ascending order
    share      factor on each sample's weight, for each of these colors
    """

    place: Floats
    mu: Floats
    samples: Spread
    totally: Floats
    out: Floats
    crossing: Floats
    colors: Floats
    share: Floats


def _drawn(base: BSDF, index: float, face: _Interface) -> _Draws:
    """Samples of the lossless base for light from the nodes' directions, over all azimuths. A base that is its own
    lossless variant is normalized to its brightest channel."""
    white = base.lossless()
    place, mu = places(index)
    lattice = r_sequence(POINTS, 4)
    wo = directions(mu, lattice)
    drawn = white.sample(wo, np.tile(lattice[:, :3], (len(mu), 1)), precision="float64")
    channels = drawn.weight
    colors, share = np.array([0.0, 1.0]), np.stack([0.0 * channels[:, 0], 1.0 + 0.0 * channels[:, 0]])
    tints = _colors(base)
    if white is base:
        channels = channels[:, np.argmax(tints)][:, None]
    else:
        own, full = (np.asarray(one.eval(wo, drawn.wi, precision="float64"), float) for one in (base, white))
        known, first = np.unique(np.round(tints, 3), return_index=True)
        known, first = known[known < 1.0], first[known < 1.0]
        ratio = np.where(full > 0.0, own / np.where(full > 0.0, full, 1.0), tints)[:, first].T
        colors = np.concatenate([[0.0], known, [1.0]])
        share = np.concatenate([share[:1], np.clip(ratio, 0.0, 1.0), share[1:]])
    weight = np.where(drawn.pdf > 0.0, channels.mean(1), 0.0).reshape(len(mu), POINTS) / POINTS
    weight /= np.maximum(weight.sum(1, keepdims=True), 1.0)  # the series would diverge for a base that gains light
    cosine = np.clip(drawn.wi[:, 2], 1e-4, 1.0).reshape(len(mu), POINTS)
    share = share.reshape(-1, len(mu), POINTS)
    position = place_of(cosine, index)
    totally = (weight * (position <= 0.0)).sum(1) / np.maximum(weight.sum(1), EPSILON)
    out = np.where((position <= 0.0) & (face.entering is None), 0.0, face.out(position))
    crossing = np.where(position > 0.0, face.lobe(np.maximum(position, 0.0) ** 2), 0.0)
    return _Draws(place, mu, Spread.of(weight, cosine, index), totally, out, crossing, colors, share)


class _Sum(NamedTuple):
    """The series at one u, per color (see `LayerTables`), and the fraction of `rest` in the light of a white base."""

    rest: Floats
    over_factor: Floats
    norm: Floats
    share: Floats


def _series(draws: _Draws, colors: Floats, u: float, face: _Interface) -> _Sum:
    """The sum of the series at one u, divided into lobe and rest, for each color."""
    n, samples = len(draws.place), draws.samples
    t = u**samples.inverse
    x = np.linspace(0.0, 1.0, NODES) ** 2
    root = np.sqrt(x)
    through = u ** (1.0 / np.interp(root, draws.place, draws.mu))
    back = None if face.returning is None else face.returning.matrix(face.returning.left(u))
    kinds = []
    for share in draws.share[1:]:  # black contributes nothing
        weight = samples.weight * share
        if back is None:  # a smooth interface reflects like a mirror
            P = samples.matrix(weight * (1.0 - draws.out) * t**2)
        else:
            P = samples.matrix(weight * t) @ back
        lobe = face.lobe(x) * through * np.interp(root, draws.place, (weight * draws.crossing * t).sum(1))
        kinds.append((P, (weight * draws.out * t).sum(1), lobe))
    if face.entering is None:
        enters = at_nodes(root, draws.place) * ((1.0 - face.reflected(x)) * through)[:, None]
    else:
        enters = at_nodes(root, np.linspace(0.0, 1.0, ROUGH)) @ face.entering.matrix(face.entering.left(u))
    area = np.gradient(root) * 2.0 * root**3  # x dx
    judged = x > 1e-3  # both vanish at the horizon
    rests, factors, norms, share = [], [], [], 0.0 * x
    for a in colors:
        mixed = [float(np.interp(a, draws.colors, one)) for one in np.eye(len(draws.colors))[1:]]
        P, first, lobe = (
            sum(m * one for m, one in zip(mixed, parts, strict=True)) for parts in zip(*kinds, strict=True)
        )
        # light totally reflected over a perfect mirror never leaves, but no light reaches these directions
        leaves = enters @ np.linalg.solve(np.eye(n) - P * (1.0 - EPSILON), first)
        some = judged & (lobe > 1e-6 * a)
        factor = float(np.min((leaves / np.maximum(lobe, EPSILON * a))[some], initial=1e3))
        rest = np.maximum(leaves - factor * lobe, 0.0)
        share = rest / np.maximum(leaves, EPSILON)
        rest = rest / (a * u * u)
        norm = 2.0 * np.pi * float(area @ rest)
        some_rest = norm > 1e-7  # smaller values are rounding errors
        rests.append(rest * some_rest)
        factors.append(1.0 / factor)
        norms.append(norm * some_rest)
    return _Sum(np.stack(rests, -1), np.array(factors), np.array(norms), share)


def _continued(values: list[Floats]) -> Floats:
    """The values at each u, stacked along the last axis and extrapolated linearly by one node."""
    return np.stack([*values, 2.0 * values[-1] - values[-2]], -1)
