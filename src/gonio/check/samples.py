"""Comparison of files with values of f from any program (`measure.formats.rows`) with a material, row by row."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..material import BSDF
from ..measure.formats import rows as files
from ..measure.formats.rows import Pairs
from . import causes, search
from .finding import RIGHT, WRONG, Finding, Mistake
from .mistakes import Values, f_of
from .mistakes.empirical import with_cosine
from .stated import Asked, degenerate

ACCURACY = 2e-3  # relative; allows for float32, six printed digits and angles from inverse trigonometric functions
GRAZING = 1e-3  # cosine below which a division by it is inaccurate
_COSINE = "the values are f cos theta_i, as in the sheet's equation 1"
_NEARER = "compared with f cos theta_i, which is closer to the values than f"
COVER = 0.99  # fraction of the rows that must agree; the other rows must agree to within ten times the accuracy


def check(path: Path, asked: Asked, up: str = "z", accuracy: float | None = None) -> Finding:
    """Judge a file of values. Raises InputError if the file cannot be read.

    If no parameters are given, any parameters that explain the values are accepted, unless a known mistake with the
    default parameters explains the values.

    asked     the material with which the values are compared
    up        the axis along the normal: "z", "y" or "x"
    accuracy  relative difference below which values count as equal; None selects the default
    """
    rows = read(path, up)
    accuracy = ACCURACY if accuracy is None else accuracy
    finding = judge(path.name, rows, asked.material, accuracy)
    if finding.passed and asked.defaults:
        return finding
    other = _explaining(path.name, rows, asked.material, accuracy) if asked.defaults else None
    if other is None:
        return replace(finding, remark=asked.remark)
    numbers = search.described(other)
    if finding.mistake is not None and causes.is_known(finding.mistake):
        return replace(finding, remark=f"{numbers} explains the values as well: name it in a line '# model:', or by -p")
    remark = f"{numbers}, found from the values: the file does not name its parameters"
    return replace(judge(path.name, rows, other, accuracy), remark=remark)


def _explaining(name: str, rows: Pairs, material: BSDF, accuracy: float) -> BSDF | None:
    """The material with parameters that explain the values; None if there are no such parameters, or if they reduce
    the material to a simpler model."""
    fine = np.minimum(rows.wo[:, 2], rows.wi[:, 2]) > GRAZING
    wo, wi, f = rows.wo[fine], rows.wi[fine], rows.f[fine]
    if not len(f) or np.any(f < 0.0) or not np.any(f):
        return None
    for given in (f, f / wi[:, 2:]) if with_cosine(material) else (f,):
        for other in search.candidates(material, wo, wi, given):
            if judge(name, rows, other, accuracy).passed and not degenerate(other, wo, wi, accuracy):
                return other
    return None


def judge(name: str, rows: Pairs, material: BSDF, accuracy: float = ACCURACY, kind: str = "values of f") -> Finding:
    """Compare values of f with those of a material, row by row.

    accuracy  relative difference below which values count as equal
    kind      kind of work, for the finding
    """
    expected = f_of(material, rows.wo, rows.wi)
    if rows.f.shape[1] == 1:
        if np.any(np.ptp(expected, axis=1) > accuracy * expected.max(axis=1)):
            raise InputError(
                "one column of f given, but the material is colored", name, "give three columns: red, green, blue"
            )
        expected = expected[:, :1]
    fine = np.minimum(np.abs(rows.wo[:, 2]), np.abs(rows.wi[:, 2])) > GRAZING
    if not fine.any() or not (np.any(expected[fine]) or np.any(rows.f)):
        raise InputError("every row is at or below the horizon", name, "give directions above the surface, or --up y")
    figures = {"rows": float(len(rows.f)), "accuracy": accuracy}
    facts: list[str] = []
    if _agree(rows.f, expected, fine, accuracy):
        pass
    elif with_cosine(material) and _agree(rows.f, expected * np.abs(rows.wi[:, 2:]), fine, accuracy):
        expected = expected * np.abs(rows.wi[:, 2:])
        facts.append(_COSINE)
    else:
        mistake = _mistake(rows, expected, material, fine, accuracy)
        if with_cosine(material) and _has_cosine(rows, expected, fine, accuracy):
            divided = rows._replace(f=_over(rows.f, rows.wi[:, 2:]))
            other = _mistake(divided, expected, material, fine, accuracy)
            expected = expected * np.abs(rows.wi[:, 2:])
            known = other is not None and causes.is_known(other)
            mistake = other or mistake
            facts.append(_COSINE if known or np.any(causes.close(rows.f, expected, accuracy)[fine]) else _NEARER)
        error, worst = _error(rows.f, expected, fine, accuracy)
        good = causes.close(rows.f, expected, accuracy)[fine]
        figures |= {"agree": float(good.mean()), "largest": float(error[worst]), "line": float(rows.line[worst])}
        facts[:0] = [
            f"{good.mean():.1%} of {int(fine.sum())} rows agree to within {accuracy:.2g} (relative){_left_out(fine)}",
            f"largest error: line {rows.line[worst]}, f {_numbers(rows.f[worst])}, "
            f"expected {_numbers(expected[worst])}",
        ]
        return Finding(name, kind, WRONG, tuple(facts), mistake, figures)
    error, worst = _error(rows.f, expected, fine, accuracy)
    figures |= {"agree": 1.0, "largest": float(error[worst])}
    text = f"{int(fine.sum())} rows agree; the largest relative difference is {error[worst]:.2g}{_left_out(fine)}"
    facts.insert(0, text)
    return Finding(name, kind, RIGHT, tuple(facts), None, figures)


def _mistake(rows: Pairs, expected: Values, material: BSDF, fine: np.ndarray, accuracy: float) -> Mistake | None:
    both = causes.ratio(material, rows.wo[fine], rows.wi[fine], rows.f[fine], expected[fine], accuracy)
    return causes.named(both)


def _has_cosine(rows: Pairs, expected: Values, fine: np.ndarray, accuracy: float) -> bool:
    """Whether wrong values are closer to f cos theta_i than to f: they agree in more rows, or in the same number of
    rows with a smaller median difference."""

    def distance(right: Values) -> tuple[float, float]:
        error, _ = _error(rows.f, right, fine, accuracy)
        return -float(np.mean(causes.close(rows.f, right, accuracy)[fine])), float(np.median(error[fine]))

    return distance(expected * np.abs(rows.wi[:, 2:])) < distance(expected)


def _over(f: Values, cosine: Values) -> Values:
    return f / np.maximum(np.abs(cosine), GRAZING)


def _left_out(fine: np.ndarray) -> str:
    """A text that states the number of ignored rows; "" if there are none."""
    count = int(np.sum(~fine))
    return f"; {count} row{'s' if count > 1 else ''} at the horizon left out" if count else ""


def _agree(given: Values, expected: Values, fine: np.ndarray, accuracy: float) -> bool:
    near = causes.close(given, expected, accuracy)[fine]
    return bool(near.mean() >= COVER and np.all(causes.close(given, expected, 10.0 * accuracy)[fine]))


def _error(given: Values, expected: Values, fine: np.ndarray, accuracy: float) -> tuple[Values, int]:
    """The relative difference of each row, and the row with the largest difference among those above the horizon.

    The divisor is at least 1e-3 of the 99th percentile of the values.
    """
    size = np.maximum(np.abs(given), np.abs(expected))
    error = (np.abs(given - expected) / np.maximum(size, 1e-3 * np.percentile(size, 99.0) + 1e-30)).max(axis=1)
    return error, int(np.argmax(np.where(fine, error, -1.0)))


def _numbers(values: Values) -> str:
    return ", ".join(f"{x:.6g}" for x in values)


def read(path: Path, up: str = "z") -> Pairs:
    """The rows of a file, converted to z up. Raises InputError, with the line number, if the file is damaged.

    up  the axis along the normal in the file: "z", "y" or "x"
    """
    if up not in files.UP:
        raise InputError(f"unknown axis '{up}'", "--up", "give the axis along the normal: z, y or x")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", str(path), "check the path") from None
    return files.parsed(data, path.name, up)
