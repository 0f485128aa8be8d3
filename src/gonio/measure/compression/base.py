"""What a method of compression is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from ...members import Family, instances_of
from ..compare import asymmetry
from ..tables.base import Measurement
from ..tables.half_difference import HalfDifference, sampled

CELLS = (90, 90, 180)
ONE_WAY = 0.01  # of f that exchanging wo and wi changes, from which on a whole turn of phi_d is kept


class Method:
    """A way to say a table in fewer bytes.

    name    as the command line has it
    shared  whether several materials are said together, in one file, better than each alone
    """

    family: ClassVar[Family[Method]]
    name: ClassVar[str] = ""
    shared: ClassVar[bool] = False

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        """Tables of kinds that `.gonio` files hold, in about `size` bytes a material or, where the kind has a fixed
        size, in that. Raises InputError for tables that it cannot be used for."""
        raise NotImplementedError


Method.family = Family("method", "gonio.compression", ["gonio.measure.compression"], instances_of(Method))


def over_half_vectors(table: Measurement) -> HalfDifference:
    """The table itself where it is one over half vector and difference in RGB; else one of MERL's size, over a whole
    turn of phi_d where exchanging both directions matters."""
    if isinstance(table, HalfDifference) and table.values.shape[-1] == 3:
        return table
    one_way = not table.reciprocal and asymmetry(table) > ONE_WAY
    shape, turn = ((*CELLS[:2], 2 * CELLS[2]), 2.0 * np.pi) if one_way else (CELLS, np.pi)
    return sampled(table.rgb, shape, turn, title=table.title, source=table.source)
