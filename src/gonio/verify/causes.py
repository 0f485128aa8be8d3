"""What a failure probably comes from: named where the ratio of two values is clean, and not at all where it is not.

Two values that should be one have a ratio of 1. A forgotten Jacobian, cosine or pi leaves its trace in it: divided by
that factor, the ratio is 1 again for nearly every pair of directions. A law hands over its ratio; each candidate is
a field over (wo, wi), or the same value computed otherwise (arguments swapped, the other mode, the width squared). The
first that fits is named, the simplest first: constants, products of cosines, indices, widths, Fresnel's term. A ratio
that is 1 in most places and not in a region, one side or one channel, is named by that region.

    cause = named(Ratio("weight x pdf", "eval", wo, wi, top, bottom, subject))
"""

from __future__ import annotations

import dataclasses
import itertools
import warnings
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeAlias

import numpy as np

from ..errors import GonioError
from . import directions

if TYPE_CHECKING:
    from .subject import Subject

SPREAD = 1e-3  # largest 5..95 % spread of a ratio that is called clean
COVER = 0.97  # share of the pairs that must follow
ROWS = 4096  # pairs that are looked at
FEWEST = 64  # pairs that say anything

# (subject, wo, wi): the denominator of a ratio, of another subject or with other arguments
Denominator: TypeAlias = "Callable[[Subject, np.ndarray, np.ndarray, str], np.ndarray]"
Field: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of (wo, wi), (N, 3) each: (N,)


@dataclasses.dataclass(frozen=True)
class Cause:
    """A probable cause.

    words   what it looks like, as a sentence of the report
    key     the same without figures: failures with one key have one cause
    """

    words: str
    key: str


@dataclasses.dataclass(frozen=True)
class Ratio:
    """Two values that should be one, over pairs of directions.

    top, bottom    their names, "weight x pdf" and "eval"
    wo, wi         (N, 3)
    above, below   the values, (N, channels)
    again          computes `below` anew for another subject, other directions or the other mode
    numbers        constants that this ratio may be, beside the usual ones: "2 alpha"
    zero           what a ratio of 0 suggests
    antisymmetric  whether exchanging wo and wi inverts the ratio: what two directions share cancels
    """

    top: str
    bottom: str
    wo: np.ndarray
    wi: np.ndarray
    above: np.ndarray
    below: np.ndarray
    subject: Subject
    again: Denominator | None = None
    antisymmetric: bool = False
    numbers: dict[str, float] = dataclasses.field(default_factory=dict)
    zero: str = "a value that never arrives"

    @property
    def name(self) -> str:
        return f"the ratio of {self.top} to {self.bottom}"

    def take(self, rows: np.ndarray, channels: np.ndarray | None = None) -> Ratio:
        """The same over some pairs, and some channels."""
        above, below = self.above[rows], self.below[rows]
        if channels is not None:
            above, below = above[:, channels], below[:, channels]
        return dataclasses.replace(self, wo=self.wo[rows], wi=self.wi[rows], above=above, below=below)


class Fit(NamedTuple):
    """What a ratio is: as a formula, what that suggests, and how well it holds; of a constant, the constant."""

    formula: str
    guess: str
    spread: float
    cover: float
    number: float | None = None


def named(ratio: Ratio) -> Cause | None:
    """The cause that a ratio names, None where it is not clean."""
    astray = nothing_below(ratio.top, ratio.bottom, ratio.wo, ratio.wi, ratio.above, ratio.below)
    ratio = _telling(ratio)
    if len(ratio.wo) < FEWEST:
        return astray
    off = _off(ratio)
    if not off.any():
        return astray
    words = ""
    channels = np.flatnonzero(off.mean(0) > 0.02)
    if len(channels) in (1, 2) and off.shape[1] == 3 and not off[:, [c for c in range(3) if c not in channels]].any():
        words = f"only in {' and '.join(('red', 'green', 'blue')[c] for c in channels)}"
        ratio = ratio.take(np.arange(len(ratio.wo)), channels)
        off = off[:, channels]
    whole = _fitted(ratio)
    if whole is not None:
        return _cause(ratio, whole, words)
    bad: np.ndarray = np.any(off, axis=1)
    region = _region(ratio, bad)
    if region is None and astray is not None:
        return astray
    if region is None:
        # a channel alone is a place as well
        text = f"{ratio.name} is 1 but {words}"
        return Cause(text, text) if words and bad.mean() > COVER else None
    place, rows = region
    words = f"{words} and {place}".removeprefix(" and ") if words else place
    inside = _fitted(ratio.take(np.flatnonzero(rows)))
    if inside is not None:
        return _cause(ratio, inside, words)
    text = f"{ratio.name} is 1 everywhere else, and wrong {words}"
    return Cause(text, text)


def _cause(ratio: Ratio, fit: Fit, place: str) -> Cause:
    where = f", {place}" if place else ""
    cover = f" over {fit.cover:.0%} of directions" if fit.cover < 0.9995 else ""
    text = f"{ratio.name} is {fit.formula}{where}, within {max(fit.spread, 1e-9):.0e}{cover}"
    key = factor_key(fit.number) if fit.number is not None else fit.formula
    return Cause(f"{text}: {fit.guess}?" if fit.guess else text, f"{key} {place}".strip())


def factor_key(number: float) -> str:
    """One key for a factor and its inverse: which of two values lacks it, the ratio does not say."""
    return f"factor {max(number, 1.0 / number):.3g}" if number > 0.0 else f"factor {number:.3g}"


def _tolerance(ratio: Ratio) -> float:
    """What two values may differ by and still be the same."""
    return 1e-5 if ratio.subject.best == "float64" else 5e-3


def _telling(ratio: Ratio) -> Ratio:
    """The pairs at which both values are numbers and the denominator is something."""
    finite = np.isfinite(ratio.above).all(1) & np.isfinite(ratio.below).all(1)
    # within .06 degrees of the horizon a ratio of cosines says little
    finite &= np.minimum(np.abs(ratio.wo[:, 2]), np.abs(ratio.wi[:, 2])) > 1e-3
    size = np.abs(ratio.below).max(1)
    largest = float(np.percentile(size[finite], 99.0)) if finite.any() else 0.0
    rows = np.flatnonzero(finite & (size > 1e-6 * largest))
    if len(rows) and largest > 0.0:
        return ratio.take(rows[:ROWS])
    return ratio.take(rows[:0])


def nothing_below(
    top: str, bottom: str, wo: np.ndarray, wi: np.ndarray, above: np.ndarray, below: np.ndarray
) -> Cause | None:
    """A numerator where there is no denominator, in a place that can be named: samples that eval knows nothing of."""
    dark = np.all(below == 0.0, axis=1)
    lit: np.ndarray = np.any(above > 0.0, axis=1)
    bad = dark & lit
    if bad.sum() < max(FEWEST, 5e-3 * len(bad)):
        return None
    place = place_of(wo[lit], wi[lit], bad[lit])
    words = f"{top} is there and {bottom} is 0 {place}"
    return Cause(f"{words}, at {bad[lit].mean():.2g} of the directions", words) if place else None


def _off(ratio: Ratio) -> np.ndarray:
    """Where the two differ, (N, channels)."""
    floor = 1e-3 * np.abs(ratio.below).max(1, keepdims=True)
    size = np.maximum(np.maximum(np.abs(ratio.above), np.abs(ratio.below)), floor)
    return np.abs(ratio.above - ratio.below) > _tolerance(ratio) * size


# --------------------------------------------------------------------------- one factor over all pairs


def _fitted(ratio: Ratio) -> Fit | None:
    """The first candidate that explains a ratio everywhere."""
    if len(ratio.wo) < FEWEST:
        return None
    for candidate in CANDIDATES:
        fit = candidate.fit(ratio)
        if fit is not None:
            return fit
    return None


def _scalar(ratio: Ratio) -> np.ndarray | None:
    """One number a pair (N,), where all channels have the same ratio; None where they have not."""
    lit = np.abs(ratio.below) > 1e-3 * np.abs(ratio.below).max(1, keepdims=True)
    r = np.divide(ratio.above, ratio.below, out=np.full_like(ratio.above, np.nan), where=lit)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # rows in which nothing is lit stay no number
        middle = np.nanmedian(r, axis=1)
        spread = np.nanmax(np.abs(r - middle[:, None]), axis=1)
    apart = ~(spread <= max(SPREAD, _tolerance(ratio)) * np.abs(middle))
    return middle if apart.mean() < 1.0 - COVER else None


def _holds(ratio: Ratio, quotient: np.ndarray) -> tuple[float, float] | None:
    """(spread, cover) of values that should be 1; None where they are not, cleanly."""
    allowed = max(SPREAD, _tolerance(ratio))
    good = np.isfinite(quotient)
    cover = float(np.mean(good & (np.abs(quotient - 1.0) < allowed)))
    if cover < COVER:
        return None
    low, high = np.percentile(quotient[good], [5.0, 95.0])
    return (float(high - low), cover) if high - low < allowed else None


class Candidate:
    """A factor that may be forgotten, doubled or misplaced."""

    def fit(self, ratio: Ratio) -> Fit | None:
        """How it explains the ratio, or None."""
        raise NotImplementedError


# what numbers are written as, and what leaves them behind
NUMBERS = {
    "pi": np.pi,
    "2 pi": 2.0 * np.pi,
    "4 pi": 4.0 * np.pi,
    "pi^2": np.pi**2,
    "2": 2.0,
    "3": 3.0,
    "4": 4.0,
    "8": 8.0,
    "16": 16.0,
    "sqrt 2": np.sqrt(2.0),
}
NUMBERS |= {f"1 / {f'({name})' if ' ' in name else name}": 1.0 / value for name, value in NUMBERS.items()}
NUMBERS |= {"4 / pi": 4.0 / np.pi, "pi / 4": np.pi / 4.0, "2 / pi": 2.0 / np.pi, "pi / 2": np.pi / 2.0}


def written(value: float, allowed: float = SPREAD) -> str:
    """A number as a formula where it is a known one, else in digits."""
    for name, known in NUMBERS.items():
        if abs(value / known - 1.0) < allowed:
            return name
    return f"{value:.5g}"


class Constant(Candidate):
    """The same factor everywhere: pi, 2, 4, or one without a name; 0 and -1 too."""

    def fit(self, ratio: Ratio) -> Fit | None:
        r = _scalar(ratio)
        if r is None:
            return None
        middle = float(np.median(r))
        if abs(middle) < 1e-9:
            flat = float(np.mean(np.abs(r) < 1e-9))
            return Fit("0", ratio.zero, 0.0, flat) if flat > COVER else None
        held = _holds(ratio, r / middle)
        if held is None or abs(middle - 1.0) < max(SPREAD, 2.0 * _tolerance(ratio)):
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
        r = _scalar(ratio)
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
        held = _holds(ratio, quotient / scale)
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
        helds = [_holds(ratio, column / m) for column, m in zip(r.T, middle, strict=True)]
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
        r = _scalar(ratio)
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
                    held = _holds(ratio, r / (field * side**over))
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
        r = _scalar(ratio) if through.any() else None
        if r is None:
            return None
        for eta in index_below(ratio.subject):
            side = np.where(ratio.wo[:, 2] > 0.0, eta, 1.0 / eta)
            for power in (2, -2, 1, -1, 4, -4, 3, -3):
                held = _holds(ratio, r / np.where(through, side**power, 1.0))
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
            r = _scalar(dataclasses.replace(ratio, below=below)) if np.all(np.isfinite(below)) else None
            held = _holds(ratio, r) if r is not None else None
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
        r = _scalar(ratio)
        width = width_of(ratio.subject)
        if r is None or width is None or not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0):
            return None
        m = half_vector(ratio.wo, ratio.wi)
        for name, D in (("GGX", ggx), ("Beckmann", _beckmann)):
            for text, power in POWERS.items():
                field = D(m, width**power) / D(m, width)
                for formula, quotient in ((f"D({text}) / D(alpha)", r / field), (f"D(alpha) / D({text})", r * field)):
                    held = _holds(ratio, quotient)
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
            held = _holds(ratio, column / field)
            if held is None:
                return None
            spread, cover = max(spread, held[0]), min(cover, held[1])
        return spread, cover


class DielectricFresnel(Candidate):
    """The exact F of a dielectric at n.o in place of o.m: F where light is reflected, 1 - F where it goes through."""

    def fit(self, ratio: Ratio) -> Fit | None:
        r = _scalar(ratio)
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
                held = _holds(ratio, quotient)
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
        r = _scalar(ratio) if ratio.antisymmetric else None
        if r is None or not np.all(ratio.wo[:, 2] * ratio.wi[:, 2] > 0.0) or not np.all(r > 0.0):
            return None
        o, i = (np.abs(w[:, 2:]) for w in (ratio.wo, ratio.wi))
        powers = np.arange(1, self.DEGREE + 1)
        columns = np.column_stack([o**powers - i**powers, np.log(o / i)])
        solved = np.linalg.lstsq(columns, np.log(r), rcond=None)[0]
        held = _holds(ratio, r / np.exp(columns @ solved))
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


# --------------------------------------------------------------------------- a region


def _region(ratio: Ratio, bad: np.ndarray) -> tuple[str, np.ndarray] | None:
    """Where alone a ratio is wrong: in words, and the rows; None where no simple place holds just the wrong ones."""
    share = float(bad.mean())
    if not 0.003 < share < 0.97 or bad.sum() < FEWEST:
        return None
    size = np.abs(np.log(np.maximum(np.abs(_first(ratio)), 1e-9)))[bad]
    if np.percentile(size, 5.0) < 0.05 * np.median(size):
        return None  # it grows from nothing: there is no edge
    for words, rows in _places(ratio.wo, ratio.wi, bad):
        inside, outside = rows & bad, rows & ~bad
        if inside.sum() >= 0.995 * bad.sum() and outside.sum() <= 0.005 * rows.sum() + 0.5:
            return words, rows
    return None


def _first(ratio: Ratio) -> np.ndarray:
    """The ratio of the channel that is furthest from 1, (N,)."""
    r = ratio.above / np.where(ratio.below == 0.0, np.nan, ratio.below)
    r = np.nan_to_num(r, nan=1.0)
    return r[np.arange(len(r)), np.argmax(np.abs(r - 1.0), axis=1)]


def _places(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Simple regions, in words: sides of the surface, then halves of the sphere, then beyond an angle."""
    o, i = wo[:, 2] > 0.0, wi[:, 2] > 0.0
    through = o != i
    yield "from outside", o
    yield "from inside", ~o
    yield "in transmission", through
    yield "in reflection", ~through
    yield "in transmission from outside", through & o
    yield "in transmission from inside", through & ~o
    yield "in reflection from outside", ~through & o
    yield "in reflection from inside", ~through & ~o
    for name, w in (("wo", wo), ("wi", wi)):
        for k, axis in enumerate("xy"):
            yield f"where {name}.{axis} > 0", w[:, k] > 0.0
            yield f"where {name}.{axis} < 0", w[:, k] < 0.0
    for name, values in _angles(wo, wi):
        # the edge lies between the outermost right row and the innermost wrong one
        lowest, highest = values[bad].min(), values[bad].max()
        if highest > values[~bad].max():
            edge = np.quantile(values[bad], 0.002, method="lower")
            yield f"where {name} is beyond {edge:.3g} degrees", values >= edge
        elif lowest < values[~bad].min():
            edge = np.quantile(values[bad], 0.998, method="higher")
            yield f"where {name} is within {edge:.3g} degrees", values <= edge


def _angles(wo: np.ndarray, wi: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    def degrees(cosine: np.ndarray) -> np.ndarray:
        return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))

    yield "wo's angle to the normal", degrees(np.abs(wo[:, 2]))
    yield "wi's angle to the normal", degrees(np.abs(wi[:, 2]))
    yield ("the larger angle to the normal", degrees(np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2]))))
    yield ("the smaller angle to the normal", degrees(np.maximum(np.abs(wo[:, 2]), np.abs(wi[:, 2]))))
    yield "the angle between wo and wi", degrees(np.sum(wo * wi, axis=1))
    yield ("the half vector's angle to the normal", degrees(np.abs(half_vector(wo, wi)[:, 2])))


def place_of(wo: np.ndarray, wi: np.ndarray, bad: np.ndarray) -> str:
    """In words where alone some pairs are wrong, "" where no simple place holds just them."""
    for words, rows in _places(wo, wi, bad) if bad.any() and not bad.all() else ():
        if (rows & bad).sum() >= 0.995 * bad.sum() and (rows & ~bad).sum() <= 0.005 * rows.sum() + 0.5:
            return words
    return ""
