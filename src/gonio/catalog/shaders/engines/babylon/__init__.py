"""Babylon.js: the fragment program for PBRMaterial, and the table for energy conservation."""

from __future__ import annotations

import base64
import binascii
import io
import re
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from .....errors import InputError

PACKAGE = "@babylonjs/core"
_TABLE = "Misc/brdfTextureTools.js"
_PICTURE = re.compile(r'_environmentBRDFBase64Texture\s*=\s*"data:image/png;base64,([A-Za-z0-9+/=]+)"')
_GAMMA = 2.2  # the exponent of `toLinearSpace` without USE_EXACT_SRGB_CONVERSIONS
MAX_SIDE = 4096


def tables(package: Path) -> dict[str, np.ndarray]:
    """The split-sum table: bias, scale + bias, and the albedo of sheen, with rows by roughness and columns by n.v.

    The PNG stores colors with a common divisor in alpha, which the engine converts to half floats when it loads the
    file.
    """
    try:
        text = (package / _TABLE).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"no table: {error.strerror}", str(package / _TABLE), "use @babylonjs/core 7 or later"
        ) from None
    match = _PICTURE.search(text)
    if match is None:
        raise InputError(
            "no PNG of the environment BRDF", _TABLE, '_environmentBRDFBase64Texture = "data:image/png..."'
        )
    try:
        with Image.open(io.BytesIO(base64.b64decode(match[1])), formats=["PNG"]) as picture:
            if max(picture.size) > MAX_SIDE:
                raise InputError(f"{picture.size[0]} x {picture.size[1]} texels", _TABLE, f"use at most {MAX_SIDE}")
            texels = np.asarray(picture.convert("RGBA"), np.float64) / 255.0
    except (binascii.Error, UnidentifiedImageError, OSError, ValueError, SyntaxError) as error:
        raise InputError(f"its PNG cannot be read: {error}", _TABLE, "the package may be truncated") from None
    expanded = texels[..., :3] ** _GAMMA / np.maximum(texels[..., 3:], 1.0 / 255.0)
    return {"environmentBrdf": expanded.astype(np.float16).astype(np.float64)}
