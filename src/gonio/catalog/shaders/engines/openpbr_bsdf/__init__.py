"""Adobe's openpbr-bsdf: the GLSL interface, with the tables as textures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .....errors import InputError

PACKAGE = "openpbr-bsdf"
MARK = "impl/openpbr_bsdf.h"
SIZE = 32  # number of entries along each axis of a table
UNORM = 65535.0  # the number that represents 1 in the energy tables
MAX_BYTES = 4 << 20
_ENERGIES = {
    "ideal_dielectric_energy_complement": 3,
    "ideal_dielectric_avg_energy_complement": 2,
    "ideal_dielectric_reflection_ratio": 2,
    "opaque_dielectric_energy_complement": 3,
    "opaque_dielectric_avg_energy_complement": 2,
    "ideal_metal_energy_complement": 2,
    "ideal_metal_avg_energy_complement": 1,
}  # number of axes of each table
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE]-?\d+)?")


def tables(package: Path) -> dict[str, np.ndarray]:
    """The energy tables, with 1 to 3 axes and one channel, and the fuzz table, with 2 axes and three channels."""
    energies = {}
    for name, axes in _ENERGIES.items():
        shape = (*(SIZE,) * axes, 1) if axes > 1 else (1, SIZE, 1)  # the library reads rows as textures with one row
        energies[name] = _numbers(package, name, shape) / UNORM
    return {**energies, "ltc": _numbers(package, "ltc", (SIZE, SIZE, 3))}


def _numbers(package: Path, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """The numbers in a header file that contains data."""
    path = package / "impl" / "data" / f"openpbr_{name}_data.h"
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"larger than {MAX_BYTES >> 20} MB", str(path), "use a table of openpbr-bsdf")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"no table: {error}", str(path), "use a checkout of openpbr-bsdf with impl/data") from None
    words = _NUMBER.findall(_COMMENT.sub(" ", text))
    if len(words) != np.prod(shape):
        raise InputError(f"{len(words)} numbers, {np.prod(shape)} expected", str(path))
    return np.array(words, np.float64).reshape(shape)
