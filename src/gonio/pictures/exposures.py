"""The exposure of pictures for display: parsing, automatic exposure from the luminance, and a check for clipping.

Pictures are linear RGB, float32, (H, W, 3). At 0 stops, the value 1 is white; each stop doubles the brightness.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

RGB = NDArray[np.float32]
Exposure = float | Literal["auto"]

MAX_CLIPPED = 0.01  # maximum fraction of clipped pixels without a warning, because highlights and lamps may clip
WHITE = 1.1  # more than 1, because a white furnace is 1 plus noise, and clipping this noise has no visible effect
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # weights of linear sRGB (IEC 61966-2-1)


def parse(text: str) -> Exposure:
    """Parse stops such as "-1.5", or "auto". Raises InputError for anything else."""
    try:
        return check("auto" if text == "auto" else float(text))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"'{text}' is not an exposure", "--exposure", "give stops, such as -1.5, or auto") from None


def check(exposure: Exposure) -> Exposure:
    """Return the exposure. Raises InputError if it is invalid."""
    if isinstance(exposure, str) and exposure == "auto":
        return exposure
    if not (isinstance(exposure, int | float) and abs(exposure) <= 100):
        what = f"{exposure} given as exposure"
        raise InputError(what, "--exposure", "give stops from -100 to 100, where 1 doubles the brightness, or auto")
    return exposure


def stops(exposure: Exposure, *pictures: RGB) -> float:
    """The exposure in stops, where "auto" is determined from the luminance of the pictures.

    The automatic exposure is the largest, in tenths of stops, at which at most 1 % of the lit pixels clip. A lamp or a
    sky may cover more of a picture and would darken everything else. The exposure is therefore at least so large that
    the mean of the log luminance is 2 stops below middle gray, which is 18 % of white (Reinhard2002). Black pixels are
    ignored; for entirely black pictures, the exposure is 0. Several pictures have a common exposure.
    """
    if exposure != "auto":
        return exposure
    pixels = _pixels(*pictures)
    luminance = pixels @ _LUMINANCE
    lit = luminance > 0
    if not lit.any():
        return 0.0
    gray = math.log2(0.18) - float(np.log2(luminance[lit]).mean())
    return _in_tenths(max(_without_clipping(pixels[lit]), gray - 2))


def clipping(exposure: float, *pictures: RGB, automatic: bool = False) -> str:
    """A warning for pictures that are too bright for a display; "" if at most 1 % of the pixels are clipped.

    automatic  whether the exposure was determined automatically by `stops`
    """
    pixels = _pixels(*pictures)
    clipped = float(np.mean(pixels.max(axis=1) * 2.0**exposure > WHITE)) if len(pixels) else 0.0
    if clipped <= MAX_CLIPPED:
        return ""
    better = _in_tenths(_without_clipping(pixels))
    warning = f"{clipped:.0%} of the pixels are brighter than white and clipped; try --exposure {better:g}"
    return warning if automatic else f"{warning}, or auto"


def _pixels(*pictures: RGB) -> RGB:
    """The finite pixels, (N, 3)."""
    pixels = np.concatenate([picture.reshape(-1, 3) for picture in pictures])
    return pixels[np.isfinite(pixels).all(axis=1)]


def _without_clipping(pixels: RGB) -> float:
    """The largest exposure at which at most `MAX_CLIPPED` of the pixels, (N, 3), exceed white."""
    highest = np.quantile(pixels.max(axis=1), 1 - MAX_CLIPPED, method="higher")
    return -math.log2(max(float(highest), 2.0**-100))


def _in_tenths(exposure: float) -> float:
    """Round an exposure down to tenths of stops, because a brighter picture would clip more pixels."""
    return math.floor(10 * exposure + 1e-4) / 10
