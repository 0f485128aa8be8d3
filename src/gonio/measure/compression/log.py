"""Quantized log tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..formats.own import Own
from ..tables.adaptive import Adaptive
from ..tables.base import Floats, Measurement, in_rgb
from ..tables.half_difference import HalfDifference
from ..tables.log_adaptive import LogAdaptive, log_values
from ..tables.log_table import COLOURS, LogTable, Shape, above, from_cosines, packed, to_cosines
from ..tables.low_rank import LowRank
from ..tables.rebuilt import Rebuilt, rebuilding
from .base import Method, over_half_vectors

OFFSET = 0.05  # fraction of the median of f: the measurement of darker cells has a lower relative accuracy
FILLS, FILL_STEP = 6, 2.0  # rounds of filling, and the step of the cosine coefficients during these rounds
STEPS = (1e-3, 300.0)  # the range in which the step is searched
HALVINGS = 9

Stored = Mapping[str, NDArray[np.generic]]
T = TypeVar("T", LogTable, LowRank)
C = TypeVar("C", LogTable, LowRank, LogAdaptive)


class Log(Method):
    """log: cosine-series coefficients of the logarithms of the values, quantized with the smallest step that fits the
    size."""

    name: ClassVar[str] = "log"

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        compressed: list[Measurement] = []
        for table in tables:
            if isinstance(table, Adaptive) and table.wavelengths is None and table.jacobian:
                compressed.append(_adaptive(table, size))
                continue
            logs = Logs(over_half_vectors(table))
            compressed.append(coded(LogTable, logs, to_cosines(logs.values), {}, size))
        return compressed


def _adaptive(table: Adaptive, size: int) -> Measurement:
    """A compressed adaptive table. Its grid is preserved, because another grid would lose the lobes."""
    offset = float(np.float32(OFFSET * max(float(np.median(np.abs(table.values))), 1e-9)))
    numbers = to_cosines(log_values(table.values, offset))
    arrays = Rebuilt({**table.arrays(), **rebuilding(table)}).arrays()
    stored = {name: array for name, array in arrays.items() if name not in ("luminance", "values")}
    stored["cells"] = np.array(numbers.shape[:3], np.int32)
    return rounded(LogAdaptive, table, numbers, stored, (1.0, offset), size)


class Logs:
    """The logarithms of a table as brightness and two color differences; invalid cells are filled smoothly."""

    def __init__(self, table: HalfDifference) -> None:
        self.table = table
        n, m, count = table.values.shape[:3]
        self.shape: Shape = (n, m, count)
        rgb = in_rgb(table.values, table.wavelengths)
        self.offset = float(np.float32(OFFSET * max(float(np.median(rgb[table.valid])), 1e-9)))
        held = table._held(rgb) if not table.valid.all() else rgb
        self.values = np.log(np.maximum(held, 0.0) + self.offset) @ COLOURS.T
        if not table.valid.all():
            # a coarse cosine series in the invalid cells takes the fewest bytes
            for _ in range(FILLS):
                coarse = from_cosines(np.round(to_cosines(self.values) / FILL_STEP) * FILL_STEP)
                self.values[~table.valid] = coarse[~table.valid]

    @property
    def stored(self) -> dict[str, NDArray[np.generic]]:
        return {"cells": np.array(self.shape, np.int32)}

    @property
    def lit(self) -> NDArray[np.bool_]:
        return above(self.shape, self.table.turn) & self.table.valid


def coded(cls: type[T], logs: Logs, numbers: Floats, more: Stored, size: int, shared: int = 0) -> T:
    """A half-difference table from its coefficients, which are rounded so that its file has about `size` bytes.

    more    further arrays of the table
    shared  bytes of these arrays that do not count toward `size`
    """
    return rounded(cls, logs.table, numbers, {**logs.stored, **more}, (logs.table.turn, logs.offset), size, shared)


def rounded(
    cls: type[C], source: Measurement, numbers: Floats, stored: Stored, scale: tuple[float, float], size: int,
    shared: int = 0,
) -> C:  # fmt: skip
    """A table whose coefficients are rounded as finely as a file of `size` bytes allows.

    numbers  the coefficients
    stored   the other arrays of the table
    scale    turn and offset; the step is inserted between them
    shared   bytes of the other arrays that do not count toward `size`
    """
    own = Own()
    about = {"title": source.title, "source": source.source}

    def with_codes(step: float, codes: NDArray[np.generic]) -> dict[str, NDArray[np.generic]]:
        return {**stored, "scale": np.array([scale[0], step, scale[1]]), "codes": codes}

    def codes(step: float) -> NDArray[np.uint8]:
        return packed(np.round(numbers / step).astype(np.int64))

    header = len(own.file_of(cls, with_codes(1.0, np.zeros(0, np.uint8)), about)) - shared
    finest = max(STEPS[0], float(np.abs(numbers).max()) / 2.0**22)  # the range of three bytes
    step = least(lambda x: header + len(codes(x)) <= size, finest, STEPS[1])
    if step is None:
        what = f"{size} bytes, a table takes {header + len(codes(STEPS[1]))} at least"
        raise InputError(what, "bytes", "allow more")
    return cls(with_codes(step, codes(step)), title=source.title, source=source.source)


def least(fits: Callable[[float], bool], low: float, high: float) -> float | None:
    """Approximately the smallest number in [low, high] for which `fits` is true; None if it is true for none.

    `fits` must be true for all larger numbers too.
    """
    if not fits(high):
        return None
    low, high = np.log(low), np.log(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if fits(float(np.exp(middle))) else (middle, high)
    return float(np.exp(high))
