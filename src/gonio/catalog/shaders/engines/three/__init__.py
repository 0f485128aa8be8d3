"""three.js: the fragment programs of WebGLRenderer and WebGPURenderer for the standard and physical materials."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .....errors import InputError
from .....spirv.literals import array_in
from . import tsl

PACKAGE = "three"
_TABLE = "src/renderers/shaders/DFGLUTData.js"


def tables(package: Path) -> dict[str, np.ndarray]:
    """The split-sum table: half floats of scale and bias, with rows by n.v and columns by roughness."""
    try:
        text = (package / _TABLE).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"no table: {error.strerror}", str(package / _TABLE), "use three 0.181 or later") from None
    _, words = array_in(text, "DATA", _TABLE)
    size = round((len(words) / 2) ** 0.5)
    if len(words) != 2 * size * size or any(not 0 <= word < 1 << 16 for word in words):
        raise InputError(f"{len(words)} numbers, two half floats per texel of a square expected", _TABLE)
    return {"dfgLUT": np.array(words, np.uint16).view(np.float16).astype(np.float64).reshape(size, size, 2)}


def generated(package: Path) -> dict[str, str]:
    """The materials of the TSL build: shaders and adapters by file name."""
    return tsl.generated(package, Path(__file__).parent)
