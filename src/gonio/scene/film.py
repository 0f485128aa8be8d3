"""The size of a film: what this machine can hold."""

from __future__ import annotations

import os

from ..errors import InputError

# Per pixel: 9 sums in float64, twice (before and after a pass), lane order, picture as float64 and float32, the
# file's bytes. It is the estimate by which a film is refused as too large.
BYTES_PER_PIXEL = 250
MAX_SIDE = 1 << 16  # pixels


def check_film(size: tuple[int, int], where: str) -> None:
    """Raise InputError for a film without pixels, or one that one sample per pixel would not fit the memory."""
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"a film of {width}x{height} has no pixels", where, "give 1x1 or more")
    needed = width * height * BYTES_PER_PIXEL
    if needed > memory():
        gib = 1 << 30
        what = f"a film of {width}x{height} needs about {needed / gib:.0f} GiB"
        raise InputError(f"{what}, this machine has {memory() / gib:.0f} GiB", where, "give a smaller size")
    if max(width, height) > MAX_SIDE:
        what = f"a film of {width}x{height} is longer than {MAX_SIDE} pixels"
        raise InputError(what, where, "give a smaller size")


def memory() -> int:
    """Bytes of memory in this machine; a guess of 8 GiB where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 8 << 30
