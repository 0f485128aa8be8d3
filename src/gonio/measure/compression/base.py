"""The interface of a compression method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from ...members import Family, instances_of
from ..compare import asymmetry
from ..tables.base import Measurement
from ..tables.half_difference import HalfDifference, sampled

CELLS = (90, 90, 180)
ONE_WAY = 0.01  # if swapping wo and wi changes f by more than this, relative, a full turn of phi_d is stored


class Method:
    """A method of compressing tables.

    name    name on the command line
    shared  whether several materials are compressed together, with shared data in one file
    """

    family: ClassVar[Family[Method]]
    name: ClassVar[str] = ""
    shared: ClassVar[bool] = False

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        """The compressed tables, whose kinds can be stored in `.gonio` files.

        size  approximate number of bytes per material; ignored if the kind has a fixed size
        Raises InputError for tables to which the method does not apply.
        """
        raise NotImplementedError


Method.family = Family("method", "gonio.compression", ["gonio.measure.compression"], instances_of(Method))


def over_half_vectors(table: Measurement) -> HalfDifference:
    """The table itself if it is an RGB table over half and difference angles; otherwise, a table of MERL's size.

    The latter covers a full turn of phi_d if the material is not reciprocal.
    """
    if isinstance(table, HalfDifference) and table.values.shape[-1] == 3:
        return table
    one_way = not table.reciprocal and asymmetry(table) > ONE_WAY
    shape, turn = ((*CELLS[:2], 2 * CELLS[2]), 2.0 * np.pi) if one_way else (CELLS, np.pi)
    return sampled(table.rgb, shape, turn, title=table.title, source=table.source)
