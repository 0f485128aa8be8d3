"""Measured materials: files (`formats`), tables (`tables`) and smaller tables (`compression`).

table = read("gold.binary")                          # a table with its metadata
compare.convert("gold.binary", "gold.bsdf").error    # the error of a conversion to another format
"""

from __future__ import annotations

import os
from difflib import get_close_matches
from pathlib import Path

from ..errors import InputError, did_you_mean
from .formats.base import Format, by_suffix, contents
from .tables.base import Measurement

_read: dict[tuple[str, str], tuple[tuple[int, int], Measurement]] = {}
SAMPLE = "sample"  # name of the small table that is shipped with Gonio, made by docs/make_sample_table.py
CACHED = 8  # number of most recently used tables that stay in memory


def suffixes() -> list[str]:
    """The suffixes of all formats."""
    return sorted({suffix for known in Format.family.all().values() for suffix in known.suffixes})


def parted(file: str) -> tuple[str, str]:
    """Split "FILE:ITEM", which names one material of several in a file, into file and item; the item may be missing."""
    path, colon, item = file.rpartition(":")
    return (path, item) if colon and by_suffix(path) and not by_suffix(file) else (file, "")


def names_table(text: str) -> bool:
    """Whether a string names a measurement file, judging by its suffix: "gold.binary", "merl.npz:chrome".

    If the format has several materials per file, the item is required, because a plain .npz may contain any data.
    """
    path, item = parted(text)
    formats = by_suffix(path)
    return bool(formats) and (bool(item) or not formats[0].several)


def format_of(path: Path, data: bytes | None = None) -> Format:
    """The format of a file, from its suffix, and from its contents if several formats share the suffix.

    data  the contents; None for a file that will be written
    Raises InputError if the format is unknown.
    """
    formats = by_suffix(path)
    if not formats:
        hint = did_you_mean(path.suffix, suffixes())
        if path.suffix == ".json":
            hint = 'a fit is `gold.json` on the command line and {"type": "json", "file": "gold.json"} in a scene'
        raise InputError(f"'{path.suffix}' is not a measurement format", str(path), hint)
    return next((one for one in formats if data is not None and one.fits(data)), formats[0])


def _hint(path: Path, error: OSError | ValueError) -> str:
    """A hint that suggests a correction of the path of a file that cannot be read."""
    if not isinstance(error, FileNotFoundError):
        return str(getattr(error, "strerror", "") or "")
    if not path.parent.is_dir():
        return f"there is no folder '{path.parent}'"
    near = get_close_matches(path.name, [one.name for one in path.parent.iterdir() if names_table(one.name)], 1)
    return f"did you mean '{near[0]}'?" if near else "check the path"


def read(file: str | os.PathLike[str]) -> Measurement:
    """Read the table in a file. Tables are cached, and a file is read again only if it has changed.

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
