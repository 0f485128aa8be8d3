"""Files that describe materials, such as glTF: the interface of formats, and strings that name a material in a file.

    chest.gltf                  the only material of the file
    chest.gltf:Wood             one of several materials, by its name, or by its number if it has no unique name
    gold.json                   a result of `gonio fit`, or Gonio's own notation

A reader converts a material to Gonio's notation (`notation`), a tree of types and values. The formats are the modules
of this package.
"""

from __future__ import annotations

import json
import os
import re
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple, TypeAlias

from ... import files
from ...errors import GonioWarning, InputError, did_you_mean
from ...material import is_model
from ...members import Family, instances_of

# {"type": "conductor", "alpha": 0.3, ...}; a value may be a material or an image, {"type": "imageTex", ...}
Notation: TypeAlias = "dict[str, object]"


class Described(NamedTuple):
    """A material as described by a file.

    notation  the material in Gonio's notation, with images as in a scene
    notices   features of the file that the notation cannot express, one sentence each
    """

    notation: Notation
    notices: tuple[str, ...]


class Document:
    """A file format.

    name      type of the format in scenes, as in {"type": "gltf", "file": ...}
    suffixes  suffixes by which files are recognized
    writes    name of the material type that `write` accepts; "" if the format cannot be written
    """

    family: ClassVar[Family[Document]]
    name: ClassVar[str] = ""
    suffixes: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[str] = ""

    def holds(self, path: Path) -> bool:
        """Whether a file with a suffix of this format describes materials, because other files may have it too."""
        return True

    def materials(self, path: Path) -> list[str]:
        """The names by which the materials in a file are selected. Raises InputError for a file in another format."""
        raise NotImplementedError

    def ranked(self, path: Path) -> bool:
        """Whether the first material of a file is the default, because it is the best of several fits."""
        return False

    def read(self, path: Path, name: str) -> Described:
        """Read the material with the given name. Raises InputError for a file in another format."""
        raise NotImplementedError

    def image(self, path: Path, index: str) -> bytes:
        """The bytes of an image inside a file, to which textures refer as FILE#INDEX."""
        raise InputError(f"no picture '{index}' in this file", str(path))

    def write(self, notation: Notation, name: str) -> bytes:
        """The bytes of a file with one material of the type `writes` and the given name."""
        raise InputError(f"{self.name} files cannot be written", "OUT", "choose another suffix")


Document.family = Family(
    "document", "gonio.documents", ["gonio.catalog.documents"], instances_of(Document), where="FILE"
)


def types() -> list[str]:
    """The types of document files in scenes, as in {"type": "gltf", "file": ...}."""
    return list(Document.family.all())


def parted(text: str) -> tuple[Document, Path, str] | None:
    """The format, file and material of FILE or FILE:MATERIAL; None if the string does not name a document."""
    for document in Document.family.all().values():
        for suffix in document.suffixes:
            match = re.fullmatch(rf"(.+?{re.escape(suffix)})(?::(.+))?", text, re.IGNORECASE | re.DOTALL)
            if match and document.holds(path := Path(os.path.expanduser(match[1]))):
                return document, path, match[2] or ""
    return None


def names_document(text: str) -> bool:
    """Whether a string names a document, as FILE or FILE:MATERIAL."""
    return parted(text) is not None


def inside(text: str) -> tuple[str, str]:
    """Split FILE#NUMBER, an image inside a document, into file and number; for other files, the number is ""."""
    file, mark, index = text.rpartition("#")
    return (file, index) if mark and names_document(file) else (text, "")


def read(document: Document, path: Path, name: str = "") -> Described:
    """Read a material from a file, by its name, or the only material if no name is given.

    Raises InputError, with the closest known name, if the file has no material with the given name.
    """
    if not path.is_file():
        raise InputError(f"no file '{path}'", str(path))
    known = document.materials(path) if document.holds(path) else []
    if not known:
        raise InputError("it contains no material", str(path))
    if not name and len(known) > 1 and not document.ranked(path):
        what = f"it contains {len(known)} materials"
        shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
        raise InputError(what, str(path), f"name one, such as {path.name}:{known[0]}; there are {shown}")
    if name and name not in known:
        raise InputError(f"no material '{name}' in this file", str(path), did_you_mean(name, known[:1000]))
    return document.read(path, name or known[0])


def described(text: str) -> dict[str, Notation]:
    """The notation of all materials in FILE, or of FILE:MATERIAL, by the name of the material."""
    parts = parted(text)
    assert parts is not None, "asked before"
    document, path, name = parts
    names = [name] if name or not path.is_file() else document.materials(path)
    return {one: read(document, path, one).notation for one in names}


def without_pictures(text: str) -> Notation:
    """The notation of FILE or FILE:MATERIAL without images; a GonioWarning names the omitted images."""
    parts = parted(text)
    assert parts is not None, "asked before"
    described = read(*parts)
    lost: list[str] = []
    notation = _plain(described.notation, lost)
    if lost:
        what = "a picture is" if len(lost) == 1 else f"{len(lost)} pictures are"
        lost = [f"{what} used only in scenes: here only the factors of {', '.join(dict.fromkeys(lost))} apply"]
    for notice in (*described.notices, *lost):
        warnings.warn(f"{text}: {notice}", GonioWarning, stacklevel=3)
    return notation


def convert(source: str, output: Path) -> tuple[str, ...]:
    """Convert a material in a document to JSON in Gonio's notation, or to another document format. Returns the notices.

    source  FILE or FILE:MATERIAL
    output  the file to write, with the suffix .json or that of a document format
    """
    operand = parted(source)
    if operand is None:
        raise InputError(f"'{source}' contains no material", source, 'such as {"type": "openpbr", ...} in a .json')
    described = read(*operand)
    write(described.notation, output)
    return described.notices


def write(notation: Notation, output: Path) -> None:
    """Write a material as JSON in Gonio's notation or as a document, depending on the suffix of `output`.

    Raises InputError for an unknown suffix, and for a material that the format cannot store.
    """
    files.check_file(output)
    if output.suffix.lower() == ".json":
        files.write_whole(output, (json.dumps(for_scenes(notation), indent=2) + "\n").encode())
        return
    known = {suffix: one for one in Document.family.all().values() if one.writes for suffix in one.suffixes}
    target = known.get(output.suffix.lower())
    if target is None:
        hint = f"{', '.join(sorted(known))} or .json"
        raise InputError(f"'{output.suffix}' is not a material format", str(output), hint)
    kind = notation["type"]
    if kind != target.writes:
        raise InputError(f"a {kind} given, but {target.name} files hold {target.writes}", str(output))
    files.write_whole(output, target.write(notation, output.stem))


PREFIX = "gonio-"  # prefix of types in scenes, where some names without it are the lab's, with other defaults


def for_scenes(notation: Mapping[str, object]) -> Notation:
    """The notation, with the type names of scene files, such as "gonio-conductor"."""
    return _with_types(notation, lambda name: PREFIX + name if is_model(name) else name)


def from_scenes(notation: Mapping[str, object]) -> Notation:
    """The inverse of `for_scenes`."""
    return _with_types(notation, lambda name: re.sub("^gonio[-_]", "", name))


def _with_types(notation: Mapping[str, object], change: Callable[[str], str]) -> Notation:
    changed: Notation = {}
    for key, value in notation.items():
        if isinstance(value, Mapping):
            changed[key] = _with_types(value, change)
        else:
            changed[key] = change(value) if key == "type" and isinstance(value, str) else value
    return changed


def _plain(notation: Mapping[str, object], lost: list[str]) -> Notation:
    plain: Notation = {}
    for key, value in notation.items():
        if isinstance(value, dict) and value.get("type") == "imageTex":
            lost.append(key)
            if "factor" in value:
                plain[key] = value["factor"]
        else:
            plain[key] = _plain(value, lost) if isinstance(value, dict) else value
    return {key: value for key, value in plain.items() if key != "normalmap"}
