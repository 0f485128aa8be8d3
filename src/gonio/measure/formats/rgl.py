"""The RGL's `.bsdf` format: tensor files with tables in adaptive coordinates (Dupuy2018)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..tables.adapted import adapted
from ..tables.adaptive import Adaptive
from ..tables.base import Measurement
from .base import Format

MAGIC = b"tensor_file\0"
TYPES = {
    1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8",
}  # fmt: skip
ALIGNED = 8  # bytes: fields start at multiples of this, and a file may end with padding of up to this size
FIELDS, NAME, RANK = 64, 256, 8  # limits of plausible files: fields, characters of a name, axes of a field


class Rgl(Format):
    """RGL BSDF: a tensor file (`tensor_file`, version 1.0) of Dupuy2018, RGB or spectral.

    A field is described by the length of its name (u16), the name, the number of axes (u16), the type (u8), the offset
    (u64) and the size of each axis (u64). The required fields are phi_i, theta_i, ndf, sigma, vndf and luminance, and
    either rgb or wavelengths and spectra. Other fields are ignored.
    """

    name: ClassVar[str] = "rgl"
    suffixes: ClassVar[tuple[str, ...]] = (".bsdf",)
    writes: ClassVar[str] = "adaptive"

    def fits(self, data: bytes) -> bool:
        return data.startswith(b"tensor_file")

    def read(self, data: bytes, where: str, item: str = "") -> Adaptive:
        if not data.startswith(MAGIC):
            hint = "Zemax's .bsdf is text, and starts with Source or a comment"
            raise InputError("not a tensor file: it does not start with 'tensor_file'", where, hint)
        fields = tensors(data, where)
        spectral = "wavelengths" in fields
        names = ["phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "spectra" if spectral else "rgb"]
        for name in names:
            if name not in fields:
                raise InputError(f"the field '{name}' is missing", where, "it has " + ", ".join(sorted(fields)))
            if fields[name].dtype.kind != "f":
                raise InputError(f"the field '{name}' is of type {fields[name].dtype}, floats expected", where)
        wavelengths = fields["wavelengths"].astype(np.float64).ravel() if spectral else None
        if wavelengths is not None and (not np.all(np.isfinite(wavelengths)) or np.any(np.diff(wavelengths) <= 0.0)):
            raise InputError("the wavelengths do not increase", where)
        flag = fields.get("jacobian", np.ones(1)).ravel()
        jacobian = bool(flag[0]) if flag.size else True
        text = fields.get("description", np.zeros(0, np.uint8))
        title = text.tobytes().decode("utf-8", "replace").strip("\0 \n") if text.dtype == np.uint8 else ""
        parts = {**{name: fields[name] for name in names[:-1]}, "values": fields[names[-1]]}
        return Adaptive(parts, jacobian, where, title, {"format": self.name}, wavelengths)

    def write(self, table: Measurement) -> bytes:
        assert isinstance(table, Adaptive), "ensured by `resampled`"
        values = {"rgb": table.values}
        if table.wavelengths is not None:
            values = {"wavelengths": table.wavelengths, "spectra": table.values}
        floats = {
            "phi_i": table.phi,
            "theta_i": table.theta,
            "sigma": table.sigma,
            "ndf": table.ndf,
            "vndf": table.vndf,
            "luminance": table.luminance,
            **values,
        }
        return written({
            "description": np.frombuffer(table.title.encode() or b"-", np.uint8),
            **{name: np.asarray(part, np.float32) for name, part in floats.items()},
            "jacobian": np.array([table.jacobian], np.uint8),
        })  # fmt: skip

    def resampled(self, source: Measurement) -> Measurement:
        """The table itself if it is adaptive; otherwise, an adaptive table computed from it (`tables.adapted`)."""
        return source if isinstance(source, Adaptive) else adapted(source)


def tensors(data: bytes, where: str) -> dict[str, NDArray[np.generic]]:
    """The fields of a tensor file, as views into its bytes, so no further memory is allocated.

    where  name of the file in errors
    """
    place = len(MAGIC)

    def take(form: str) -> tuple[int, ...]:
        nonlocal place
        size = struct.calcsize(form)
        if place + size > len(data):
            raise InputError(f"the list of fields ends at byte {len(data)}", where, "the file is truncated")
        fields = struct.unpack_from(form, data, place)
        place += size
        return fields

    major, minor, count = take("<BBI")
    if (major, minor) != (1, 0):
        raise InputError(f"version {major}.{minor} of tensor files, 1.0 expected", where)
    if not 0 < count <= FIELDS:
        raise InputError(f"{count} fields, 1 to {FIELDS} expected", where, "the file is damaged")
    fields: dict[str, NDArray[np.generic]] = {}
    end = 0
    for _ in range(count):
        (length,) = take("<H")
        if not 0 < length <= NAME or place + length > len(data):
            raise InputError(f"a field's name of {length} characters", where, "the file is damaged")
        name = data[place : place + length].decode("utf-8", "replace")
        place += length
        rank, kind, offset = take("<HBQ")
        if rank > RANK or kind not in TYPES:
            raise InputError(f"the field '{name}' has {rank} axes and type {kind}", where, "the file is damaged")
        shape = take(f"<{rank}Q")
        dtype = np.dtype(TYPES[kind])
        size = dtype.itemsize
        for side in shape:  # Python's integers do not overflow
            size *= side
        if size == 0 or offset + size > len(data):
            what = f"the field '{name}' claims {' x '.join(map(str, shape))} values at byte {offset}"
            raise InputError(f"{what}, the file has {len(data)} bytes", where, "the file is truncated or damaged")
        if name in fields:
            raise InputError(f"the field '{name}' occurs twice", where, "the file is damaged")
        fields[name] = np.frombuffer(data, dtype, size // dtype.itemsize, offset).reshape(shape)
        end = max(end, offset + size)
    if len(data) > end + ALIGNED or data[end:].strip(b"\0"):
        raise InputError(f"{len(data)} bytes, the fields end at {end}", where, "the file is longer than its fields")
    return fields


def written(fields: Mapping[str, NDArray[np.generic]]) -> bytes:
    """The bytes of a tensor file with these fields."""
    numbers = {np.dtype(text): number for number, text in TYPES.items()}
    arrays = {name: np.ascontiguousarray(array) for name, array in fields.items()}
    start = len(MAGIC) + 6 + sum(13 + len(name.encode()) + 8 * array.ndim for name, array in arrays.items())
    head, body = bytearray(MAGIC + struct.pack("<BBI", 1, 0, len(arrays))), bytearray()
    for name, array in arrays.items():
        body += b"\0" * (-(start + len(body)) % 8)
        head += struct.pack("<H", len(name.encode())) + name.encode()
        head += struct.pack(f"<HBQ{array.ndim}Q", array.ndim, numbers[array.dtype], start + len(body), *array.shape)
        body += array.tobytes()
    return bytes(head + body)
