"""Adaptive tables with values stored as rounded cosine coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from .. import colours
from .base import Floats
from .log_table import COLOURS, from_cosines, head, unpacked
from .rebuilt import Rebuilt

# lower bound of the luminance, relative to its mean for a view direction, so that light between black nodes is sampled
MIN_LUMINANCE = 0.02


class LogAdaptive(Rebuilt):
    """An adaptive table of asinh(value / offset), stored as cosine coefficients over (view, y, x).

    Each coefficient is rounded to a multiple of `step`. asinh is logarithmic for large values of either sign, and is
    also defined for the small negative values in real files. Directions are sampled according to the luminance of the
    values, so the array `luminance` is not stored.
    """

    name = "adaptive-log"
    axes: ClassVar[Mapping[str, str]] = {
        **Rebuilt.axes,
        "cells": "views, y and x",
        "codes": "integers, times `step` the cosine coefficients of asinh(value / offset)",
    }

    def __init__(self, stored: Mapping[str, NDArray[np.generic]], where: str = "", **about: ops.Value) -> None:
        """A table from the arrays of a file.

        stored  the arrays of `Rebuilt` without luminance and values, and: cells, scale (1, step, offset), codes
        where   name of the file in errors
        """
        self.stored = dict(stored)
        shape, _, step, offset = head(stored, where)
        views = np.size(stored["phi_i"]), np.size(stored["theta_i"])
        if views[0] * views[1] != shape[0]:
            raise InputError(f"{shape[0]} views, {views[0]} x {views[1]} expected", where, "the file is damaged")
        logs = from_cosines(unpacked(stored["codes"], shape, where) * step) @ COLOURS
        with np.errstate(over="ignore"):
            values = (offset * np.sinh(logs)).reshape(*views, *shape[1:], 3)
        luminance = np.maximum(values @ colours.LUMINANCE, 0.0)
        luminance = luminance + MIN_LUMINANCE * luminance.mean(axis=(2, 3), keepdims=True) + 1e-12
        super().__init__({**stored, "luminance": luminance, "values": np.moveaxis(values, -1, 2)}, where, **about)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return dict(self.stored)


def log_values(values: Floats, offset: float) -> Floats:
    """Convert values (phi_i, theta_i, 3, y, x) to asinh(value / offset) as brightness and two color differences.

    The result has the shape (view, y, x, 3).
    """
    last = np.moveaxis(values, 2, -1)
    return np.arcsinh(last.reshape(-1, *last.shape[2:]) / offset) @ COLOURS.T
