"""Locate the files named by a scene."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

from ..catalog import documents
from ..errors import InputError, did_you_mean


def located(file: str, folder: Path, where: str, allow_outside: bool = False) -> Path:
    """The path of a file that a file in `folder` names. Raises InputError if it is missing or outside the folder.

    where          the location that errors name
    allow_outside  whether files outside the folder are allowed
    """
    file = documents.inside(file)[0]
    return checked(Path(folder, file), file, folder, where, allow_outside)


def checked(file: Path, name: str, folder: Path, where: str, allow_outside: bool = False) -> Path:
    """The path of a file, with symbolic links resolved. Raises InputError if it is missing, empty or outside the
    folder.

    name           name of the file in errors
    where          the location that errors name
    allow_outside  whether files outside the folder are allowed
    """
    try:
        folder = folder.resolve()
        path = file.resolve()  # resolves symbolic links, which must not lead outside
        exists, regular = path.exists(), path.is_file()
        empty = regular and path.stat().st_size == 0
    except (OSError, ValueError, RuntimeError) as error:  # too long a name, a zero byte, or circular links
        raise InputError(f"no usable file name: {error}", where, "give a file beside the scene") from None
    if not allow_outside and not path.is_relative_to(folder):
        raise InputError(
            f"'{name}' lies outside the scene's folder {folder}", where, "copy it there, or use --allow-outside"
        )
    if not exists:
        near = [str(p.relative_to(folder)) for p in _siblings(path)] if path.is_relative_to(folder) else []
        hint = did_you_mean(name, near) if near else "file names are relative to the scene's folder"
        raise InputError(f"'{name}' does not exist", where, hint)
    if not regular:
        raise InputError(f"'{name}' is not a file", where, "give a file beside the scene")
    if empty:
        raise InputError(f"'{name}' is empty (0 bytes)", where, "is it still being written or downloaded?")
    return path


def _siblings(path: Path, most: int = 200) -> list[Path]:
    """Other files in the same folder, for the hint of an error."""
    return [p for p in islice(path.parent.iterdir(), most) if p.is_file()] if path.parent.is_dir() else []
