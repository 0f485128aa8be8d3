"""Light between a coat and the material under it: what the base sends back through the coat, bounce after bounce.

Light that the base scatters along w leaves the coat by the share T(w) t(w), and comes down again by k(w) = (1 - T(w))
t(w)^2, mirrored: T is the interface's transmittance from inside, t what is left of the light after one crossing. With B
the base, all that leaves is the series B + B k B + B k B k B + ...

Its sum is found for the *white* base (`BSDF.white`), averaged over azimuth, on 33 directions: rows of a matrix P are
drawn by the base's own `sample`, k stands inside the sum, and X = (1 - P)^-1 E1 solves the series, E1 being what leaves
after the first bounce. A smooth interface sends light in along one direction; of a rough one, glass whose lost light
Kulla and Conty give back, samples say where light goes in and how much comes out. What leaves, B(o), is then shared
between two terms whose sum is exactly that:

    lobe       the base's own, refracted: as much of it as fits under B at every o. Over Lambert that is all there is
               (Saunderson1942), and nearly all of a narrow lobe under a smooth coat
    rest(o)    what is left, as a separable lobe rest(o) rest(i), reciprocal like Kulla-Conty's

Light returns to the base several times, so a colour a of the base enters the lobe as a / (1 - a k), and the rest as
phi(a) = a (1 - b) + b a^2 (1 - p) / (1 - a p), which is 1 at a = 1: b of it bounces twice at least, and p is found from
the series of a grey base.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..models import BSDF, guide_search, tree
from ..models.dielectric import Dielectric
from ..models.microfacet import SMOOTH
from ..models.parameters import pair_of
from ..ops import Table, backend
from .albedo.directional import albedo
from .materials.kulla_conty import KullaConty

Floats: TypeAlias = "NDArray[np.floating]"

HALF = 16  # steps of the directions that leave, and of those that cannot
POINTS = 1 << 13  # directions drawn at each node
NODES = 97  # of the tables, at equal steps of the root of the cosine outside: R bends like it at grazing angles
ROUGH = 33  # of those at which a rough interface is drawn from
LEFT = (0.1, 0.4, 0.7, 0.9, 1.0)  # of the light after one crossing: a polynomial through these
KEPT = 32  # accounts in memory
LEAST = 1e-9


class Account(NamedTuple):
    """What a coat must know of its inside, as tables. A polynomial has coefficients of 1 to u^4, u being what one
    crossing leaves straight down: it holds for every channel of a colour.

    coat   over the root of the cosine outside, 0 to 1: the interface's albedo R, the share of the base's light that is
           reflected totally, the crossing of a rough interface for the base's lobe, and R's part beyond one bounce
    rest   likewise: the separable lobe, a polynomial in u^4, then its b and p, parabolas in u
    again  one texel: k, b, p and the lobe's factor, polynomials
    """

    coat: Table
    rest: Table
    again: Table


class Coated(Protocol):
    """What is asked of a coat here: plain values."""

    base: BSDF
    index: object
    alpha: object
    ndf: str
    masking: str


_kept: OrderedDict[object, Account] = OrderedDict()


def account_of(coat: BSDF) -> Account:
    """The account of a coat as it was made, found once and kept; InputError while Dr.Jit records a loop."""
    own = vars(coat).get("_account")
    if own is None:
        key = tree.replace(guide_search.plain_values(coat.white()), {"depth": 1.0})  # the rest changes no table
        if key not in _kept:
            if backend.drjit().flag(backend.drjit().JitFlag.SymbolicScope):
                what = f"what lies under {type(coat).__name__} cannot be found inside a loop"
                raise InputError(what, "eval", "call its `eval` once before the loop")
            _kept[key] = find(key)  # type: ignore[arg-type]
            while len(_kept) > KEPT:
                _kept.popitem(last=False)
        vars(coat)["_account"] = own = _kept[key]
    found: Account = own
    return found


def find(coat: Coated) -> Account:
    """The account of a white coat, one value each."""
    index = float(coat.index)  # type: ignore[arg-type]
    outside = np.linspace(0.0, 1.0, NODES) ** 2
    face = _interface(coat, index)
    if coat.base.delta == "always":
        columns = [face.reflected(outside), 0.0 * outside, 1.0 - face.reflected(outside), face.beyond(outside)]
        count = len(LEFT)
        none = Table("coat_rest", np.zeros((NODES, count + 6)))
        return Account(Table("coat", np.stack(columns, -1)), none, Table("coat_again", np.zeros((1, 4 * count))))
    seen = _drawn(coat.base, index)
    totally = (seen.weight * (seen.position <= 0.0)).sum(1) / np.maximum(seen.weight.sum(1), LEAST)
    sums = [_series(seen, u, face, index) for u in LEFT]
    columns = [
        face.reflected(outside),
        np.interp(outside, seen.place, totally),
        face.lobe(outside),
        face.beyond(outside),
    ]
    some = [1, 3, 4]  # of `LEFT`: a parabola in u
    powers = np.array(LEFT)[some][:, None] ** np.arange(3)
    bounces = np.tensordot(np.linalg.inv(powers), np.array([sums[n].bounces for n in some]), 1)
    bounces = np.moveaxis(bounces, 0, -1).reshape(NODES, 6)
    rest = np.concatenate([_positive(np.array([one.rest for one in sums])), bounces], axis=-1)
    again = _polynomial(np.array([[one.k, *one.mean, one.lobe] for one in sums]))
    return Account(
        Table("coat", np.stack(columns, -1)), Table("coat_rest", rest), Table("coat_again", again.reshape(1, -1))
    )


class _Curve(Protocol):
    def __call__(self, cosine: Floats, /) -> Floats: ...


class _Interface(NamedTuple):
    """The coat's surface.

    reflected  R seen from outside, by the cosine outside
    out        T from inside, by the place (`_Seen.place`)
    beyond     square root, normalized, of what R is beyond the facets' first reflection
    entering   None of a smooth one; else, for `ROUGH` places outside, weights, cosines and places of draws inside
    """

    reflected: _Curve
    out: _Curve
    beyond: _Curve
    entering: tuple[Floats, Floats, Floats] | None

    def lobe(self, x: Floats) -> Floats:
        """The crossing that the base's lobe makes at each end: a narrow one makes T(o) going in and T(i) coming out."""
        found: Floats = np.sqrt((1.0 - self.reflected(x)) * self.out(np.maximum(x, LEAST)))
        return found


def _interface(coat: Coated, index: float) -> _Interface:
    glass = Dielectric(index, coat.alpha, ndf=coat.ndf, masking=coat.masking)  # type: ignore[arg-type]
    x_width, y_width = (float(width) for width in pair_of(coat.alpha))
    if max(x_width, y_width) < SMOOTH or index < 1.0 + 1e-5:

        def fresnel(cos: Floats) -> Floats:
            cos = np.maximum(cos, LEAST)
            cos_t = np.sqrt(1.0 - (1.0 - cos**2) / index**2)
            r_s = (cos - index * cos_t) / (cos + index * cos_t)
            r_p = (index * cos - cos_t) / (index * cos + cos_t)
            found: Floats = 0.5 * (r_s**2 + r_p**2)
            return found

        return _Interface(fresnel, lambda p: np.where(p > 0.0, 1.0 - fresnel(p), 0.0), lambda x: 0.0 * x, None)
    surface = KullaConty(glass)
    root = np.linspace(0.0, 1.0, ROUGH)
    lattice = _lattice(POINTS)
    wo, u = _directions(np.maximum(root**2, 1e-4), lattice), np.tile(lattice[:, :3], (ROUGH, 1))
    up = surface.sample(wo, u, "importance", "float64")
    weight = np.where(up.pdf > 0.0, up.weight.mean(1), 0.0).reshape(ROUGH, POINTS)
    weight /= weight.sum(1, keepdims=True)
    cosine = up.wi[:, 2].reshape(ROUGH, POINTS)
    R = (weight * (cosine > 0.0)).sum(1)
    goes_in = np.where(cosine < 0.0, weight, 0.0)
    inside = np.clip(-cosine, 1e-4, 1.0)
    place, mu = _places(index)
    down = surface.sample(-_directions(mu, lattice), np.tile(lattice[:, :3], (len(mu), 1)), "importance", "float64")
    weight = np.where(down.pdf > 0.0, down.weight.mean(1), 0.0).reshape(len(mu), POINTS)
    leaves = (weight * (down.wi[:, 2] > 0.0).reshape(len(mu), POINTS)).sum(1) / weight.sum(1)
    # R is that of one reflection, by quadrature, and what is beyond it
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
        (goes_in, inside, _place_of(inside, index)),
    )


def _lattice(count: int) -> Floats:
    """R4, powers of x^5 = x + 1."""
    return np.arange(1, count + 1)[:, None] * 1.1673039782614187 ** -np.arange(1.0, 5.0) % 1.0


def _directions(mu: Floats, lattice: Floats) -> Floats:
    """Directions of each cosine at the lattice's azimuths, (len(mu) * len(lattice), 3)."""
    phi, sin = np.tile(2.0 * np.pi * lattice[:, 3], len(mu)), np.repeat(np.sqrt(1.0 - mu**2), len(lattice))
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), np.repeat(mu, len(lattice))], -1)


def _places(index: float) -> tuple[Floats, Floats]:
    """(places, cosines inside) of the nodes: the cosine outside where light leaves, -1 to 0 where it cannot."""
    place = np.linspace(-1.0, 1.0, 2 * HALF + 1)
    critical = np.sqrt(max(1.0 - index**-2, 0.0))
    mu = np.where(place >= 0.0, np.sqrt(1.0 - (1.0 - place**2) / index**2), critical * (1.0 + place))
    return place, np.clip(mu, 1e-4, 1.0)


def _place_of(cosine: Floats, index: float) -> Floats:
    """The place of directions inside, by their cosines."""
    outside2 = 1.0 - index**2 * (1.0 - cosine**2)
    critical = np.sqrt(max(1.0 - index**-2, 0.0))
    place = np.where(outside2 > 0.0, np.sqrt(np.maximum(outside2, 0.0)), cosine / max(critical, LEAST) - 1.0)
    return np.clip(place, -1.0, 1.0)


class _Seen(NamedTuple):
    """What the white base does with light inside.

    place, mu           of the nodes
    weight              of each draw at each node (nodes, POINTS)
    cosine, position    of the directions drawn, and their places
    """

    place: Floats
    mu: Floats
    weight: Floats
    cosine: Floats
    position: Floats


def _drawn(white: BSDF, index: float) -> _Seen:
    """Draws of the base's own sampling from the nodes, over all azimuths."""
    place, mu = _places(index)
    lattice = _lattice(POINTS)
    drawn = white.sample(_directions(mu, lattice), np.tile(lattice[:, :3], (len(mu), 1)), precision="float64")
    weight = np.where(drawn.pdf > 0.0, drawn.weight.mean(1), 0.0).reshape(len(mu), POINTS) / POINTS
    weight /= np.maximum(weight.sum(1, keepdims=True), 1.0)  # a base that gains light would do so without end
    cosine = np.clip(drawn.wi[:, 2], 1e-4, 1.0).reshape(len(mu), POINTS)
    return _Seen(place, mu, weight, cosine, _place_of(cosine, index))


class _Sum(NamedTuple):
    """The series at one u: see `Account`; the rest, and its (b, p), at the tables' nodes."""

    k: float
    mean: tuple[float, float]
    lobe: float
    rest: Floats
    bounces: Floats


def _series(seen: _Seen, u: float, face: _Interface, index: float) -> _Sum:
    """The series, summed and shared out."""
    n = len(seen.place)
    out, t = face.out(seen.position), u ** (1.0 / seen.cosine)
    out = np.where((seen.position <= 0.0) & (face.entering is None), 0.0, out)
    down = seen.weight * (1.0 - out) * t**2
    first = (seen.weight * out * t).sum(1)
    scaled = (seen.position + 1.0) * HALF
    cell = np.minimum(scaled, n - 1 - LEAST).astype(int)
    part, row = scaled - cell, np.arange(n)[:, None] * n
    P = np.bincount((row + cell).ravel(), (down * (1.0 - part)).ravel(), n * n)
    P += np.bincount((row + cell + 1).ravel(), (down * part).ravel(), n * n)
    # a perfect mirror keeps forever what it reflects totally, though nothing gets there
    every, half = (a * np.linalg.solve(np.eye(n) - a * P.reshape(n, n) * (1.0 - LEAST), first) for a in (1.0, GREY))

    # what leaves in all, of a grey base, and after one bounce, by the cosine outside
    x = np.linspace(0.0, 1.0, NODES) ** 2
    through = u ** (1.0 / np.interp(x, seen.place, seen.mu))
    if face.entering is None:
        kinds = [(1.0 - face.reflected(x)) * through * np.interp(x, seen.place, v) for v in (every, half, first)]
    else:
        weight, cosine, place = face.entering
        left = weight * u ** (1.0 / cosine)
        drawn = [(left * np.interp(place, seen.place, v)).sum(1) for v in (every, half, first)]
        kinds = [np.interp(np.sqrt(x), np.linspace(0.0, 1.0, ROUGH), one) for one in drawn]
    leaves, grey, once = kinds

    # the base's own lobe, refracted
    open_ = np.maximum(seen.position, 0.0)
    lobe = (seen.weight * np.where(seen.position > 0.0, face.lobe(open_), 0.0) * t).sum(1)
    lobe = face.lobe(x) * through * np.interp(x, seen.place, lobe)
    judged = (x > 1e-3) & (lobe > 1e-6)  # at the horizon both vanish
    factor = float(np.min((leaves / np.maximum(lobe, LEAST))[judged], initial=1e3))
    lone = min(float(np.min((once / np.maximum(lobe, LEAST))[judged], initial=1.0 + 1e3)), factor)  # of a smooth coat 1
    k = 1.0 - lone / max(factor, LEAST)
    rest = np.maximum(leaves - factor * lobe, 0.0)
    root = np.linspace(0.0, 1.0, NODES)
    area = np.gradient(root) * 2.0 * root**3  # x dx
    norm = 2.0 * np.pi * float(area @ rest)
    if norm < 1e-7:
        return _Sum(k, (0.0, 0.0), lone, 0.0 * rest, np.zeros((NODES, 2)))
    left_grey = np.maximum(grey - lone * lobe * GREY / (1.0 - GREY * k), 0.0)
    blurred = np.maximum(once - lone * lobe, 0.0)
    mean = _bounces(area @ rest, area @ left_grey, area @ blurred)
    each = _bounces(np.maximum(rest, 1e-6), left_grey, blurred)
    return _Sum(k, (float(mean[0]), float(mean[1])), lone, rest / np.sqrt(norm), np.stack(each, -1))


GREY = 0.8  # the albedo at which colours are met


def _bounces(rest: Floats, grey: Floats, once: Floats) -> tuple[Floats, Floats]:
    """(b, p) of the rest, from its value at a = 1, at `GREY`, and what of it bounced once."""
    b = 1.0 - np.clip(once / rest, 0.0, 1.0)
    ratio = np.clip((grey / rest - GREY * (1.0 - b)) / np.maximum(b * GREY**2, 1e-3), 0.02, 1.0)
    return b, np.clip((1.0 - ratio) / (1.0 - GREY * ratio), 0.0, 0.99)


def _positive(values: Floats) -> Floats:
    """As `_polynomial`, in u^4, as light that bounces often fades fast with u, and by Bernstein's polynomials with no
    coefficient below 0: no light is negative between the nodes."""
    degree, u = len(LEFT) - 1, np.array(LEFT) ** 4
    n = np.arange(degree + 1)
    basis = u[:, None] ** n * (1.0 - u[:, None]) ** (degree - n)
    sure = np.where(u == 1.0, 1e3, 1.0)  # without absorption nothing may be lost
    from scipy.optimize import nnls  # late: a picture whose tables are there shall not wait for it

    weights = np.array([nnls(basis * sure[:, None], column * sure)[0] for column in values.T])
    to_powers = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        for j in range(degree - k + 1):
            to_powers[k, k + j] = (-1) ** j * math.comb(degree - k, j)
    return weights @ to_powers


def _polynomial(values: Floats) -> Floats:
    """Coefficients of 1 to u^4, last, through values at `LEFT`, first."""
    powers = np.array(LEFT)[:, None] ** np.arange(len(LEFT))
    return np.moveaxis(np.tensordot(np.linalg.inv(powers), values, 1), 0, -1)
