"""Surfaces from a file of heights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...pictures import images
from .base import Floats, Patch, Surface, of_heights, parameter

MIN_PIXELS, MAX_PIXELS = 4, 1024  # limits of the number of pixels along each side
SEAM = 2.0  # a map is periodic if the step from its last row to its first is at most this many times the RMS step


@dataclass(frozen=True)
class Heightfield(Surface):
    """A map of heights, one value per pixel (.exr, .hdr, .npz), of a measured or artificial surface.

    If the map is not periodic, that is, if its last row or column does not join the first, it is extended by its mirror
    image.
    """

    name: ClassVar[str] = "heightfield"

    file: str
    spacing: float = parameter(1.0, "distance between two pixels, in the unit of the heights", 1e-12, 1e12)
    scale: float = parameter(1.0, "factor by which the heights are multiplied", -1e12, 1e12)

    @classmethod
    def reads(cls, text: str) -> bool:
        return Path(text).suffix.lower() in (".exr", ".hdr", ".npz")

    def patch(self, rng: np.random.Generator) -> Patch:
        heights = read(self.file) * (self.scale / self.spacing)  # in units of pixels, because float32 has few digits
        for axis in (0, 1):
            if _jump(heights, axis) > SEAM:
                heights = np.concatenate([heights, np.flip(heights, axis)], axis)
        return of_heights(heights)


def read(file: str) -> Floats:
    """The heights in a file, (y, x). Raises InputError if they are invalid."""
    pixels = images.read(file).pixels.astype(np.float64)
    rows, columns = pixels.shape[:2]
    if min(rows, columns) < MIN_PIXELS or max(rows, columns) > MAX_PIXELS:
        what = f"{columns} x {rows} pixels, {MIN_PIXELS} to {MAX_PIXELS} along each side expected"
        raise InputError(what, file, "scale or cut the map")
    bad = int(np.count_nonzero(~np.isfinite(pixels).all(axis=2)))
    if bad:
        raise InputError(f"{bad} of {rows * columns} heights are not finite", file, "fill the gaps in the map")
    if not np.array_equal(pixels[..., :1].repeat(3, axis=2), pixels):
        raise InputError("the three channels differ, one height per pixel expected", file, "keep one channel only")
    return pixels[..., 0]


def _jump(heights: Floats, axis: int) -> float:
    """The RMS step from the last row to the first, divided by the RMS step between adjacent rows."""
    usual = float(np.sqrt(np.mean(np.square(np.diff(heights, axis=axis)))))
    seam = float(np.sqrt(np.mean(np.square(np.take(heights, 0, axis) - np.take(heights, -1, axis)))))
    return seam / usual if usual > 0.0 else float(seam > 0.0) * 2.0 * SEAM
