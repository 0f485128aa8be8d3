"""Strict parsing of numbers in text files."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

LONGEST = 1 << 20  # characters of a line


def lines(data: bytes, where: str) -> list[str]:
    """The lines of a text file, without line breaks. Raises InputError, which names `where`, if it is not text."""
    if b"\0" in data:
        raise InputError("not a text file: it contains zero bytes", where)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # comments may use an older encoding, which does not affect the numbers
    rows = text.splitlines()
    if any(len(line) > LONGEST for line in rows):
        raise InputError(f"a line of more than {LONGEST} characters", where)
    return rows


def numbers(words: list[str], where: str, line: int) -> list[float]:
    """Convert words to finite numbers. Raises InputError, which names file and line, if a word is not such a number."""
    values = []
    for word in words:
        try:
            number = float(word)
        except ValueError:
            raise InputError(f"'{word[:40]}' given, a number expected", f"{where}:{line}") from None
        if not math.isfinite(number):
            raise InputError(f"'{word[:40]}' given, a finite number expected", f"{where}:{line}")
        values.append(number)
    return values


def table(rows: list[tuple[int, list[str]]], width: int, where: str) -> NDArray[np.float64]:
    """Convert rows of words to numbers, (N, width).

    rows   line number and words of each row
    where  name of the file in errors
    """
    for line, row in rows:
        if len(row) != width:
            raise InputError(f"{len(row)} numbers in a row, {width} expected", f"{where}:{line}")
    try:
        values = np.array([row for _, row in rows], dtype=np.float64)
    except ValueError:
        values = np.full((1, 1), np.nan)
    if not np.all(np.isfinite(values)):
        for line, row in rows:
            numbers(row, where, line)
    return values.reshape(-1, width)


def written(values: NDArray[np.float64], separator: str = " ") -> str:
    """Format rows of numbers as text, with enough digits to preserve float64 values exactly."""
    return "\n".join(separator.join(f"{x:.17g}" for x in row) for row in values) + "\n"
