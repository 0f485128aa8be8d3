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

MIN_LUMINANCE = 0.02  # fraction of a view's mean luminance, for light between nodes that are black


class LogAdaptive(Rebuilt):
    """An adaptive table of asinh(value / offset) as cosine coefficients over (view, y, x), each a multiple of `step`.

    asinh is logarithmic for large values of either sign, since real files have small negative values. Samples follow
    the luminance of these values, so `luminance` need not be stored.
    """

    name = "adaptive-log"
    axes: ClassVar[Mapping[str, str]] = {
        **Rebuilt.axes,
        "cells": "views, y and x",
        "codes": "integers, times `step` the cosine coefficients of asinh(value / offset)",
    }

    def __init__(self, stored: Mapping[str, NDArray[np.generic]], where: str = "", **about: ops.Value) -> None:
        """stored  the arrays of `Rebuilt` without luminance and values, and cells, scale (1, step, offset), codes"""
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
    """asinh(value / offset) as brightness and two differences, (view, y, x, 3), from (phi_i, theta_i, 3, y, x)."""
    last = np.moveaxis(values, 2, -1)
    return np.arcsinh(last.reshape(-1, *last.shape[2:]) / offset) @ COLOURS.T
