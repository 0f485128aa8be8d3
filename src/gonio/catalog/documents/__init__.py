"""Files in which other programs describe materials, such as glTF's: what a format of them is, and how a text names one.

    chest.gltf                  the file's only material
    chest.gltf:Wood             one of several, by its name, or by its number where it has none of its own

A reader writes a material down in Gonio's notation (`notation`), as a tree of types and values; the formats themselves
are the modules of this package.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple, TypeAlias

from ... import files
from ...errors import GonioWarning, InputError, did_you_mean
from ...members import Family, instances_of

# {"type": "conductor", "alpha": 0.3, ...}; a value may be a material again, or a picture: {"type": "imageTex", ...}
Notation: TypeAlias = "dict[str, object]"


class Described(NamedTuple):
    """A material as a file has it.

    notation  in Gonio's words, pictures included: what a scene may hold
    notices   what of it Gonio's words cannot carry, a sentence each
    """

    notation: Notation
    notices: tuple[str, ...]


class Document:
    """A format.

    name      what a scene calls it: {"type": "gltf", "file": ...}
    suffixes  by which its files are recognised
    writes    the type of material that `write` takes, by name; "" where the format cannot be written
    """

    family: ClassVar[Family[Document]]
    name: ClassVar[str] = ""
    suffixes: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[str] = ""

    def materials(self, path: Path) -> list[str]:
        """The names by which a file's materials are asked for. InputError for a file that is none of the format."""
        raise NotImplementedError

    def read(self, path: Path, name: str) -> Described:
        """A file's material of that name. InputError where the file is none of the format."""
        raise NotImplementedError

    def image(self, path: Path, index: str) -> bytes:
        """The bytes of a picture that lies inside a file, which textures name FILE#INDEX."""
        raise InputError(f"no picture '{index}' in it", str(path))

    def write(self, notation: Notation, name: str) -> bytes:
        """The file of one material of the type `writes`, under that name."""
        raise InputError(f"{self.name} files cannot be written", "OUT", "choose another suffix")


Document.family = Family(
    "document", "gonio.documents", ["gonio.catalog.documents"], instances_of(Document), where="FILE"
)


def parted(text: str) -> tuple[Document, Path, str] | None:
    """Format, file and material of FILE or FILE:MATERIAL; None where the text names no such file."""
    for document in Document.family.all().values():
        for suffix in document.suffixes:
            match = re.fullmatch(rf"(.+?{re.escape(suffix)})(?::(.+))?", text, re.IGNORECASE | re.DOTALL)
            if match:
                return document, Path(match[1]).expanduser(), match[2] or ""
    return None


def names_document(text: str) -> bool:
    """Whether a text is FILE or FILE:MATERIAL of such a file."""
    return parted(text) is not None


def inside(text: str) -> tuple[str, str]:
    """File and number of FILE#NUMBER, a picture inside a document; the text itself and "" of any other file."""
    file, mark, index = text.rpartition("#")
    return (file, index) if mark and names_document(file) else (text, "")


def read(document: Document, path: Path, name: str = "") -> Described:
    """A material of a file; the only one where no name is given. InputError, with the nearest known name."""
    if not path.is_file():
        raise InputError(f"no file '{path}'", str(path))
    known = document.materials(path)
    if not known:
        raise InputError("it holds no material", str(path))
    if not name and len(known) > 1:
        what = f"it holds {len(known)} materials"
        shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
        raise InputError(what, str(path), f"say which, such as {path.name}:{known[0]}; there are {shown}")
    if name and name not in known:
        raise InputError(f"no material '{name}' in it", str(path), did_you_mean(name, known[:1000]))
    return document.read(path, name or known[0])


def without_pictures(text: str) -> Notation:
    """The notation of FILE or FILE:MATERIAL with numbers alone; GonioWarning for what is left out."""
    found = parted(text)
    assert found is not None, "asked before"
    described = read(*found)
    lost: list[str] = []
    notation = _plain(described.notation, lost)
    if lost:
        what = "a picture stands" if len(lost) == 1 else f"{len(lost)} pictures stand"
        lost = [f"{what} on the surface only, in scenes: here {', '.join(dict.fromkeys(lost))} are the factors alone"]
    for notice in (*described.notices, *lost):
        warnings.warn(f"{text}: {notice}", GonioWarning, stacklevel=3)
    return notation


def convert(source: str, output: Path) -> tuple[str, ...]:
    """Write a document's material as JSON in Gonio's notation, or such JSON as a document. What the notation lacks.

    source  FILE or FILE:MATERIAL, or a .json file that holds one material: {"type": ..., ...}
    output  .json, or a document's suffix
    """
    found, target = parted(source), parted(str(output))
    described = read(*found) if found else Described(_from_json(Path(source)), ())
    if output.suffix.lower() == ".json":
        text = json.dumps(described.notation, indent=2) + "\n"
        files.write_whole(output, text.encode())
        return described.notices
    if target is None:
        known = sorted({suffix for one in Document.family.all().values() if one.writes for suffix in one.suffixes})
        raise InputError(f"'{output.suffix}' is no format of materials", str(output), f"{', '.join(known)} or .json")
    kind = str(described.notation.get("type")).replace("_", "-").removeprefix("gonio-")
    if target[0].writes and kind != target[0].writes:
        raise InputError(f"a {kind} given, and {target[0].name} holds {target[0].writes}", str(output))
    files.write_whole(output, target[0].write(described.notation, output.stem))
    return described.notices


def _from_json(path: Path) -> Notation:
    try:
        found = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path)) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"no JSON: {str(error)[:200]}", str(path)) from None
    if not isinstance(found, dict) or not isinstance(found.get("type"), str):
        raise InputError('an object with a "type" expected', str(path), 'such as {"type": "openpbr", ...}')
    return found


def _plain(notation: Mapping[str, object], lost: list[str]) -> Notation:
    found: Notation = {}
    for key, value in notation.items():
        if isinstance(value, dict) and value.get("type") == "imageTex":
            lost.append(key)
            if "factor" in value:
                found[key] = value["factor"]
        else:
            found[key] = _plain(value, lost) if isinstance(value, dict) else value
    return {key: value for key, value in found.items() if key != "normalmap"}
