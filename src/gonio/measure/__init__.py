"""Measured materials: files (`formats`), tables (`tables`) and smaller tables (`compression`).

table = read("gold.binary")                  a table of one kind, with its metadata
compare.convert("gold.binary", "gold.bsdf").error    converted to another format, with the error
"""

from __future__ import annotations

import os
from difflib import get_close_matches
from pathlib import Path

from ..errors import InputError, did_you_mean
from .formats.base import Format, by_suffix, contents
from .tables.base import Measurement

_read: dict[tuple[str, str], tuple[tuple[int, int], Measurement]] = {}
SAMPLE = "sample"  # names the small table shipped with Gonio, made by docs/make_sample_table.py
CACHED = 8  # tables kept in memory, the most recently used


def suffixes() -> list[str]:
    """The suffixes of all formats."""
    return sorted({suffix for known in Format.family.all().values() for suffix in known.suffixes})


def parted(file: str) -> tuple[str, str]:
    """File and item from "FILE" or "FILE:ITEM", for files that hold several materials."""
    path, colon, item = file.rpartition(":")
    return (path, item) if colon and by_suffix(path) and not by_suffix(file) else (file, "")


def names_table(text: str) -> bool:
    """Whether a string names a file of measurements, by the suffix: "gold.binary", "merl.npz:chrome".

    For a format with several materials per file, an item is required: a plain .npz may contain anything.
    """
    path, item = parted(text)
    formats = by_suffix(path)
    return bool(formats) and (bool(item) or not formats[0].several)


def format_of(path: Path, data: bytes | None = None) -> Format:
    """The format of a file, by its suffix, and by its contents if formats share the suffix.

    data  the contents; None if the file is to be written
    Raises InputError for a file of no known format.
    """
    formats = by_suffix(path)
    if not formats:
        hint = did_you_mean(path.suffix, suffixes())
        if path.suffix == ".json":
            hint = 'a fit is `gold.json` on the command line and {"type": "json", "file": "gold.json"} in a scene'
        raise InputError(f"'{path.suffix}' is not a measurement format", str(path), hint)
    return next((one for one in formats if data is not None and one.fits(data)), formats[0])


def _hint(path: Path, error: OSError | ValueError) -> str:
    """How to mend the path of a file that cannot be read."""
    if not isinstance(error, FileNotFoundError):
        return str(getattr(error, "strerror", "") or "")
    if not path.parent.is_dir():
        return f"there is no folder '{path.parent}'"
    near = get_close_matches(path.name, [one.name for one in path.parent.iterdir() if names_table(one.name)], 1)
    return f"did you mean '{near[0]}'?" if near else "check the path"


def read(file: str | os.PathLike[str]) -> Measurement:
    """The table in a file, which is read again only if the file has changed.

    file  a path, followed by :ITEM if the file holds several materials
    Raises InputError for files that are missing, damaged, or of unknown format.
    """
    text, item = parted(os.fspath(file))
    path = Path(__file__).parent / "sample.gonio" if text == SAMPLE else Path(os.path.expanduser(text))
    format_of(path)
    try:
        about = path.stat()
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{path}'", str(path), _hint(path, error)) from None
    key, stamp = (str(path.absolute()), item), (about.st_mtime_ns, about.st_size)
    known = _read.pop(key, None)
    if known is None or known[0] != stamp:
        data = contents(path)
        known = stamp, format_of(path, data).read(data, str(path), item)
    _read[key] = known
    while len(_read) > CACHED:
        _read.pop(next(iter(_read)))
    return known[1]
