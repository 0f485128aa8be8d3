"""Quantised log tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..formats.own import Own
from ..tables.base import Floats, Measurement, in_rgb
from ..tables.half_difference import HalfDifference
from ..tables.log_table import COLOURS, LogTable, Shape, above, from_cosines, packed, to_cosines
from .base import Method, over_half_vectors

OFFSET = 0.05  # of the median of f: darker cells are known less well relatively
FILLS, FILL_STEP = 6, 2.0  # rounds of filling, and how coarse cosines are meanwhile
STEPS = (1e-3, 300.0)  # between which the step is looked for
HALVINGS = 12

Stored = Mapping[str, NDArray[np.generic]]


class Log(Method):
    """log: logarithms as cosines, each rounded to a multiple of a step, as fine as the bytes allow."""

    name: ClassVar[str] = "log"

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        found: list[Measurement] = []
        for table in tables:
            logs = Logs(over_half_vectors(table))
            found.append(coded(LogTable, logs, to_cosines(logs.values), {}, size))
        return found


class Logs:
    """A table's logarithms: smooth where it says nothing, in brightness and two differences of colour."""

    def __init__(self, table: HalfDifference) -> None:
        self.table = table
        n, m, count = table.values.shape[:3]
        self.shape: Shape = (n, m, count)
        kept = in_rgb(table.values, table.wavelengths)
        self.offset = float(np.float32(OFFSET * max(float(np.median(kept[table.valid])), 1e-9)))
        held = table._held(kept) if not table.valid.all() else kept
        self.values = np.log(np.maximum(held, 0.0) + self.offset) @ COLOURS.T
        if not table.valid.all():
            # what coarse cosines say of the others is what costs least
            for _ in range(FILLS):
                coarse = from_cosines(np.round(to_cosines(self.values) / FILL_STEP) * FILL_STEP)
                self.values[~table.valid] = coarse[~table.valid]

    @property
    def stored(self) -> dict[str, NDArray[np.generic]]:
        return {"cells": np.array(self.shape, np.int32)}

    def scale(self, step: float) -> Floats:
        return np.array([self.table.turn, step, self.offset])

    @property
    def lit(self) -> NDArray[np.bool_]:
        return above(self.shape, self.table.turn) & self.table.valid


def coded(cls: type[LogTable], logs: Logs, numbers: Floats, more: Stored, size: int, shared: int = 0) -> LogTable:
    """A table of numbers by frequency, rounded as little as fits into a file of `size` bytes.

    more    arrays of the file besides; of these `shared` bytes are not counted
    """
    own = Own()
    blank = {**logs.stored, **more, "scale": logs.scale(1.0)}
    about = {"title": logs.table.title, "source": logs.table.source}

    def stored(step: float) -> dict[str, NDArray[np.generic]]:
        return {**blank, "scale": logs.scale(step), "codes": packed(np.round(numbers / step).astype(np.int64))}

    head = len(own.file_of(cls, {**blank, "codes": np.zeros(0, np.uint8)}, about)) - shared

    def bytes_of(step: float) -> int:
        return head + len(stored(step)["codes"])

    finest = max(STEPS[0], float(np.abs(numbers).max()) / 2.0**22)  # what three bytes hold
    step = least(lambda x: bytes_of(x) <= size, finest, STEPS[1])
    if step is None:
        raise InputError(f"{size} bytes, a table takes {bytes_of(STEPS[1])} at least", "bytes", "allow more")
    return cls(stored(step), **about)


def least(fits: Callable[[float], bool], low: float, high: float) -> float | None:
    """About the least number that fits, where larger ones do; None where none does."""
    if not fits(high):
        return None
    low, high = np.log(low), np.log(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if fits(float(np.exp(middle))) else (middle, high)
    return float(np.exp(high))
