"""What a format is: how its files are recognised, read and written.

A reader is strict: it takes a file whole or refuses it with one error, and before it allocates anything it knows from
the file's size that the file can justify it.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...members import Family, instances_of
from ..tables.base import Measurement

MOST = 1 << 31  # bytes that a file may have: 60 times the largest of today's tables


class Format:
    """A format of files.

    name      as `gonio info` prints it
    suffixes  by which files are recognised, the first is the one that is written
    writes    the kind of table that `write` takes, by name; "" where the format cannot be written
    """

    family: ClassVar[Family[Format]]
    name: ClassVar[str] = ""
    suffixes: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[str] = ""
    several: ClassVar[bool] = False  # whether a file holds several materials

    def fits(self, data: bytes) -> bool:
        """Whether a file of its suffix is its own, where formats share one."""
        return True

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        """The table in a file's bytes. InputError where they are not one.

        item  which one, of files that hold several
        """
        raise NotImplementedError

    def write(self, table: Measurement) -> bytes:
        """The file of a table of the kind `writes`."""
        raise InputError(f"{self.name} files cannot be written", "OUT", "choose another suffix")

    def resampled(self, source: Measurement) -> Measurement:
        """A table of the kind `writes` that stands for another, found by evaluating it; itself where it is one."""
        raise NotImplementedError

    def items(self, data: bytes, where: str) -> list[str]:
        """The names of the materials in a file that holds several; empty in others."""
        return []


Format.family = Family("format", "gonio.formats", ["gonio.measure.formats"], instances_of(Format), where="FILE")


def by_suffix(path: str | Path) -> list[Format]:
    """The formats of a file's suffix, the one whose own it is first."""
    suffix = Path(path).suffix.lower()
    formats = [one for one in Format.family.all().values() if suffix and suffix in one.suffixes]
    return sorted(formats, key=lambda one: one.suffixes.index(suffix))


def contents(path: Path, where: str = "") -> bytes:
    """A file's bytes. InputError where it cannot be read, or is larger than any table."""
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise InputError(f"'{path}' is no file", where or str(path))
        if size > MOST:
            raise InputError(f"{size} bytes, at most {MOST} expected", str(path))
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path)) from None
