"""Check the size of a film against the memory of this machine."""

from __future__ import annotations

import os

from ..errors import InputError

# An estimate per pixel: 9 sums in float64, twice (before and after a pass), the order of the lanes, the picture as
# float64 and float32, and the bytes of the file.
BYTES_PER_PIXEL = 250
MAX_SIDE = 1 << 16  # maximum number of pixels along a side


def check_film(size: tuple[int, int], where: str) -> None:
    """Raise InputError, which names `where`, if a film has no pixels or is too large for the memory of this machine."""
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"a film of {width}x{height} has no pixels", where, "give 1x1 or more")
    needed = width * height * BYTES_PER_PIXEL
    if needed > memory():
        gib = 1 << 30
        what = f"a film of {width}x{height} needs about {needed / gib:.0f} GiB"
        raise InputError(f"{what}, this machine has {memory() / gib:.0f} GiB", where, "give a smaller size")
    if max(width, height) > MAX_SIDE:
        what = f"a film of {width}x{height} is larger than {MAX_SIDE} pixels along a side"
        raise InputError(what, where, "give a smaller size")


def memory() -> int:
    """The size of this machine's memory in bytes; 8 GiB if the system does not report it."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 8 << 30
