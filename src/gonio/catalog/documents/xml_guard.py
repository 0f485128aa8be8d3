"""Read untrusted XML: sizes are checked before objects are created, and included files are inserted."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree
from xml.parsers import expat

from ...errors import InputError

MOST_BYTES = 16 << 20
MOST_ELEMENTS = 100_000
DEEPEST = 64
MOST_FILES = 100
_INCLUDE = "{http://www.w3.org/2001/XInclude}include"


def read(path: Path) -> ElementTree.Element:
    """Read a file and return its root element, in which includes are replaced by the included files.

    Included files must be in the folder of the main file. Raises InputError for a file that is not well-formed,
    declares entities (which may expand without bounds), includes itself, or exceeds the limits of size, depth or number
    of elements.
    """
    folder = path.parent.resolve()
    left, files = MOST_ELEMENTS, 0

    def one(file: Path, above: tuple[Path, ...]) -> ElementTree.Element:
        nonlocal left, files
        files += 1
        if files > MOST_FILES:
            raise InputError(f"more than {MOST_FILES} files are included", str(file))
        root, count = _guarded(file, left)
        left -= count
        for parent in list(root.iter()):
            for place, child in reversed(list(enumerate(parent))):
                if child.tag == _INCLUDE:
                    target = _included(child, file, folder, above)
                    parent[place : place + 1] = list(one(target, (*above, target)))
        return root

    return one(path, (path.resolve(),))


def _included(element: ElementTree.Element, file: Path, folder: Path, above: tuple[Path, ...]) -> Path:
    name = element.get("href", "")
    try:
        target = (file.parent / name).resolve()
        there = target.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"not a usable file name: {error}", str(file), "include a file in the same folder") from None
    if ":" in name.split("/")[0] or not target.is_relative_to(folder):
        raise InputError(f"it includes '{name[:60]}', which is outside its folder", str(file), "copy it there")
    if target in above:
        raise InputError(f"it includes '{name[:60]}', which includes it again", str(file), "remove one of the includes")
    if not there:
        raise InputError(f"it includes '{name[:60]}', which does not exist", str(file))
    return target


def _guarded(path: Path, most: int) -> tuple[ElementTree.Element, int]:
    """The root element of one file, and the number of its elements."""
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise InputError(f"{size} bytes, at most {MOST_BYTES} expected", str(path))
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path)) from None
    count = depth = 0

    def refused(*_: object) -> NoReturn:
        raise InputError("it declares a document type or entities, which may grow without bounds", str(path))

    def opened(name: str, attributes: object) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > most:
            raise InputError(f"more than {MOST_ELEMENTS} elements", str(path), "keep only the materials you need")
        if depth > DEEPEST:
            raise InputError(f"more than {DEEPEST} nested elements", str(path))

    def closed(name: str) -> None:
        nonlocal depth
        depth -= 1

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refused
    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    try:
        parser.Parse(data, True)
        return ElementTree.fromstring(data), count
    except (expat.ExpatError, ElementTree.ParseError, ValueError, LookupError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"not well-formed XML: {error}", str(path), "correct it there") from None
