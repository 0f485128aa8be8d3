"""Determine what an operand of the command line names: a material, a scene, a picture and so on.

    kind_of("examples/phong", {Kind.SCENE, *MATERIALS}, "SCENE")     Kind.SCENE

An operand may be ambiguous: `phong` is a material, but a folder of this name may contain a scene. The possible kinds
are ordered, existing files before names, and the first kind that the command accepts is used. They are determined only
from names, suffixes and file contents. No code is run, and names of any length are accepted.
"""

from __future__ import annotations

import difflib
import enum
import errno
import json
import os
import re
import zipfile
from collections.abc import Collection
from pathlib import Path

from ..errors import InputError
from ..material import BSDF, is_model, models
from ..optics.ndf import distributions
from . import documents, library, outside, texts

PICTURE_SUFFIXES = (".exr", ".hdr", ".png", ".npz")
SCENE_FILE = "scene.json"
CALIBRATION = "calibration.json"  # name of the calibration file in a folder of photographs
_LONGEST = 80  # maximum number of characters of an operand in an error
_LARGEST_CALIBRATION = 1 << 20  # bytes; a larger .json file counts as a scene
_NEAR = 0.75  # similarity from which an unknown operand is treated as a misspelled name


class Kind(enum.Enum):
    """The kinds of operands."""

    NAME = "a material's name"
    CODE = "a class in a Python file"
    TABLE = "a file of measured values"
    DOCUMENT = "a file that describes a material"
    DISTRIBUTION = "a distribution of normals"
    PLUGIN = "a Mitsuba plugin"
    SCENE = "a scene"
    TABLES = "baked tables"
    PICTURE = "a picture"
    CALIBRATION = "a calibration of photographs"
    FOLDER = "a folder"
    FILE = "a file"


MATERIALS = frozenset({Kind.NAME, Kind.CODE, Kind.TABLE, Kind.DOCUMENT})
_TAKEN = {
    Kind.SCENE: "render, study and view take scenes",
    Kind.TABLES: "info and plot take baked tables",
    Kind.PICTURE: "compare and convert take pictures, bake takes an environment",
    Kind.PLUGIN: "verify takes plugins of Mitsuba's",
    Kind.DISTRIBUTION: "bake takes distributions",
    Kind.CALIBRATION: "capture takes a calibration",
}


def kind_of(word: str | os.PathLike[str], accepted: Collection[Kind], where: str) -> Kind:
    """The kind of an operand, which must be one of the accepted kinds.

    where  name of the operand in errors, such as "SCENE"
    Raises InputError, which states the actual and the expected kinds, if the operand is of no accepted kind.
    """
    text = os.fspath(word)
    if Kind.SCENE in accepted and _exists(Path(text.strip()) / SCENE_FILE):
        return Kind.SCENE  # the first possible kind of such a folder, so the others need not be determined
    kinds = readings(text)
    kind = next((one for one in kinds if one in accepted), None)
    if kind is not None:
        return kind
    shown = _shortened(text)
    what, hint = f"'{shown}' is {kinds[0].value}, {_expected(accepted)} expected", _TAKEN.get(kinds[0], "")
    if kinds[0] is Kind.DISTRIBUTION and Kind.NAME in accepted:
        hint = f"as a material: conductor(ndf={texts.split(text)[0]})"
    if Kind.SCENE in kinds and (reason := _broken(Path(text))):
        what, where, hint = reason, text, "correct the file"
    elif not _exists(Path(text)) and kinds[0] not in (Kind.NAME, Kind.CODE, Kind.PLUGIN, Kind.DISTRIBUTION):
        what, hint = f"no file or folder '{shown}'; {_expected(accepted)} expected", "check the path"
    raise InputError(what, where, hint)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _expected(accepted: Collection[Kind]) -> str:
    """A description of the accepted kinds for an error."""
    any_material = set(accepted) >= MATERIALS
    named = [kind.value for kind in Kind if kind in accepted and not (any_material and kind in MATERIALS)]
    *others, last = ["a material", *named] if any_material else named
    return f"{', '.join(others)} or {last}" if others else last


def is_material(word: str) -> bool:
    """Whether an operand names an existing material: a known name, a file, or a material class."""
    kinds = readings(word)
    if kinds[0] is Kind.CODE:
        cls = outside.thing(texts.split(word)[0], where="MODEL")
        return (isinstance(cls, type) and issubclass(cls, BSDF)) or callable(getattr(cls, "eval", None))
    if texts.summands(word):
        return True
    return kinds[0] in (Kind.TABLE, Kind.DOCUMENT) or (bool(_names(texts.split(word)[0])) and Kind.NAME in kinds)


def readings(text: str) -> list[Kind]:
    """All possible kinds of an operand, at least one; the most likely kind is first.

    Raises InputError for a Python file without a class.
    """
    text = text.strip()
    if texts.summands(text):
        return [Kind.NAME]
    head, settings = texts.split(text)
    if head.startswith("{"):
        return _described(_type_of(head), Kind.NAME)
    if head.startswith("mitsuba:"):
        return [Kind.PLUGIN]
    if outside.names_code(head):
        return [Kind.CODE]
    if head.lower().endswith(".py"):
        raise InputError(f"'{head}' names a file, but no class in it", "MODEL", f"give {head}:CLASS")
    path = Path(text)
    if not _may_be_a_path(Path(head)):
        what = f"'{_shortened(text)}' does not name a material, and no file can have that name"
        raise InputError(what, "MODEL", "such as 'conductor(alpha=0.3)', or the path of a file")
    if _is_folder(path):
        return _in_folder(path, _names(head))
    if documents.names_document(head):
        return _described(_type_of_file(head), Kind.DOCUMENT)
    if outside.names_data(head):
        return [Kind.TABLE]
    by_suffix = _of_file(path)
    if by_suffix:
        return [*by_suffix, *_names(head)]
    if _exists(path):
        return [Kind.FILE, *_names(head), Kind.SCENE]  # a scene may have any name
    if settings or _names(head) or _resembles(head):
        return _names(head) or [Kind.NAME]
    return [Kind.SCENE, *([Kind.NAME] if os.sep not in text else []), Kind.PICTURE]


def _described(name: str, kind: Kind) -> list[Kind]:
    """The possible kinds of a description from its type, which is one of Gonio's or a Mitsuba plugin.

    Names that exist in both are Gonio's. `twosided` and `thindielectric`, which other commands interpret as two-sided
    and thin-dielectric, are plugins.
    """
    known = (
        re.sub("^gonio-", "", name) in models()
        or library.knows(name)
        or outside.names_code(name)
        or name in documents.types()
    )
    plugins = [Kind.PLUGIN] if name else []
    return [kind, *plugins] if known or not plugins else [*plugins, kind]


def _type_of(text: str) -> str:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return ""
    return str(content.get("type", "")) if isinstance(content, dict) else ""


def _type_of_file(text: str) -> str:
    """The type of the description in a .json file; "" for other documents."""
    path = Path(os.path.expanduser(text))
    try:
        return _type_of(path.read_text(encoding="utf-8")) if path.suffix.lower() == ".json" else ""
    except (OSError, ValueError):
        return ""


def _names(name: str) -> list[Kind]:
    """The possible kinds of a name."""
    kinds = [Kind.NAME] if is_model(name) or library.knows(name) else []
    return [Kind.DISTRIBUTION, *kinds] if name in distributions() else kinds


def _resembles(name: str) -> bool:
    """Whether a name is similar to the name of a material or a distribution."""
    if os.sep in name or not name:
        return False
    known = [*models(), *library.materials(), *distributions()]
    return bool(difflib.get_close_matches(name.partition(":")[0].lower(), known, n=1, cutoff=_NEAR))


def _in_folder(path: Path, names: list[Kind]) -> list[Kind]:
    """The possible kinds of a folder from its files. If it contains no known files, the command reports the error."""
    marks = {SCENE_FILE: Kind.SCENE, "tables.npz": Kind.TABLES, CALIBRATION: Kind.CALIBRATION}
    kinds = [kind for name, kind in marks.items() if _exists(path / name)]
    return [*kinds, Kind.FOLDER, *names] if kinds else [Kind.FOLDER, *names, Kind.SCENE, Kind.TABLES]


def _of_file(path: Path) -> list[Kind]:
    """The possible kinds of a file, which need not exist, from its suffix; empty if the suffix is unknown."""
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return _of_archive(path)
    if suffix in PICTURE_SUFFIXES:
        return [Kind.PICTURE]
    if suffix == ".json":
        return [Kind.CALIBRATION] if _lists_photographs(path) else [Kind.SCENE]
    return [Kind.SCENE, Kind.PLUGIN] if suffix == ".xml" else []  # a Mitsuba scene, or a description of a BSDF


def _of_archive(path: Path) -> list[Kind]:
    """The possible kinds of an archive, from array names: baked tables, networks of several materials, or a picture."""
    try:
        with zipfile.ZipFile(path) as file:
            names = file.namelist()
    except (OSError, ValueError, zipfile.BadZipFile):
        return [Kind.PICTURE, Kind.TABLES]
    if any("/" in name for name in names):
        return [Kind.TABLE]
    return [Kind.TABLES] if "manifest.npy" in names else [Kind.PICTURE, Kind.TABLES]


def _lists_photographs(path: Path) -> bool:
    """Whether a .json file is a calibration file."""
    try:
        content = json.loads(path.read_bytes()) if path.stat().st_size <= _LARGEST_CALIBRATION else None
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and "scene" not in content and ("photographs" in content or "lights" in content)


def _broken(path: Path) -> str:
    """The error in a .json file that cannot be parsed; "" if it can be parsed, and for other files."""
    if path.suffix.lower() != ".json" or not _exists(path):
        return ""
    try:
        json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        return f"not valid JSON: {str(error)[:200]}"
    return ""


def _may_be_a_path(path: Path) -> bool:
    """Whether a file could have this name, that is, whether it is not too long and contains no zero byte."""
    try:
        os.stat(path)
    except ValueError:
        return False
    except OSError as error:
        return error.errno != errno.ENAMETOOLONG
    return True


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # the name is too long or contains a zero byte
        return False


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False
