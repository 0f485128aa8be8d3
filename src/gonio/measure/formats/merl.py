"""MERL's `.binary` format: the table of Matusik2003, and a variant in which phi_d covers a full turn."""

from __future__ import annotations

import struct
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ..tables.base import Measurement, in_rgb
from ..tables.half_difference import HalfDifference, sampled
from .base import Format

SCALE = np.array([1.0, 1.15, 1.66]) / 1500.0  # factors of red, green and blue
CELLS = (90, 90)


class Merl(Format):
    """MERL BRDF: three int32 numbers, then red, green and blue planes of float64 over (theta_h, theta_d, phi_d).

    A file has 90 x 90 x 180 cells if phi_d covers half a turn, or 90 x 90 x 360 cells if it covers a full turn. The
    values are f times 1500 for red, 1500 / 1.15 for green and 1500 / 1.66 for blue; a negative value marks an invalid
    cell.
    """

    name: ClassVar[str] = "merl"
    suffixes: ClassVar[tuple[str, ...]] = (".binary",)
    writes: ClassVar[str] = "half-difference"

    def read(self, data: bytes, where: str, item: str = "") -> HalfDifference:
        if len(data) < 12:
            raise InputError(f"{len(data)} bytes, not even a header of 12", where, "the file is truncated")
        shape = struct.unpack("<3i", data[:12])
        if shape[:2] != CELLS or shape[2] not in (180, 360):
            what = f"{' x '.join(map(str, shape))} cells, 90 x 90 x 180 or 90 x 90 x 360 expected"
            raise InputError(what, where, "this is not a MERL file, or it is damaged")
        cells = shape[0] * shape[1] * shape[2]
        wanted = 12 + 3 * 8 * cells
        if len(data) != wanted:
            fault = "truncated" if len(data) < wanted else "longer than its header says"
            raise InputError(f"{len(data)} bytes, {wanted} expected", where, f"the file is {fault}")
        planes = np.frombuffer(data, "<f8", offset=12).reshape(3, *shape)
        return HalfDifference(
            np.moveaxis(planes, 0, -1) * SCALE,
            np.pi if shape[2] == 180 else 2.0 * np.pi,
            where=where,
            source={"format": self.name},
        )

    def write(self, table: Measurement) -> bytes:
        assert isinstance(table, HalfDifference), "ensured by `resampled`"
        values = in_rgb(table.values, table.wavelengths) / SCALE
        values[~table.valid] = -1.0
        return struct.pack("<3i", *table.values.shape[:3]) + np.moveaxis(values, -1, 0).astype("<f8").tobytes()

    def resampled(self, source: Measurement, phi: int | None = None) -> Measurement:
        """The table itself if it has the cells of a MERL file; otherwise, a table evaluated at the centers of these.

        phi  number of cells along phi_d: 180 for half a turn, or 360 for a full turn, which preserves nonreciprocal
             values; None uses the number in the table if this is valid, and 180 otherwise
        """
        if isinstance(source, HalfDifference) and source.values.shape[:3] in ((*CELLS, 180), (*CELLS, 360)):
            cells = source.values.shape[2]
            if (cells == 180) == (source.turn < 4.0) and phi in (None, cells):
                return source
        cells = 180 if phi is None else phi
        turn = np.pi if cells == 180 else 2.0 * np.pi
        return sampled(source.rgb, (*CELLS, cells), turn, title=source.title, source=source.source)
