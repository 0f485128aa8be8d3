"""The interface of file formats: how files are recognized, read and written.

Readers are strict: a file is either accepted completely or rejected with one error. Before a reader allocates memory,
it checks the sizes stated in the file against the size of the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...members import Family, instances_of
from ..tables.base import Measurement

MAX_BYTES = 1 << 31  # largest file size: 60 times the largest existing table


class Format:
    """A file format.

    name      printed by `gonio info`
    suffixes  suffixes by which files are recognized; written files have the first of them
    writes    name of the kind of table that `write` accepts; "" if the format cannot be written
    """

    family: ClassVar[Family[Format]]
    name: ClassVar[str] = ""
    suffixes: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[str] = ""
    several: ClassVar[bool] = False  # whether a file holds several materials
    # whether other files often have this suffix; in a folder, such files do not count as measurements
    common: ClassVar[bool] = False

    def fits(self, data: bytes) -> bool:
        """Whether the contents of a file are in this format; called if several formats share its suffix."""
        return True

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        """Read a table from the bytes of a file. Raises InputError if they are not in this format.

        where  name of the file in errors
        item   name of the material, if the file contains several
        """
        raise NotImplementedError

    def write(self, table: Measurement) -> bytes:
        """The bytes of a file with a table, whose kind must be the one that `writes` names."""
        raise InputError(f"{self.name} files cannot be written", "OUT", "choose another suffix")

    def resampled(self, source: Measurement) -> Measurement:
        """Convert a table to the kind that `writes` names; a table of this kind is returned unchanged."""
        raise NotImplementedError

    def items(self, data: bytes, where: str) -> list[str]:
        """The names of the materials in a file that contains several; empty for other files.

        where  name of the file in errors
        """
        return []


Format.family = Family("format", "gonio.formats", ["gonio.measure.formats"], instances_of(Format), where="FILE")


def by_suffix(path: str | Path) -> list[Format]:
    """The formats that use the suffix of a file. Formats that write this suffix come first."""
    suffix = Path(path).suffix.lower()
    formats = [one for one in Format.family.all().values() if suffix and suffix in one.suffixes]
    return sorted(formats, key=lambda one: one.suffixes.index(suffix))


def contents(path: Path, where: str = "") -> bytes:
    """The bytes of a file. Raises InputError if it cannot be read, or is larger than any table can be.

    where  name of the file in errors; if empty, its path
    """
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise InputError(f"'{path}' is not a file", where or str(path))
        if size > MAX_BYTES:
            raise InputError(f"{size} bytes, at most {MAX_BYTES} expected", str(path))
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path)) from None
