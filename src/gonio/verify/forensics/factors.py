"""The table of factors that may be missing, applied twice or misplaced: products of cosines, powers of the index,
widths of a distribution, and the Fresnel term.

A factor is a function of (wo, wi). `fits` looks for the factor by which the ratio of two values must be divided, and
`crowding` for the factor by which a pdf must be multiplied to give the density of the samples.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ...errors import GonioError
from .. import directions
from ..subject import Subject
from .ratio import written

Field: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # maps (wo, wi), (N, 3) each, to (N,)


class Factor(NamedTuple):
    """A factor: its formula, the mistake that it suggests, and its values. With `of_wo`, the values hold up to a
    constant per wo."""

    formula: str
    guess: str
    field: Field
    of_wo: bool = False


class Cosine(NamedTuple):
    """A cosine or sine in the formula of a factor: the mistake that it suggests, and its values as a function of
    (wo, wi, m)."""

    guess: str
    field: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.sum(a * b, axis=1))


COSINES = {
    "(o.m)": Cosine(
        "the Jacobian of the half vector, 4 (o.m), is missing or applied twice", lambda o, i, m: _dot(o, m)
    ),
    "cos_m": Cosine(
        "the cosine of the half vector, m.z, is missing from its density or applied twice", lambda o, i, m: m[:, 2]
    ),
    "cos_i": Cosine("the cosine of wi is missing or applied twice", lambda o, i, m: i[:, 2]),
    "cos_o": Cosine("the cosine of wo is missing or applied twice", lambda o, i, m: o[:, 2]),
    "sin_i": Cosine(
        "the sine of wi, the Jacobian of spherical angles, is missing or applied twice",
        lambda o, i, m: np.hypot(i[:, 0], i[:, 1]),
    ),
    "sin_o": Cosine("the sine of wo is missing or applied twice", lambda o, i, m: np.hypot(o[:, 0], o[:, 1])),
    "(i.m)": Cosine("the Jacobian of refraction is wrong", lambda o, i, m: _dot(i, m)),
}


def half_vector(wo: np.ndarray, wi: np.ndarray, eta: np.ndarray | float = 1.0) -> np.ndarray:
    """The half vector on wo's side, of a reflection or, with eta (the index on wi's side divided by that on wo's), of a
    refraction."""
    m = wo + (eta[:, None] if isinstance(eta, np.ndarray) else eta) * wi
    m = m / np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-12)
    return m * np.copysign(1.0, np.sum(m * wo, axis=1, keepdims=True))


def values_of(names: Sequence[str], wo: np.ndarray, wi: np.ndarray, m: np.ndarray) -> np.ndarray:
    """The values of some COSINES, (N, names), clamped to be positive so that they have logarithms."""
    return np.maximum(np.abs(np.stack([COSINES[name].field(wo, wi, m) for name in names], axis=1)), 1e-9)


def product(scale: float | str, powers: Mapping[str, int]) -> str:
    """A scale times powers of cosines as a formula: "4 (o.m)", "1 / (4 (o.m))", "cos_i / cos_o"."""

    def joined(sign: int) -> list[str]:
        chosen = [(name, abs(p)) for name, p in powers.items() if p * sign > 0]
        return [name if p == 1 else f"{name}^{p}" for name, p in chosen]

    over, under = joined(1), joined(-1)
    if scale != "":
        text = written(float(scale))
        if text.startswith("1 / "):
            under.insert(0, text[4:].strip("()"))
        else:
            over.insert(0, text)
    below = under[0] if len(under) == 1 and " " not in under[0] else f"({' '.join(under)})"
    return " ".join(over) or "1" if not under else f"{' '.join(over) or '1'} / {below}"


def guess_of(names: Sequence[str]) -> str:
    """The mistakes that some COSINES suggest, by their names."""
    return " and ".join(COSINES[name].guess for name in names)


def cosines(names: Sequence[str]) -> Iterator[Factor]:
    """The factors that are products of one or two cosines of a reflection, each to the power 1 or -1."""
    for count in (1, 2):
        for which in itertools.combinations(names, count):
            for powers in itertools.product((1, -1), repeat=count):

                def field(
                    o: np.ndarray, i: np.ndarray, which: Sequence[str] = which, powers: Sequence[int] = powers
                ) -> np.ndarray:
                    values = values_of(which, o, i, half_vector(o, i))
                    return np.asarray(np.prod(values ** np.array(powers, float), axis=1))

                yield Factor(product("", dict(zip(which, powers, strict=True))), guess_of(which), field)


# --------------------------------------------------------------------------- refraction


def index_below(subject: Subject) -> Iterator[float]:
    """The index below divided by that above, from the samples and from a parameter named eta, unless it is 1."""
    if not subject.transmits:
        return
    wo = directions.on_side(directions.uniform(np.random.default_rng(4), 2048), 1)
    s = subject.sample(wo, directions.numbers(np.random.default_rng(44), 2048))
    through = (s.pdf > 0.0) & (s.wi[:, 2] < 0.0)
    if np.any(through & ~s.delta):
        through &= ~s.delta
    values = [float(np.median(s.eta[through])) if through.any() else 1.0]
    declared = getattr(subject.model, "eta", None)
    if isinstance(declared, int | float):
        values.append(float(declared))
    yield from (v for v in dict.fromkeys(values) if np.isfinite(v) and v > 0.0 and abs(v - 1.0) > 0.02)


def _across(wo: np.ndarray, eta: float) -> np.ndarray:
    """The index on the other side of the surface divided by that on wo's side, (N,)."""
    return np.where(wo[:, 2] > 0.0, eta, 1.0 / eta)


SIDES = {"": 0.0, " from outside": 1.0, " from inside": -1.0}


def indices(subject: Subject, powers: Sequence[int], guess: str, sides: Sequence[str] = ("",)) -> Iterator[Factor]:
    """The factors that are powers of the index in transmission, inverted for light from below; for both sides, or for
    one of SIDES only."""
    for eta in index_below(subject):
        for place in sides:
            for power in powers:

                def field(
                    o: np.ndarray, i: np.ndarray, eta: float = eta, side: float = SIDES[place], power: int = power
                ) -> np.ndarray:
                    through = (o[:, 2] * i[:, 2] < 0.0) & (o[:, 2] * side >= 0.0)
                    return np.where(through, _across(o, eta) ** float(power), 1.0)

                yield Factor(f"{product('', {'eta': power})} in transmission{place}", guess, field)


def normals(subject: Subject) -> Iterator[Factor]:
    """The factors for sampling visible normals instead of all normals: the ratio of their densities, without the
    masking of wo, and its inverse."""
    visible, all_ = "visible normals", "all normals"
    for eta in [*index_below(subject)] or [1.0]:
        for power, drawn, stated in ((1.0, visible, all_), (-1.0, all_, visible)):

            def field(o: np.ndarray, i: np.ndarray, eta: float = eta, power: float = power) -> np.ndarray:
                m = half_vector(o, i, np.where(o[:, 2] * i[:, 2] < 0.0, _across(o, eta), 1.0))
                above, below = values_of(("(o.m)", "cos_m"), o, i, m).T
                return np.asarray((above / below) ** power)

            formula = product("", {"(o.m)": int(power), "cos_m": -int(power)})
            guess = f"samples are drawn from {drawn}, but the pdf is that of {stated}"
            yield Factor(formula, guess, field, of_wo=True)


def refractions(subject: Subject) -> Iterator[Factor]:
    """The factors that are powers of the cosines of a refraction and of its index."""
    names = ("(o.m)", "(i.m)", "cos_i", "cos_o", "cos_m")
    singles = [{name: power} for name in names for power in (1, -1, 2, -2)]
    pairs = [{a: p, b: q} for a, b in itertools.combinations(names, 2) for p in (1, -1) for q in (1, -1)]
    pairs += [{a: p, b: -p} for a, b in (names[:2], names[2:4]) for p in (2, -2)]
    for eta in [*index_below(subject)] or [1.0]:
        for powers in singles + pairs:
            for over in (0, 2, -2):

                def field(
                    o: np.ndarray, i: np.ndarray, eta: float = eta, p: dict[str, int] = powers, over: int = over
                ) -> np.ndarray:
                    side = _across(o, eta)
                    values = values_of([*p], o, i, half_vector(o, i, side))
                    return np.asarray(np.prod(values ** np.array([*p.values()], float), axis=1) * side ** float(over))

                facet = over or any("m" in name for name in powers)
                other = "the cosine of wi is used in place of that of wo, or vice versa"
                guess = COSINES["(i.m)"].guess if facet else other
                yield Factor(product("", powers | ({"eta": over} if over else {})), guess, field)


# --------------------------------------------------------------------------- widths

POWERS = {"alpha^2": 2.0, "sqrt(alpha)": 0.5}
WIDTH = "alpha is used in place of alpha^2, or vice versa"


def widths(subject: Subject) -> Iterator[tuple[str, str, Subject]]:
    """The subject with its two alphas swapped, with alpha^2 and with sqrt(alpha), in each case if values may change."""
    pair = getattr(subject.model, "alpha", None)
    if isinstance(pair, tuple | list) and len(pair) == 2 and np.ndim(pair[0]) == 0 and pair[0] != pair[1]:
        exchanged = subject.replace(alpha=(pair[1], pair[0]))
        yield "alpha_x and alpha_y exchanged", "alpha_x is used in place of alpha_y", exchanged
    for text, power in POWERS.items():
        for name, parameter in subject.parameters.items():
            value = getattr(subject.model, name, None)
            if parameter.kind != "alpha" and name not in ("alpha", "roughness"):
                continue
            numbers = np.asarray(value, float) if isinstance(value, int | float | tuple | list) else None
            if numbers is None or numbers.ndim > 1 or not np.all((numbers > 0.0) & (numbers < 0.99)):
                continue
            changed = numbers**power
            try:
                other = subject.replace(**{name: float(changed) if changed.ndim == 0 else tuple(changed.tolist())})
            except GonioError:
                continue
            yield f"{text} in place of alpha", WIDTH, other


def distributions(subject: Subject) -> Iterator[Factor]:
    """The factors for another width: ratios of D at alpha^2 or sqrt(alpha) to D at alpha, for GGX and Beckmann, and
    their inverses."""
    value = getattr(subject.model, "alpha", None)
    if not isinstance(value, int | float | tuple | list) or np.size(value) > 2:
        return
    width = np.broadcast_to(np.asarray(value, float), 2)
    if not np.all((width > 0.0) & (width < 0.99)):
        return
    for name, D in (("GGX", _ggx), ("Beckmann", _beckmann)):
        for text, power in POWERS.items():
            for formula, above, below in (
                (f"D({text}) / D(alpha)", width**power, width),
                (f"D(alpha) / D({text})", width, width**power),
            ):

                def field(
                    o: np.ndarray,
                    i: np.ndarray,
                    D: Callable[[np.ndarray, np.ndarray], np.ndarray] = D,
                    above: np.ndarray = above,
                    below: np.ndarray = below,
                ) -> np.ndarray:
                    m = half_vector(o, i)
                    return D(m, above) / D(m, below)

                yield Factor(f"{formula} of {name}", WIDTH, field)


def _ggx(m: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """D of GGX (Heitz2014, eq. 85)."""
    q = (m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2 + m[:, 2] ** 2
    return np.asarray(1.0 / (np.pi * alpha[0] * alpha[1] * q**2))


def _beckmann(m: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """D of Beckmann (Heitz2014, eq. 81), clamped to be positive so that ratios are finite."""
    q = ((m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2) / m[:, 2] ** 2
    return np.asarray(np.exp(-np.minimum(q, 600.0)) / (np.pi * alpha[0] * alpha[1] * m[:, 2] ** 4))


# --------------------------------------------------------------------------- Fresnel's term

AT_NORMAL = "the Fresnel term is evaluated at the angle to the normal instead of the half vector"


def dielectrics(subject: Subject, antisymmetric: bool) -> Iterator[Factor]:
    """The factors for F at the wrong cosine: the exact F of a dielectric at n.o divided by that at o.m or n.i, with F
    for reflection and 1 - F for transmission."""
    for eta in index_below(subject):

        def field(o: np.ndarray, i: np.ndarray, eta: float = eta) -> np.ndarray:
            through = o[:, 2] * i[:, 2] < 0.0
            side = _across(o, eta)

            def share(cosine: np.ndarray, index: np.ndarray) -> np.ndarray:
                F = dielectric(np.abs(cosine), index)
                return np.where(through, 1.0 - F, F)

            m = half_vector(o, i, np.where(through, side, 1.0))
            other = share(i[:, 2], _across(i, eta)) if antisymmetric else share(_dot(o, m), side)
            return np.asarray(share(o[:, 2], side) / other)

        formula = "F(n.o) / F(n.i)" if antisymmetric else "F(n.o) / F(o.m)"
        yield Factor(f"{formula} for index {eta:.4g}", AT_NORMAL, field)
        yield Factor(f"1 / ({formula}) for index {eta:.4g}", AT_NORMAL, functools.partial(_inverse, field))


def _inverse(field: Field, o: np.ndarray, i: np.ndarray) -> np.ndarray:
    return np.asarray(1.0 / field(o, i))


def dielectric(cosine: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Reflectance of a dielectric for unpolarized light, from the cosine >= 0 and the relative index eta (Walter2007,
    eq. 22)."""
    square = eta**2 - 1.0 + cosine**2
    g = np.sqrt(np.maximum(square, 0.0))
    plus = np.maximum(g + cosine, 1e-12)
    a, b = (g - cosine) / plus, (cosine * plus - 1.0) / (cosine * (g - cosine) + 1.0)
    return np.where(square > 0.0, 0.5 * a**2 * (1.0 + b**2), 1.0)


def schlick_curve(cosine: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Schlick's curve for a dielectric, as a function of the cosine on the side of the lower index."""
    r0 = ((eta - 1.0) / (eta + 1.0)) ** 2
    sin2 = (1.0 - cosine**2) / eta**2
    outer = np.where(eta < 1.0, np.sqrt(np.maximum(1.0 - sin2, 0.0)), cosine)
    return np.where(sin2 >= 1.0, 1.0, r0 + (1.0 - r0) * (1.0 - outer) ** 5)
