"""Half-difference tables stored as logarithms, transformed and quantized."""

from __future__ import annotations

import lzma
from collections.abc import Mapping
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from .base import Floats
from .half_difference import HalfDifference, centres

Ints = NDArray[np.int64]

LARGEST = 90 * 90 * 360  # maximum number of cells in a compressed file: the largest of MERL's sizes
PLANES = 3  # bytes per integer
# The streams are raw, without a header, so a file cannot request more memory than these settings. The context bits are
# 0 because the bytes of integers are not text.
CODER = [{"id": lzma.FILTER_LZMA2, "dict_size": 1 << 20, "lc": 0, "lp": 0, "pb": 0}]
# An orthonormal basis of brightness and two color differences: the channels of most materials differ by a nearly
# constant factor.
COLOURS = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [0.5, -1.0, 0.5]])
COLOURS = COLOURS / np.linalg.norm(COLOURS, axis=1, keepdims=True)


class LogTable(HalfDifference):
    """A table of log(f + offset), stored as cosine coefficients, each rounded to a multiple of `step`.

    The discrete cosine transform over (theta_h, theta_d, phi_d) represents the smooth parts by few coefficients; most
    of the others are rounded to 0. Rounding causes a uniform error of the logarithm, and hence a relative error of f.
    When the table is read, cells whose center lies below the surface are invalid. All other cells, including those that
    were invalid in the original, have the values of the cosine series.
    """

    name = "log-table"
    axes: ClassVar[Mapping[str, str]] = {
        "cells": "theta_h (by its square root), theta_d, phi_d, and turn: the range of phi_d, rad",
        "codes": "integers, times `step` the cosine coefficients of log(f + offset), by frequency",
    }

    def __init__(self, stored: Mapping[str, NDArray[np.generic]], where: str = "", **about: ops.Value) -> None:
        """A table from the arrays of a file.

        stored  the arrays: cells, scale (turn, step, offset), codes
        where   name of the file in errors
        """
        self.stored = dict(stored)
        shape, turn, step, offset = head(stored, where)
        logs = self.synthesis(unpacked(stored["codes"], self.frequencies(stored, shape, where), where) * step, shape)
        with np.errstate(over="ignore"):
            values = np.maximum(np.exp(logs @ COLOURS) - offset, 0.0)
        values[~above(shape, turn)] = -1.0
        super().__init__(values, turn, where=where, **about)

    def frequencies(self, stored: Mapping[str, NDArray[np.generic]], shape: tuple[int, ...], where: str) -> Shape:
        """The number of coefficients along each axis; `where` is the name of the file in errors."""
        return shape[0], shape[1], shape[2]

    def synthesis(self, numbers: Floats, shape: Shape) -> Floats:
        """The logarithms, (theta_h, theta_d, phi_d, 3), from the coefficients `numbers`."""
        return from_cosines(numbers)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return dict(self.stored)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]], **about: ops.Value) -> LogTable:
        return cls(arrays, **about)


Shape = tuple[int, int, int]


def head(stored: Mapping[str, NDArray[np.generic]], where: str) -> tuple[Shape, float, float, float]:
    """(cells along each axis, turn, step, offset). Raises InputError, which names `where`, if they are invalid."""
    cells = [int(x) for x in np.asarray(stored["cells"]).ravel()]
    scale = np.asarray(stored["scale"], np.float64).ravel()
    if len(cells) != 3 or min(cells) < 2 or cells[0] * cells[1] * cells[2] > LARGEST:
        raise InputError(f"{' x '.join(map(str, cells[:4]))} cells, at most {LARGEST} expected", where)
    if len(scale) != 3 or not np.all(np.isfinite(scale)) or min(scale) <= 0.0:
        raise InputError("turn, step and offset are not three positive numbers", where, "the file is damaged")
    return (cells[0], cells[1], cells[2]), float(scale[0]), float(scale[1]), float(scale[2])


def to_cosines(logs: Floats) -> Floats:
    """The discrete cosine transform over the first three axes, orthonormal."""
    from scipy.fft import dctn

    transformed: Floats = dctn(logs, axes=(0, 1, 2), norm="ortho", workers=2)
    return transformed


def from_cosines(numbers: Floats) -> Floats:
    """The inverse of `to_cosines`."""
    from scipy.fft import idctn

    transformed: Floats = idctn(numbers, axes=(0, 1, 2), norm="ortho", workers=2)
    return transformed


@lru_cache(maxsize=4)
def above(shape: Shape, turn: float) -> NDArray[np.bool_]:
    """The cells at whose center both directions are above the surface."""
    wo, wi = centres(shape, turn)
    return np.asarray(np.minimum(wo[:, 2], wi[:, 2]) > 1e-9).reshape(shape)


# --------------------------------------------------------------------------- integers as bytes


@lru_cache(maxsize=8)
def _order(shape: Shape) -> Ints:
    """The order of coefficients from low to high frequency, so that most zeros are contiguous."""
    along = np.meshgrid(*(np.arange(n) / n for n in shape), indexing="ij")
    return np.argsort(np.sum(along, axis=0).ravel(), kind="stable")


def packed(numbers: Ints) -> NDArray[np.uint8]:
    """Compress integer coefficients, (..., 3), to bytes.

    The coefficients are sorted by frequency, without the trailing zeros. Sign and absolute value are combined into one
    non-negative integer. All low bytes come first, then all middle bytes, then all high bytes.
    """
    shape = numbers.shape[0], numbers.shape[1], numbers.shape[2]
    inline = numbers.reshape(-1, 3)[_order(shape)]
    used = np.flatnonzero(inline.any(axis=1))
    inline = inline[: used[-1] + 1 if len(used) else 0].T
    folded = np.minimum(2 * np.abs(inline) - (inline < 0), 256**PLANES - 1)
    planes = np.concatenate([(folded >> 8 * plane & 255).ravel() for plane in range(PLANES)]).astype(np.uint8)
    return np.frombuffer(lzma.compress(planes.tobytes(), lzma.FORMAT_RAW, filters=CODER), np.uint8)


def unpacked(codes: NDArray[np.generic], shape: Shape, where: str = "") -> Floats:
    """The inverse of `packed`: coefficients, (..., 3). Raises InputError, which names `where`, for invalid bytes."""
    row = 3 * PLANES
    most = row * shape[0] * shape[1] * shape[2]
    try:
        reader = lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=CODER)
        data = reader.decompress(np.asarray(codes).astype(np.uint8).tobytes(), most + 1)
    except (lzma.LZMAError, EOFError) as error:
        raise InputError(f"its codes cannot be read: {error}", where, "the file is damaged") from None
    if len(data) > most or len(data) % row or not reader.eof:
        raise InputError(f"its codes hold {len(data)} bytes, a multiple of {row} up to {most} expected", where)
    planes = np.frombuffer(data, np.uint8).reshape(PLANES, 3, -1).astype(np.int64)
    folded = sum(256**number * plane for number, plane in enumerate(planes))
    numbers = np.zeros((shape[0] * shape[1] * shape[2], 3))
    numbers[_order(shape)[: folded.shape[1]]] = np.where(folded % 2, -(folded + 1) // 2, folded // 2).T
    return numbers.reshape(*shape, 3)
