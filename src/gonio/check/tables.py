"""Check of pictures of tables of E and E_avg, such as those of the homework, by the best-fitting form and its distance.

Distances are root-mean-square differences in gray levels (0 to 255). Forms are identified from the rows of roughness
0.55 and above; below, a table computed by cosine sampling is noisy and too dark, which is not a mistake.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError, did_you_mean
from ..pictures import images
from . import table_forms
from .finding import RIGHT, WRONG, Finding, Mistake
from .table_forms import Form, Values

LEVELS = 255.0
FITS = 3.0  # gray levels within which a form explains a table
NOISY = 8.0  # the corresponding limit for a table computed with random cosine-weighted directions
CONVERGED = 0.55  # lowest roughness at which cosine sampling with 1,024 directions has converged
ROWS = 10.0  # gray levels within which a sampling method explains the means of rows of low roughness
SURE = 1.1  # smallest ratio of the distance of correct forms to that of a mistake; below, the mistake is only probable
GRAIN = 0.3  # correlation of the errors of neighboring texels below which they are noise
NOISY_WEIGHT = 0.05  # weight of the distance over all rows
WHITE = 0.95  # fraction of white texels above which a factor cannot be determined
UNLIKE = 0.6  # correlation with the nearest form below which a picture is not a table of E
SIZES = (16, 4096)
_LAYOUT = "the layout: roughness along rows, mu from left to right"
_STORED = "how the values are stored"


@dataclass(frozen=True)
class Table:
    """A table as stored in its file: values (N, N), row 0 at the top."""

    name: str
    values: Values

    @property
    def constant(self) -> bool:
        """Whether the table is constant along rows or columns, as E_avg is."""
        deviations = [float(np.mean(np.std(self.values, axis=axis))) for axis in (0, 1)]
        return min(deviations) * LEVELS < 1.0


class _Layout(NamedTuple):
    """A layout of the table in the picture: its description, the mistake, if any, and the values [roughness, mu]."""

    words: str
    mistake: Mistake | None
    values: Values


def _layouts(picture: Values) -> Iterator[_Layout]:
    """E[roughness, mu] for each layout of the picture, with the homework's layout first."""

    def wrong(words: str) -> Mistake:
        return Mistake(words, _LAYOUT)

    yield _Layout("lowest roughness in the bottom row", None, picture[::-1])
    yield _Layout("lowest roughness in the top row (flip off)", None, picture)
    left = "mu runs from right to left"
    yield _Layout(left, wrong(left), picture[::-1, ::-1])
    yield _Layout(left + ", lowest roughness in the top row", wrong(left), picture[:, ::-1])
    across = "rows and columns exchanged: roughness runs along x and mu along y"
    for part in (picture.T, picture.T[::-1], picture.T[:, ::-1], picture.T[::-1, ::-1]):
        yield _Layout(across, wrong(across), part)
    moved = "the picture is moved by a row"
    for shift in (1, -1):
        yield _Layout(moved, wrong(moved), np.roll(picture, shift, axis=0)[::-1])


class _Stored(NamedTuple):
    """A method of storing E: its description, the mistake (None if the method is correct), and the stored values."""

    words: str
    mistake: Mistake | None
    values: Values


_SCALES = {"pi": np.pi, "1 / pi": 1 / np.pi, "2": 2.0, "1 / 2": 0.5, "4": 4.0, "1 / 4": 0.25, "2 pi": 2 * np.pi,
           "1 / (2 pi)": 0.5 / np.pi}  # fmt: skip


def _stored(E: Values, scales: bool) -> Iterator[_Stored]:
    """E as stored by each method, as values in [0, 1].

    scales  whether to include mistakes that scale E by a known factor
    """
    clipped = np.clip(E, 0.0, 1.0)
    yield _Stored("", None, clipped)
    yield _Stored("the picture holds 1 - E", None, 1.0 - clipped)
    gamma = Mistake("the values are encoded as sRGB; a table holds them as they are", _STORED)
    yield _Stored("encoded as sRGB", gamma, _encoded(clipped))
    other = Mistake("the values are decoded from sRGB, or raised to 2.2", _STORED)
    yield _Stored("decoded", other, clipped**2.2)
    if not scales:
        return
    for name, scale in _SCALES.items():
        mistake = Mistake(
            f"the values are {name} times too large: a factor that is missing or doubled", "a constant factor"
        )
        yield _Stored(f"times {name}", mistake, np.clip(E * scale, 0.0, 1.0))
        if scale > 1.0:
            wrapped = Mistake(f"{mistake.words}, and bytes wrap at 256", "a constant factor")
            yield _Stored(f"times {name}, wrapped", wrapped, np.mod(np.floor(E * scale * 255.0), 256.0) / 255.0)


def _encoded(linear: Values) -> Values:
    """Linear values encoded as sRGB (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1.0 / 2.4) - 0.055)


class _Match(NamedTuple):
    """A form with its storage method and layout, and its distance in the converged rows, in gray levels."""

    form: Form
    stored: _Stored
    layout: _Layout
    distance: float

    @property
    def mistake(self) -> Mistake | None:
        return self.form.mistake or self.stored.mistake or self.layout.mistake


def read(path: Path, channels: int = 1) -> Table:
    """The table in a picture or in an .npz array. Raises InputError for anything else.

    channels  1, or 2 for a split sum, stored as A in red and B in green; a gray picture contains their sum
    """
    if path.suffix.lower() == ".png" and _depth(path) == 16:
        raise InputError("a 16-bit picture given", path.name, "write 8 bits per channel, E * 255, as the homework does")
    pixels = np.asarray(images.read(path, "linear").pixels, float)
    if np.all(np.isfinite(pixels)) and np.any(np.ptp(pixels, axis=2) > 1.5 / LEVELS):
        if channels == 2:
            return Table(path.name, pixels[..., 0] + pixels[..., 1])
        raise InputError("a colored picture given", path.name, "E with F = 1 has three equal channels")
    return Table(path.name, pixels[..., 0])


def _depth(path: Path) -> int:
    """Bits per channel according to the header of a .png; 0 if there is none."""
    with contextlib.suppress(OSError):
        header = path.read_bytes()[:25]
        if len(header) == 25 and header[12:16] == b"IHDR":
            return header[24]
    return 0


def check(table: Table, expected: str = "", sampled: bool = False) -> Finding:
    """Judge a table of E, or of E_avg if it is constant along an axis.

    expected  the name of the required masking term; "" accepts the two terms of the homework and Smith's
    sampled   whether importance sampling of normals is required, so that rows of low roughness are free of noise
    Raises InputError for a picture that contains no such table.
    """
    _check(table, expected)
    return _average(table, None, expected) if table.constant else _directional(table, expected, sampled)


def check_average(table: Table, own: Table | None, expected: str = "") -> Finding:
    """Judge a table of E_avg by the correct tables of E, or by the student's own table of E, which may itself be wrong.

    own       the student's own table of E; None if there is none
    expected  the name of the required masking term; "" accepts the two terms of the homework and Smith's
    """
    _check(table, expected)
    return _average(table, own, expected)


def _check(table: Table, expected: str) -> None:
    values = table.values
    if values.ndim != 2 or values.shape[0] != values.shape[1]:
        shape = " x ".join(map(str, values.shape[1::-1]))
        raise InputError(f"a picture of {shape} pixels, a square table expected", table.name, "such as 128 x 128")
    if not SIZES[0] <= len(values) <= SIZES[1]:
        raise InputError(
            f"a picture of {len(values)} x {len(values)} pixels", table.name, f"give {SIZES[0]} to {SIZES[1]}"
        )
    if not np.all(np.isfinite(values)):
        bad = int(np.sum(~np.isfinite(values)))
        raise InputError(
            f"{bad} values are NaN or infinite", table.name, "a division by 0, such as n.v = 0, or 0 / 0 in D?"
        )
    if np.ptp(values) < 1.0 / LEVELS:
        raise InputError(f"every pixel is {values.flat[0]:.3g}", table.name, "the picture is empty: was it computed?")
    known = ["schlick-ibl", "schlick-direct", "smith-separable", "smith-correlated"]
    if expected and expected not in known:
        raise InputError(f"unknown masking term '{expected}' of a table", "MODEL", did_you_mean(expected, known))


def _directional(table: Table, expected: str, sampled: bool) -> Finding:
    size = len(table.values)
    at = table_forms.nodes(size)
    matches = _matches(table.values, table_forms.forms(size), at)
    best = matches[0]
    _check_likeness(table, best, at)
    inside = best.layout.values[np.ix_(at, at)] * LEVELS
    low = (at + 0.5) / size < CONVERGED
    residual = inside - best.stored.values * LEVELS
    all_rows = _rms(residual)
    figures = {"converged": best.distance, "all": all_rows}
    right = best.mistake is None
    limit = max(FITS, 1.3 * _noise(best.layout.values))
    random = _is_noise(residual) and (right or best.distance <= limit)
    noise = random and all_rows <= (1.0 if right else 1.2) * best.distance  # equal at low and at high roughness
    fits = max(NOISY, limit) if right and noise else limit
    converged = all_rows <= FITS or noise or not low.any()
    facts = [
        f"nearest: {best.form.words}; {best.layout.words}" + (f"; {best.stored.words}" if best.stored.words else "")
    ]
    facts.append(
        f"{best.distance:.2g} gray levels of 255 off at roughness >= {CONVERGED}, {all_rows:.2g} over all (rms)"
    )
    if best.distance <= (NOISY if right else limit) and not converged:
        facts += _sampling(best, at, size, low, figures)
    if noise and best.distance > FITS:
        facts.append("the rest is noise of random directions: with more directions, the comparison is more precise")
    if best.distance > (NOISY if right and not converged else fits):
        facts.append("no form fits: the table is wrong, but the mistake is unknown")
        return Finding(table.name, "table of E", WRONG, tuple(facts), None, figures)
    if np.mean(inside[~low] >= LEVELS - 1.0) > WHITE:
        facts.append("nearly all texels are white: the values exceed 1, by a factor that cannot be determined")
        return Finding(table.name, "table of E", WRONG, tuple(facts), None, figures)
    _check_encoding(table, best.stored)
    mistake = _certain(best, matches) or _unexpected(best.form, expected)
    if sampled and not converged:
        words = "low roughness is noisy and too dark: the directions are not sampled by the normals of GGX"
        mistake = mistake or Mistake(words, "how directions are sampled, and their pdf")
    return Finding(table.name, "table of E", WRONG if mistake else RIGHT, tuple(facts), mistake, figures)


def _noise(values: Values) -> float:
    """The rms noise of a table in gray levels, estimated from second differences along roughness above `CONVERGED`,
    where E is smooth at every mu."""
    rows = values[int(CONVERGED * len(values)) :] * LEVELS
    second = rows[2:] - 2.0 * rows[1:-1] + rows[:-2]
    return float(np.sqrt(np.mean(second**2) / 6.0))  # a second difference has 1 + 4 + 1 times the variance


def _certain(best: _Match, matches: list[_Match]) -> Mistake | None:
    """The mistake of the nearest match, or None; described as probable if a correct form is almost as close."""
    if best.mistake is None:
        return None
    right = min((one.distance for one in matches if one.mistake is None), default=np.inf)
    if best.distance <= FITS or right > SURE * best.distance:
        return best.mistake
    return replace(best.mistake, words=f"probably {best.mistake.words}")


def _is_noise(residual: np.ndarray) -> bool:
    """Whether the errors of neighboring texels are uncorrelated."""
    return float(np.corrcoef(residual[:, 1:].ravel(), residual[:, :-1].ravel())[0, 1]) < GRAIN


def _check_encoding(table: Table, stored: _Stored) -> None:
    """Raise InputError for a table with sRGB encoding applied or removed."""
    if stored.mistake is not None and stored.words in ("encoded as sRGB", "decoded"):
        raise InputError(stored.mistake.words, table.name, "write E * 255 as it is, without gamma")


def _unexpected(form: Form, expected: str) -> Mistake | None:
    """The mistake of a correct form whose masking term is not the expected one; None if it is."""
    if not expected or form.masking == expected:
        return None
    asked = next(f.words for f in table_forms.forms(SIZES[0]) if f.masking == expected)
    return Mistake(f"{form.words}, where {asked} is asked for", "the masking term G")


def _matches(picture: Values, forms: tuple[Form, ...], at: np.ndarray) -> list[_Match]:
    """The eight nearest combinations of form, storage and layout, best first, with a small penalty per mistake."""
    rows = (at + 0.5) / len(picture) >= CONVERGED
    matches: list[tuple[float, int, _Match]] = []
    layouts = [(one, one.values[np.ix_(at, at)]) for one in _layouts(picture)]
    for order, form in enumerate(forms):
        for stored, (layout, values) in itertools.product(_stored(form.values, form.mistake is None), layouts):
            faults = sum(one.mistake is not None for one in (form, stored, layout))
            distance = _rms(values[rows] - stored.values[rows]) * LEVELS
            # An additional mistake must reduce the distance by about a tenth plus a quarter of a gray level. The noisy
            # rows have a small weight, but if the other rows are white, only the noisy rows distinguish the forms.
            cost = (distance + 0.5) * (1.0 + 0.1 * faults) + 0.25 * faults
            cost += NOISY_WEIGHT * _rms(values - stored.values) * LEVELS
            matches.append((cost, order, _Match(form, stored, layout, distance)))
    matches.sort(key=lambda one: one[:2])
    return [match for _, _, match in matches[:8]]


def _check_likeness(table: Table, best: _Match, at: np.ndarray) -> None:
    """Raise InputError for a picture that is not a table of E."""
    values = best.layout.values[np.ix_(at, at)]
    rows = (at + 0.5) / len(table.values) >= CONVERGED
    with np.errstate(all="ignore"):  # the correlation is 0 / 0 if all texels are white
        alike = np.corrcoef(values[rows].ravel(), best.stored.values[rows].ravel())[0, 1]
    if best.distance > NOISY and not alike > UNLIKE:
        what = "this picture does not resemble a table of E: it shows something else"
        raise InputError(what, table.name, "give the table, roughness along rows and mu along columns")


_FLOORS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)


def _sampling(best: _Match, at: np.ndarray, size: int, low: np.ndarray, figures: dict[str, float]) -> list[str]:
    """Sentences about the rows of low roughness: cosine sampling, a lower bound of D's denominator, and wrapped bytes.

    The samples are random, so only the means of rows can be compared.
    """
    invert = bool(best.stored.words)
    values = best.layout.values[np.ix_(at, at)][low].mean(axis=1)
    values = 1.0 - values if invert else values
    wrapped = _wraps(1.0 - best.layout.values if invert else best.layout.values)
    ways = []
    for floor in _FLOORS:
        E = table_forms.cosine_sampled(size, best.form.masking, floor)[low]
        shown = np.mod(np.floor(E * LEVELS), 256.0) / LEVELS if wrapped else np.clip(E, 0.0, 1.0)
        ways.append((_rms(values - shown.mean(axis=1)) * LEVELS, floor))
    distance, floor = min(ways)
    figures |= {"rows": distance, "floor": floor, "wrap": float(wrapped)}
    denominator = f"D's denominator is at least {floor:g}" if floor else "D's denominator has no floor"
    bytes_ = "bytes wrap at 256" if wrapped else "no byte wraps at 256"
    return [
        "at lower roughness, noisy and too dark, as with cosine-weighted directions; importance sampling (bonus 1) "
        "avoids this",
        f"nearest: 32 x 32 stratified directions; {denominator}, {bytes_}; rows are {distance:.2g} gray levels off"
        if distance <= ROWS
        else f"how the directions are drawn cannot be told: the nearest known way is {distance:.0f} gray levels off",
    ]


def _wraps(E: Values) -> bool:
    """Whether values above 255 have wrapped, leaving single dark texels among bright ones."""
    neighbors = np.stack([np.roll(E, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)])
    middle = np.median(neighbors, axis=0)
    bright = middle > 0.8
    return bool(bright.any() and np.mean(E[bright] < 0.2) > 0.002)


def _rms(difference: Values) -> float:
    return float(np.sqrt(np.mean(difference**2)))


# --------------------------------------------------------------------------- E_avg


def _average(table: Table, own: Table | None, expected: str) -> Finding:
    """Judge a table of E_avg by averages of each correct E, and of the student's own E, with every weighting, storage
    method and layout."""
    size = len(table.values)
    at = table_forms.nodes(size)
    if not table.constant:
        raise InputError(
            "the picture varies along both axes, but E_avg has one value per row", table.name, "see E_avg.png"
        )
    across = float(np.mean(np.std(table.values, axis=0))) < float(np.mean(np.std(table.values, axis=1)))
    columns = table.values.mean(axis=0) if across else table.values.mean(axis=1)
    sources = list(_own(own, size, at)) if own is not None else []
    sources += [(form.words, form.masking, form.values) for form in table_forms.columns_of(size)]
    best: tuple[float, str, Mistake | None, str, float, _Stored] | None = None
    for (words, masking, E), flipped in itertools.product(sources, (True, False)):
        profile = (columns[::-1] if flipped else columns)[at]
        for way in table_forms.weightings(size, E.shape[1]):
            for stored in _stored(np.mean(E * way.weights, axis=1), scales=False):
                faults = (way.mistake is not None) + (stored.mistake is not None)
                distance = _rms(profile - stored.values) * LEVELS
                cost = (distance + 0.5) * (1.0 + 0.1 * faults) + 0.25 * faults
                if best is None or cost < best[0]:
                    place = "bottom" if flipped else "top"
                    text = f"{way.words} of {words}; lowest roughness in the {place} row"
                    text += f"; {stored.words}" if stored.words else ""
                    best = (cost, text, way.mistake or stored.mistake, masking, distance, stored)
    assert best is not None
    _, text, mistake, masking, distance, stored = best
    facts = [f"nearest: {text}", f"{distance:.2g} gray levels of 255 off (rms)"]
    figures = {"all": distance}
    if distance > FITS:
        facts.append("no form fits: the table is wrong, but the mistake is unknown")
        return Finding(table.name, "table of E_avg", WRONG, tuple(facts), None, figures)
    _check_encoding(table, stored)
    if across:
        mistake = mistake or Mistake(
            "E_avg is constant along a column in place of a row: rows and columns exchanged", _LAYOUT
        )
    form = next((one for one in table_forms.forms(size) if one.masking == masking), None)
    mistake = mistake or (_unexpected(form, expected) if form is not None else None)
    return Finding(table.name, "table of E_avg", WRONG if mistake else RIGHT, tuple(facts), mistake, figures)


def _own(own: Table, size: int, at: np.ndarray) -> Iterator[tuple[str, str, Values]]:
    """The student's E in each of the two allowed layouts, in the rows of E_avg, as a form without a masking term."""
    if own.constant or len(own.values) != size:
        return
    for layout in itertools.islice(_layouts(own.values), 2):
        yield "your own E", "", layout.values[at]
