"""Heights from a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...pictures import images
from .base import Floats, Patch, Surface, of_heights, parameter

MIN_PIXELS, MAX_PIXELS = 4, 1024  # pixels along a side
SEAM = 2.0  # a map counts as periodic if the step from its last row to its first is at most this many RMS steps


@dataclass(frozen=True)
class Heightfield(Surface):
    """A map of heights, one value per pixel (.exr, .hdr, .npz): a measured surface, or one that you made.

    A map that is not periodic, in that its last row or column does not join its first, is extended by its mirror image.
    """

    name: ClassVar[str] = "heightfield"

    file: str
    spacing: float = parameter(1.0, "distance of two pixels, in the unit of the heights", 1e-12, 1e12)
    scale: float = parameter(1.0, "factor on the heights", -1e12, 1e12)

    @classmethod
    def reads(cls, text: str) -> bool:
        return Path(text).suffix.lower() in (".exr", ".hdr", ".npz")

    def patch(self, rng: np.random.Generator) -> Patch:
        heights = read(self.file) * (self.scale / self.spacing)  # in pixels, as float32 has few digits
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
    """Ratio of the RMS step from the last row to the first to the RMS step between adjacent rows."""
    usual = float(np.sqrt(np.mean(np.square(np.diff(heights, axis=axis)))))
    seam = float(np.sqrt(np.mean(np.square(np.take(heights, 0, axis) - np.take(heights, -1, axis)))))
    return seam / usual if usual > 0.0 else float(seam > 0.0) * 2.0 * SEAM
