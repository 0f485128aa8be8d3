"""RGL tables stored without their redundant arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from ...errors import InputError
from ..tables.adaptive import Adaptive
from ..tables.base import Measurement
from ..tables.rebuilt import Rebuilt, rebuilding
from .base import Method


class Rgl(Method):
    """rgl: an adaptive table without `vndf`, which is computed from the distribution of normals; its size is fixed."""

    name: ClassVar[str] = "rgl"

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        compressed: list[Measurement] = []
        for table in tables:
            if not isinstance(table, Adaptive):
                what = f"a table of kind {table.name}, an adaptive one expected"
                raise InputError(what, "FILE", "gonio convert IN OUT.bsdf makes one")
            arrays = {**table.arrays(), **rebuilding(table)}
            compressed.append(Rebuilt(arrays, title=table.title, source=table.source, wavelengths=table.wavelengths))
        return compressed
