"""Measured materials: their files (`formats`), their tables (`tables`), and the material that a table is (`materials`).

table = read("gold.binary")                  a table of one kind, with what is known of it
compare.convert("gold.binary", "gold.bsdf").error    in another format, and how far off that is
"""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import InputError, did_you_mean
from .formats.base import Format, by_suffix, contents
from .tables.base import Measurement

_read: dict[tuple[str, str], tuple[tuple[int, int], Measurement]] = {}
SAMPLE = "sample"  # names the small table that comes with Gonio, made by docs/make_sample_table.py
KEPT = 8  # tables in memory, the last that were asked for


def suffixes() -> list[str]:
    """The suffixes of all formats."""
    return sorted({suffix for known in Format.family.all().values() for suffix in known.suffixes})


def parted(file: str) -> tuple[str, str]:
    """File and item of "FILE" or "FILE:ITEM", as files that hold several materials are named."""
    path, colon, item = file.rpartition(":")
    return (path, item) if colon and by_suffix(path) and not by_suffix(file) else (file, "")


def names_table(text: str) -> bool:
    """Whether a text names a file of measurements by its suffix: "gold.binary", "merl.npz:chrome".

    Of a format whose files hold several materials, only with one of them: a .npz alone may be anything.
    """
    path, item = parted(text)
    found = by_suffix(path)
    return bool(found) and (bool(item) or not found[0].several)


def format_of(path: Path, data: bytes | None = None) -> Format:
    """The format of a file, by its suffix, and by its contents where formats share one; InputError where none fits.

    data  None: the file is to be written
    """
    found = by_suffix(path)
    if not found:
        hint = did_you_mean(path.suffix, suffixes())
        raise InputError(f"'{path.suffix}' is no format of measurements", str(path), hint)
    return next((one for one in found if data is not None and one.fits(data)), found[0])


def read(file: str | os.PathLike[str]) -> Measurement:
    """The table in a file, read once for each state in which it was saved.

    file  a path, behind a colon the item where the file holds several materials
    Raises InputError for what is missing, damaged, or of no known format.
    """
    text, item = parted(os.fspath(file))
    path = Path(__file__).parent / "sample.gonio" if text == SAMPLE else Path(os.path.expanduser(text))
    format_of(path)
    try:
        about = path.stat()
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{path}'", str(path), str(getattr(error, "strerror", "") or "")) from None
    key, stamp = (str(path.absolute()), item), (about.st_mtime_ns, about.st_size)
    known = _read.pop(key, None)
    if known is None or known[0] != stamp:
        data = contents(path)
        known = stamp, format_of(path, data).read(data, str(path), item)
    _read[key] = known
    while len(_read) > KEPT:
        _read.pop(next(iter(_read)))
    return known[1]
