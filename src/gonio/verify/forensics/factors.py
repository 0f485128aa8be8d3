"""Factors that may be forgotten, doubled or misplaced, the simplest first: constants, products of cosines, indices,
widths, Fresnel's term. Each is a field over (wo, wi), or the same value computed otherwise; divided by the right one, a
ratio of two values that should be one is 1 for nearly every pair of directions.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ...errors import GonioError
from .. import directions
from ..subject import Subject
from .ratio import COVER, NUMBERS, SPREAD, Fit, Ratio, holds, scalar, tolerance, written

FEWEST = 64  # pairs that say anything


def fitted(ratio: Ratio) -> Fit | None:
    """The first candidate that explains a ratio everywhere."""
    if len(ratio.wo) < FEWEST:
        return None
    for candidate in CANDIDATES:
        fit = candidate.fit(ratio)
        if fit is not None:
            return fit
    return None


class Candidate:
    """A factor that may be forgotten, doubled or misplaced."""

    def fit(self, ratio: Ratio) -> Fit | None:
        """How it explains the ratio, or None."""
        raise NotImplementedError


class Constant(Candidate):
    """The same factor everywhere: pi, 2, 4, or one without a name; 0 and -1 too."""

    def fit(self, ratio: Ratio) -> Fit | None:
        r = scalar(ratio)
        if r is None:
            return None
        middle = float(np.median(r))
        if abs(middle) < 1e-9:
            flat = float(np.mean(np.abs(r) < 1e-9))
            return Fit("0", ratio.zero, 0.0, flat) if flat > COVER else None
        held = holds(ratio, r / middle)
        if held is None or abs(middle - 1.0) < max(SPREAD, 2.0 * tolerance(ratio)):
            return None
        if abs(middle + 1.0) < SPREAD:
            return Fit("-1", "a sign", *held)
        for name, number in ratio.numbers.items():
            if abs(middle / number - 1.0) < SPREAD:
                return Fit(f"{name} = {middle:.5g}", "the chain rule, forgotten or applied twice", *held)
        text = written(middle) if middle > 0.0 else f"-{written(-middle)}"
        known = text.lstrip("-") in NUMBERS
        guess = "a constant that one of the two lacks" if known else "a constant factor"
        return Fit(text, guess, *held, middle)


def half_vector(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """The half vector of a reflection, on wo's side."""
    m = wo + wi
    m = m / np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-12)
    return m * np.copysign(1.0, np.sum(m * wo, axis=1, keepdims=True))


class Cosines(Candidate):
    """Powers of the cosines that reflection knows, times a known number: 4 (o.m), cos_i, cos_o / cos_i, sin_i ..."""

    NAMES = ("(o.m)", "cos_m", "cos_i", "cos_o", "sin_i", "sin_o")
    GUESSES: ClassVar[dict[str, str]] = {
        "(o.m)": "the Jacobian of the half vector, 4 (o.m), missing or doubled",
        "cos_m": "the cosine of the half vector, m.z, missing or doubled in its density",
        "cos_i": "the cosine of wi, missing or doubled",
        "cos_o": "the cosine of wo, missing or doubled",
        "sin_i": "the sine of wi, the Jacobian of spherical angles",
        "sin_o": "the sine of wo",
    }

    def fit(self, ratio: Ratio) -> Fit | None:
        r = scalar(ratio)
        if r is None or not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0):
            return None
        logs = np.log(self._values(ratio.wo, ratio.wi))
        names = list(self.NAMES)
        if ratio.antisymmetric:  # only what differs between the two directions is left
            logs, names = logs[:, [2, 4]] - logs[:, [3, 5]], ["cos_i", "sin_i"]
        positive = np.isfinite(r) & (r > 0.0)
        if positive.mean() < COVER:
            return None
        # most exponents are 0: one or two cosines at a time, so that a few rows off the rule do not spoil the rest
        for count in (1, 2):
            for which in itertools.combinations(range(len(names)), count):
                fit = self._tried(ratio, r, logs[:, which], [names[k] for k in which], positive)
                if fit is not None:
                    return fit
        return None

    def _tried(
        self, ratio: Ratio, r: np.ndarray, logs: np.ndarray, names: list[str], positive: np.ndarray
    ) -> Fit | None:
        if np.any(np.ptp(np.percentile(logs, [5.0, 95.0], axis=0), axis=0) < 0.05):
            return None  # it hardly varies, and says nothing
        rows = np.flatnonzero(positive)
        columns = np.column_stack([logs[rows], np.ones(len(rows))])
        solved = np.linalg.lstsq(columns, np.log(r[rows]), rcond=None)[0]
        powers = np.round(solved[:-1])
        if np.any(powers == 0.0) or np.abs(powers).max() > 4.0 or np.abs(solved[:-1] - powers).max() > 0.2:
            return None
        quotient = r / np.exp(logs @ powers)
        scale = float(np.median(quotient))
        number = written(scale)
        plain = abs(scale - 1.0) < SPREAD
        if not plain and number not in NUMBERS:
            return None  # a clamp leaves such a ratio, and any number can be had of it
        held = holds(ratio, quotient / scale)
        if held is None:
            return None
        powers_of = dict(zip(names, powers.astype(int).tolist(), strict=True))
        if ratio.antisymmetric:
            powers_of |= {name.replace("_i", "_o"): -power for name, power in powers_of.items()}
        guess = " and ".join(self.GUESSES[name] for name in names)
        return Fit(product("" if plain else scale, powers_of), guess, *held)

    @staticmethod
    def _values(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
        m = half_vector(wo, wi)
        sines = [np.hypot(w[:, 0], w[:, 1]) for w in (wi, wo)]
        found = [np.sum(wo * m, axis=1), m[:, 2], wi[:, 2], wo[:, 2], *sines]
        return np.maximum(np.abs(np.stack(found, axis=1)), 1e-9)


def product(scale: float | str, powers: dict[str, int]) -> str:
    """ "4 (o.m)", "1 / (4 (o.m))", "cos_i / cos_o"."""

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


class Colour(Candidate):
    """A constant of each channel's own: an albedo or a tint that one of the two lacks."""

    def fit(self, ratio: Ratio) -> Fit | None:
        if ratio.above.shape[1] != 3 or ratio.antisymmetric or np.any(ratio.below <= 0.0):
            return None
        r = ratio.above / ratio.below
        middle = np.median(r, axis=0)
        if np.any(middle <= 0.0) or np.ptp(middle) < 0.01 * middle.max():
            return None
        helds = [holds(ratio, column / m) for column, m in zip(r.T, middle, strict=True)]
        spreads = [held for held in helds if held is not None]
        if len(spreads) < 3:
            return None
        text = ", ".join(f"{m:.4g}" for m in middle)
        guess = "a colour that one of the two lacks"
        return Fit(f"({text})", guess, max(s for s, _ in spreads), min(c for _, c in spreads))


class Refraction(Candidate):
    """Powers of the cosines of a refraction, about the half vector of the index that samples tell."""

    NAMES = ("|o.m|", "|i.m|", "cos_i", "cos_o", "cos_m")

    def fit(self, ratio: Ratio) -> Fit | None:
        if np.any(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0):
            return None
        r = scalar(ratio)
        if r is None or np.any(~(r > 0.0)):
            return None
        for eta in [*index_below(ratio.subject)] or [1.0]:
            side = np.where(ratio.wo[:, 2] > 0.0, eta, 1.0 / eta)
            m = ratio.wo + side[:, None] * ratio.wi
            m /= np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-12)
            cosines = [np.sum(ratio.wo * m, 1), np.sum(ratio.wi * m, 1), ratio.wi[:, 2], ratio.wo[:, 2], m[:, 2]]
            values = np.maximum(np.abs(np.stack(cosines, axis=1)), 1e-9)
            singles = [(k, power) for k in range(len(self.NAMES)) for power in (1, -1, 2, -2)]
            pairs = [*itertools.combinations([(k, power) for k, power in singles if abs(power) == 1], 2)]
            pairs += [((a, p), (b, -p)) for a, b in ((0, 1), (2, 3)) for p in (2, -2)]
            for which in (*((one,) for one in singles), *pairs):
                field = np.prod([values[:, k] ** float(power) for k, power in which], axis=0)
                for over in (0, 2, -2):
                    held = holds(ratio, r / (field * side**over))
                    if held is None:
                        continue
                    powers = {self.NAMES[k]: power for k, power in which} | ({"eta": over} if over else {})
                    facet = any("m" in name for name in powers)
                    guess = (
                        "the Jacobian of refraction" if facet or over else "the cosine of wi or wo, of the other side"
                    )
                    return Fit(product("", powers), guess, *held)
        return None


class Index(Candidate):
    """Powers of the index of refraction in transmission, inverted from the other side."""

    def fit(self, ratio: Ratio) -> Fit | None:
        through = ratio.wo[:, 2] * ratio.wi[:, 2] < 0.0
        r = scalar(ratio) if through.any() else None
        if r is None:
            return None
        for eta in index_below(ratio.subject):
            side = np.where(ratio.wo[:, 2] > 0.0, eta, 1.0 / eta)
            for power in (2, -2, 1, -1, 4, -4, 3, -3):
                held = holds(ratio, r / np.where(through, side**power, 1.0))
                if held is not None:
                    guess = "the factor (eta_o / eta_i)^2 of radiance, missing, doubled or upside down"
                    return Fit(product("", {"eta": power}) + " in transmission", guess, *held)
        return None


def index_below(subject: Subject) -> Iterator[float]:
    """Index below over index above: what samples say, and what a parameter named eta says."""
    if not subject.transmits:
        return
    wo = directions.on_side(directions.uniform(np.random.default_rng(4), 2048), 1)
    s = subject.sample(wo, directions.numbers(np.random.default_rng(44), 2048))
    through = (s.pdf > 0.0) & (s.wi[:, 2] < 0.0)
    if np.any(through & ~s.delta):
        through &= ~s.delta
    told = float(np.median(s.eta[through])) if through.any() else 1.0
    values = [told]
    declared = getattr(subject.model, "eta", None)
    if isinstance(declared, int | float):
        values.append(float(declared))
    yield from (v for v in dict.fromkeys(values) if np.isfinite(v) and v > 0.0 and abs(v - 1.0) > 0.02)


class Otherwise(Candidate):
    """The denominator computed in another way is the numerator: arguments swapped, the other mode, another width."""

    def fit(self, ratio: Ratio) -> Fit | None:
        if ratio.again is None:
            return None
        subject, wo, wi = ratio.subject, ratio.wo, ratio.wi
        ways: list[tuple[str, str, tuple[Subject, np.ndarray, np.ndarray, str]]] = []
        if not ratio.antisymmetric:
            ways.append(("with wo and wi exchanged", "swapped arguments", (subject, wi, wo, "radiance")))
        if subject.transmits:
            for mode in ("radiance", "importance"):
                ways.append((f"in mode {mode}", "`mode` is ignored, or turned", (subject, wo, wi, mode)))
        for text, guess, other in widths(subject):
            ways.append((f"with {text}", guess, (other, wo, wi, "radiance")))
        for words, guess, arguments in ways:
            try:
                below = ratio.again(*arguments)
            except (GonioError, ValueError):
                continue
            if below.shape[1] != ratio.below.shape[1]:
                continue
            r = scalar(dataclasses.replace(ratio, below=below)) if np.all(np.isfinite(below)) else None
            held = holds(ratio, r) if r is not None else None
            if held is not None:
                return Fit(f"1 {words}", guess, *held)
        return None


POWERS = {"alpha^2": 2.0, "sqrt(alpha)": 0.5}


def widths(subject: Subject) -> Iterator[tuple[str, str, Subject]]:
    """The subject at alpha^2, at sqrt(alpha) and with its two widths exchanged, where that changes anything."""
    pair = getattr(subject.model, "alpha", None)
    if isinstance(pair, tuple | list) and len(pair) == 2 and np.ndim(pair[0]) == 0 and pair[0] != pair[1]:
        exchanged = subject.replace(alpha=(pair[1], pair[0]))
        yield ("alpha_x and alpha_y exchanged", "alpha_x where alpha_y belongs", exchanged)
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
                yield (
                    f"{text} in place of alpha",
                    "alpha against alpha^2",
                    subject.replace(**{name: float(changed) if changed.ndim == 0 else tuple(changed.tolist())}),
                )
            except GonioError:
                continue


class Distribution(Candidate):
    """D of another width, alpha^2 or sqrt(alpha) in place of alpha, of GGX or Beckmann, and nothing else."""

    def fit(self, ratio: Ratio) -> Fit | None:
        r = scalar(ratio)
        width = width_of(ratio.subject)
        if r is None or width is None or not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0):
            return None
        m = half_vector(ratio.wo, ratio.wi)
        for name, D in (("GGX", ggx), ("Beckmann", _beckmann)):
            for text, power in POWERS.items():
                field = D(m, width**power) / D(m, width)
                for formula, quotient in ((f"D({text}) / D(alpha)", r / field), (f"D(alpha) / D({text})", r * field)):
                    held = holds(ratio, quotient)
                    if held is not None:
                        return Fit(f"{formula} of {name}", "alpha against alpha^2", *held)
        return None


def width_of(subject: Subject) -> np.ndarray | None:
    """(alpha_x, alpha_y) of a subject with a width that squaring changes."""
    value = getattr(subject.model, "alpha", None)
    if not isinstance(value, int | float | tuple | list) or np.size(value) > 2:
        return None
    width = np.broadcast_to(np.asarray(value, float), 2)
    return width if np.all((width > 0.0) & (width < 0.99)) else None


def ggx(m: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Heitz2014, eq. 85."""
    q = (m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2 + m[:, 2] ** 2
    return 1.0 / (np.pi * alpha[0] * alpha[1] * q**2)


def _beckmann(m: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Heitz2014, eq. 81; never quite 0, so that ratios stay numbers."""
    q = ((m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2) / m[:, 2] ** 2
    return np.exp(-np.minimum(q, 600.0)) / (np.pi * alpha[0] * alpha[1] * m[:, 2] ** 4)


class Fresnel(Candidate):
    """Schlick's F at another cosine: at n.o in place of o.m. R0, one a channel, is solved for."""

    NAMES = ("n.o", "n.i", "o.m", "n.m")

    def fit(self, ratio: Ratio) -> Fit | None:
        if not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0):
            return None
        m = half_vector(ratio.wo, ratio.wi)
        cosines = [ratio.wo[:, 2], ratio.wi[:, 2], np.sum(ratio.wo * m, 1), m[:, 2]]
        powers = [(1.0 - np.clip(np.abs(c), 0.0, 1.0)) ** 5 for c in cosines]
        r = ratio.above / np.where(ratio.below == 0.0, np.nan, ratio.below)
        if not ratio.antisymmetric:
            # F of (1 - cos)^5 = 1 is 1: a term that one of the two lacks
            one = np.ones(len(r))
            for name, x in zip(self.NAMES, powers, strict=True):
                for formula, held in (
                    (f"F({name})", self._held(ratio, r, x, one)),
                    (f"1 / F({name})", self._held(ratio, r, one, x)),
                ):
                    if held is not None:
                        return Fit(formula, "Fresnel's term, forgotten in one of the two or there twice", *held)
        order = [(0, 1), (1, 0)] if ratio.antisymmetric else itertools.permutations(range(4), 2)
        for a, b in order:
            held = self._held(ratio, r, powers[a], powers[b])
            if held is not None:
                formula = f"F({self.NAMES[a]}) / F({self.NAMES[b]})"
                return Fit(formula, "Fresnel's term at the normal, where the half vector belongs", *held)
        return None

    def _held(self, ratio: Ratio, r: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[float, float] | None:
        spread, cover = 0.0, 1.0
        for column in r.T:
            # column = (R0 + (1 - R0) x) / (R0 + (1 - R0) y), which is linear in R0
            a, b = column * (1.0 - y) - (1.0 - x), x - column * y
            good = np.isfinite(a) & np.isfinite(b)
            if not good.any() or np.sum(a[good] ** 2) < 1e-12:
                return None
            r0 = float(np.sum(a[good] * b[good]) / np.sum(a[good] ** 2))
            if not 0.0 <= r0 < 0.99:
                return None
            field = (r0 + (1.0 - r0) * x) / (r0 + (1.0 - r0) * y)
            if np.ptp(np.percentile(field, [5.0, 95.0])) < 0.01:
                return None
            held = holds(ratio, column / field)
            if held is None:
                return None
            spread, cover = max(spread, held[0]), min(cover, held[1])
        return spread, cover


class DielectricFresnel(Candidate):
    """The exact F of a dielectric at n.o in place of o.m: F where light is reflected, 1 - F where it goes through."""

    def fit(self, ratio: Ratio) -> Fit | None:
        r = scalar(ratio)
        if r is None:
            return None
        o, i = ratio.wo[:, 2], ratio.wi[:, 2]
        through = o * i < 0.0
        for eta in index_below(ratio.subject):
            side = np.where(o > 0.0, eta, 1.0 / eta)
            m = ratio.wo + np.where(through, side, 1.0)[:, None] * ratio.wi
            m /= np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-12)

            def share(cosine: np.ndarray, index: np.ndarray, through: np.ndarray = through) -> np.ndarray:
                F = _dielectric(np.abs(cosine), index)
                return np.where(through, 1.0 - F, F)

            if ratio.antisymmetric:
                other, words = (share(i, np.where(i > 0.0, eta, 1.0 / eta)), "F(n.o) / F(n.i)")
            else:
                other, words = (share(np.sum(ratio.wo * m, axis=1), side), "F(n.o) / F(o.m)")
            at_normal = share(o, side)
            with np.errstate(divide="ignore", invalid="ignore"):
                quotients = {words: r * other / at_normal, f"1 / ({words})": r * at_normal / other}
            for formula, quotient in quotients.items():
                held = holds(ratio, quotient)
                if held is not None:
                    text = f"{formula} of index {eta:.4g}"
                    return Fit(text, "Fresnel's term at the normal, where the half vector belongs", *held)
        return None


def _dielectric(cosine: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Reflectance of unpolarized light, by the cosine >= 0 and the index beyond over that here (Walter2007, eq. 22)."""
    square = eta**2 - 1.0 + cosine**2
    g = np.sqrt(np.maximum(square, 0.0))
    plus = np.maximum(g + cosine, 1e-12)
    a, b = (g - cosine) / plus, (cosine * plus - 1.0) / (cosine * (g - cosine) + 1.0)
    return np.where(square > 0.0, 0.5 * a**2 * (1.0 + b**2), 1.0)


class OneDirection(Candidate):
    """f(wo, wi) / f(wi, wo) = g(cos_o) / g(cos_i): a term that knows one of the two directions only."""

    DEGREE = 9

    def fit(self, ratio: Ratio) -> Fit | None:
        r = scalar(ratio) if ratio.antisymmetric else None
        if r is None or not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0) or not np.all(r > 0.0):
            return None
        o, i = (np.abs(w[:, 2:]) for w in (ratio.wo, ratio.wi))
        powers = np.arange(1, self.DEGREE + 1)
        columns = np.column_stack([o**powers - i**powers, np.log(o / i)])
        solved = np.linalg.lstsq(columns, np.log(r), rcond=None)[0]
        held = holds(ratio, r / np.exp(columns @ solved))
        if held is None:
            return None
        guess = "a term of one direction alone, where the half vector or both directions belong"
        return Fit("g(wo) / g(wi), with g of one cosine", guess, *held)


CANDIDATES: tuple[Candidate, ...] = (
    Constant(),
    Colour(),
    Cosines(),
    Index(),
    Refraction(),
    Otherwise(),
    Distribution(),
    Fresnel(),
    DielectricFresnel(),
    OneDirection(),
)
