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
ONE_WAY = 0.01  # relative change of f by swapping wo and wi above which a full turn of phi_d is stored


class Method:
    """A method of representing a table in fewer bytes.

    name    its name on the command line
    shared  whether several materials are represented together, in one file, with shared data
    """

    family: ClassVar[Family[Method]]
    name: ClassVar[str] = ""
    shared: ClassVar[bool] = False

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        """The compressed tables, of kinds that `.gonio` files can hold.

        size  bytes per material, approximately; ignored by a kind of fixed size
        Raises InputError for tables to which the method does not apply.
        """
        raise NotImplementedError


Method.family = Family("method", "gonio.compression", ["gonio.measure.compression"], instances_of(Method))


def over_half_vectors(table: Measurement) -> HalfDifference:
    """The table itself if it is an RGB table over half vector and difference angle; else one of MERL's size, over a
    full turn of phi_d if swapping the two directions matters."""
    if isinstance(table, HalfDifference) and table.values.shape[-1] == 3:
        return table
    one_way = not table.reciprocal and asymmetry(table) > ONE_WAY
    shape, turn = ((*CELLS[:2], 2 * CELLS[2]), 2.0 * np.pi) if one_way else (CELLS, np.pi)
    return sampled(table.rgb, shape, turn, title=table.title, source=table.source)
