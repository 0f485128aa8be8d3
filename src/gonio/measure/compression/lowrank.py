"""Low-rank factorizations that several materials share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..tables.base import Floats, Measurement
from ..tables.low_rank import BASES, LowRank, projected
from .base import Method, over_half_vectors
from .log import Logs, coded

RANKS = (3, 4, 6, 9, 13, 18, 24, 32, 44)  # candidate ranks, which are equal along all axes


class Lowrank(Method):
    """lowrank: a core and one basis per axis, computed from the singular vectors of all materials together."""

    name: ClassVar[str] = "lowrank"
    shared: ClassVar[bool] = True

    def compress(self, tables: Sequence[Measurement], size: int) -> list[Measurement]:
        every = [Logs(over_half_vectors(table)) for table in tables]
        if len({one.shape for one in every}) > 1:
            what = "tables of " + " and ".join(sorted({" x ".join(map(str, one.shape)) for one in every}))
            raise InputError(f"{what} share no basis", "FILE", "compress them one by one")
        vectors = [_vectors([one.values for one in every], axis) for axis in range(3)]
        best: tuple[float, list[Measurement]] | None = None
        for rank in RANKS:
            bases = [v[:, :rank].astype(np.float16) for v in vectors]
            stored = dict(zip(BASES, bases, strict=True))
            spent = sum(basis.nbytes for basis in bases)
            if best is not None and spent / len(every) > 0.7 * size:
                break
            compressed: list[Measurement] = []
            missed = 0.0
            for one in every:
                core = projected(one.values, [basis.astype(float) for basis in bases])
                share = spent - spent // len(every)
                try:
                    made = coded(LowRank, one, core, stored, size, share)
                except InputError:
                    if best is not None:
                        return best[1]
                    raise
                missed += _missed(one, made)
                compressed.append(made)
            if best is not None and missed > best[0]:
                break
            best = missed, compressed
        assert best is not None, "a rank that does not fit has raised"
        return best[1]


def _vectors(every: list[Floats], axis: int) -> Floats:
    """The singular vectors of the slices of all materials along an axis, by decreasing singular value."""
    count = every[0].shape[axis]
    gram = np.zeros((count, count))
    for logs in every:
        flat = np.moveaxis(logs, axis, 0).reshape(logs.shape[axis], -1)
        gram = gram + flat @ flat.T
    _, vectors = np.linalg.eigh(gram)
    basis: Floats = vectors[:, ::-1]
    return basis


def _missed(logs: Logs, made: LowRank) -> float:
    """The mean absolute difference of the logarithms."""
    lit: NDArray[np.bool_] = logs.lit
    old = logs.table.values[lit]
    return float(np.abs(np.log(made.values[lit] + logs.offset) - np.log(np.maximum(old, 0.0) + logs.offset)).mean())
