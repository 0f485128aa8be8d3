"""The interface of a format: how its files are recognized, read and written.

A reader is strict: it accepts a file completely or rejects it with one error, and before it allocates memory it checks
the claimed sizes against the file's size.
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
    suffixes  suffixes by which files are recognized; the first is used for writing
    writes    the kind of table that `write` accepts, by name; "" if the format cannot be written
    """

    family: ClassVar[Family[Format]]
    name: ClassVar[str] = ""
    suffixes: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[str] = ""
    several: ClassVar[bool] = False  # whether a file holds several materials
    common: ClassVar[bool] = False  # whether other files often have its suffix: a folder's are not measurements

    def fits(self, data: bytes) -> bool:
        """Whether a file's contents are in this format; called if several formats share the file's suffix."""
        return True

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        """The table in a file's bytes. Raises InputError if they are in another format.

        where  name of the file, for errors
        item   the material, in files that hold several
        """
        raise NotImplementedError

    def write(self, table: Measurement) -> bytes:
        """The contents of a file, as bytes, for a table of the kind that `writes` names."""
        raise InputError(f"{self.name} files cannot be written", "OUT", "choose another suffix")

    def resampled(self, source: Measurement) -> Measurement:
        """The table converted to the kind that `writes` names; unchanged if it is already of that kind."""
        raise NotImplementedError

    def items(self, data: bytes, where: str) -> list[str]:
        """The names of the materials in a file that holds several; empty for other files. `where` names the file in
        errors."""
        return []


Format.family = Family("format", "gonio.formats", ["gonio.measure.formats"], instances_of(Format), where="FILE")


def by_suffix(path: str | Path) -> list[Format]:
    """The formats with a file's suffix; those whose first suffix it is come first."""
    suffix = Path(path).suffix.lower()
    formats = [one for one in Format.family.all().values() if suffix and suffix in one.suffixes]
    return sorted(formats, key=lambda one: one.suffixes.index(suffix))


def contents(path: Path, where: str = "") -> bytes:
    """A file's bytes. Raises InputError if it cannot be read, or is larger than any table can be.

    where  name of the file in errors; "": its path
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
