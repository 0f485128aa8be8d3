"""How bright a picture is shown on a screen: stops, chosen by hand or by the picture's luminance, and what they clip.

Pictures are linear RGB, float32, (H, W, 3); 1 is white at 0 stops, and each stop doubles.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

RGB = NDArray[np.float32]
Exposure = float | Literal["auto"]

MOST_CLIPPED = 0.01  # of a picture's pixels, before that is worth a word: highlights and lamps may
WHITE = 1.1  # a white furnace is 1 and some noise, of which nothing is lost that a person sees
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear sRGB (IEC 61966-2-1)


def parse(text: str) -> Exposure:
    """Stops of "-1.5", or "auto". InputError where it is neither."""
    try:
        return check("auto" if text == "auto" else float(text))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"'{text}' is no exposure", "--exposure", "give stops, such as -1.5, or auto") from None


def check(exposure: Exposure) -> Exposure:
    """The exposure, or an InputError where it is none."""
    if isinstance(exposure, str) and exposure == "auto":
        return exposure
    if not (isinstance(exposure, int | float) and abs(exposure) <= 100):
        what = f"{exposure} given as exposure"
        raise InputError(what, "--exposure", "give stops from -100 to 100, where 1 doubles the brightness, or auto")
    return exposure


def stops(exposure: Exposure, *pictures: RGB) -> float:
    """The exposure in stops; "auto" is the brightest, in tenths of stops, at which 1 % of the lit pixels clip.

    A lamp or a sky may be more of a picture than that, and would darken all else. So the mean of log luminance comes
    at most 2 stops below middle grey, 18 % of white, where Reinhard2002 puts it.
    Black pixels count for neither; pictures of nothing else are shown as they are. Several are shown alike.
    """
    if exposure != "auto":
        return exposure
    pixels = _pixels(*pictures)
    luminance = pixels @ _LUMINANCE
    lit = luminance > 0
    if not lit.any():
        return 0.0
    grey = math.log2(0.18) - float(np.log2(luminance[lit]).mean())
    return _in_tenths(max(_without_clipping(pixels[lit]), grey - 2))


def clipping(exposure: float, *pictures: RGB, automatic: bool = False) -> str:
    """What to tell of pictures that are too bright for a screen; "" where no more than 1 % of the pixels are.

    automatic  whether the exposure was chosen by `stops`
    """
    pixels = _pixels(*pictures)
    share = float(np.mean(pixels.max(axis=1) * 2.0**exposure > WHITE)) if len(pixels) else 0.0
    if share <= MOST_CLIPPED:
        return ""
    better = _in_tenths(_without_clipping(pixels))
    told = f"{share:.0%} of the pixels are brighter than white and clipped; try --exposure {better:g}"
    return told if automatic else f"{told}, or auto"


def _pixels(*pictures: RGB) -> RGB:
    """(N, 3): those that are numbers."""
    pixels = np.concatenate([picture.reshape(-1, 3) for picture in pictures])
    return pixels[np.isfinite(pixels).all(axis=1)]


def _without_clipping(pixels: RGB) -> float:
    """The most stops at which no more than `MOST_CLIPPED` of the pixels, (N, 3), exceed white."""
    highest = np.quantile(pixels.max(axis=1), 1 - MOST_CLIPPED, method="higher")
    return -math.log2(max(float(highest), 2.0**-100))


def _in_tenths(exposure: float) -> float:
    """Rounded down: brighter would clip more."""
    return math.floor(10 * exposure + 1e-4) / 10
