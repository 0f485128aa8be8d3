"""The placements of Mitsuba's shapes."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

from ..bridge.types import OfVariant, Shape


def placement_reader(mi: ModuleType) -> Callable[[Shape], list[float]]:
    """A function that returns the `to_world` matrix of a shape as 16 numbers, row by row.

    It takes a fifth of the time of `mi.traverse`.
    """
    base: Any = mi.TraversalCallback

    class Reader(base):
        def put(self, name: str, value: OfVariant, flags: int, kind: OfVariant = None) -> None:
            if name == "to_world":
                self.result = value, kind

    def read(shape: Shape) -> list[float]:
        reader = Reader()
        shape.traverse(reader)
        matrix = mi.get_property(*reader.result, shape).matrix
        return [matrix[row, column][0] for row in range(4) for column in range(4)]

    return read
