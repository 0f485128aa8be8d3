"""Half-difference tables stored as products of a few factors, which several materials may share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .base import Floats, finite
from .log_table import LogTable, Shape

BASES = ("basis_theta_h", "basis_theta_d", "basis_phi_d")


class LowRank(LogTable):
    """A table of log(f + offset), stored as core x basis x basis x basis, with one basis per axis (Tucker1966).

    The bases are the leading singular vectors of the slices along each axis. They are computed from one material, or
    from several, which then share them in one file. The entries of the core are integer multiples of `step`.
    """

    name = "low-rank"
    axes: ClassVar[Mapping[str, str]] = {
        "cells": "theta_h (by its square root), theta_d, phi_d, and turn: the range of phi_d, rad",
        "basis_theta_h, basis_theta_d, basis_phi_d": "(cells along the axis, rank)",
        "codes": "integers, times `step` the core of log(f + offset)",
    }

    def frequencies(self, stored: Mapping[str, NDArray[np.generic]], shape: tuple[int, ...], where: str) -> Shape:
        self._bases = [finite(stored[name], name, where) for name in BASES]
        for basis, count in zip(self._bases, shape, strict=True):
            if basis.ndim != 2 or basis.shape[0] != count or not 0 < basis.shape[1] <= count:
                raise InputError(f"a basis of shape {basis.shape} for {count} cells", where, "the file is damaged")
        a, b, c = (basis.shape[1] for basis in self._bases)
        return a, b, c

    def synthesis(self, numbers: Floats, shape: Shape) -> Floats:
        return expanded(numbers, self._bases)


def expanded(core: Floats, bases: list[Floats]) -> Floats:
    """The product core x basis x basis x basis."""
    for axis, basis in enumerate(bases):
        core = np.moveaxis(np.tensordot(basis, core, axes=(1, axis)), 0, axis)
    return core


def projected(logs: Floats, bases: list[Floats]) -> Floats:
    """The core that approximates given logarithms best, for bases with orthonormal columns."""
    return expanded(logs, [basis.T for basis in bases])
