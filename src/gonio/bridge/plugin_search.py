"""Mitsuba's plugins are native code: which files may be loaded as such, and where Mitsuba looks for them.

Mitsuba loads `plugins/TYPE.so` from the first folder of its file resolver that has it, and where none has, from the
current folder: that fallback cannot be switched off. A type that Python registered is searched for too, since
`load_dict` asks for its kind in another variant. Therefore

- the resolver begins with Mitsuba's own folder, and the current folder is not in it (`confine`),
- a type that a document names is checked before Mitsuba reads the document (`check`),
- a type is registered only if the current folder has no plugin of that name (`register`).
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

from ..errors import InputError
from .types import OfVariant

VARIABLE = "GONIO_PLUGINS"  # folders of the user's, each with a folder `plugins` in it, as Mitsuba's own
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
# Their properties are addresses of memory, which only the program that calls Mitsuba can know.
_UNSAFE = ("blender",)


@functools.cache
def package() -> Path:
    """Mitsuba's own folder, with its plugins and data."""
    import mitsuba

    return Path(mitsuba.__file__).parent


def trusted() -> list[Path]:
    """The folders in whose `plugins` native code may lie: Mitsuba's, and those that GONIO_PLUGINS names."""
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return [package(), *(Path(folder).absolute() for folder in named if folder)]


def confine(mi: ModuleType) -> None:
    """Let Mitsuba search its own folder first, then those of GONIO_PLUGINS and of the program, and not the current.

    As it is imported it appends the folder that is then the current one, and its own.
    """
    resolver = mi.file_resolver()
    paths = list(map(str, resolver))
    own = os.path.realpath(package())
    at = next((index for index, path in enumerate(paths) if os.path.realpath(path) == own), 0)
    program = paths[: max(at - 1, 0)] + paths[at + 1 :]
    resolver.clear()
    for path in (*map(str, trusted()), *program):
        resolver.append(path)


@contextlib.contextmanager
def searching(mi: ModuleType, *folders: Path) -> Iterator[None]:
    """In here Mitsuba searches these folders too, after all others."""
    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    for path in folders:
        resolver.append(str(path))
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)


def check(name: str, location: str, folder: Path | None = None, allow_code: bool = False) -> Path | None:
    """Raise InputError for a plugin's type, named by a document, that would load native code of nobody's choice.

    folder      the document's, whose `plugins` may be loaded where `allow_code` is set
    Returns the file in that folder that will be loaded, None where it is another or none.
    """
    if not re.fullmatch(r"[^/\\.:\0]+", name):  # Mitsuba makes a path of it, and drops what a dot begins
        raise InputError(f"'{name}' is no type of a plugin", location, "a type is a name such as sphere, and no path")
    if name.lower() in _UNSAFE:  # a file system may not tell capitals apart
        what = f"'{name}' reads from addresses of memory, which no file can know"
        raise InputError(what, location, "export the mesh as .ply or .obj")
    if _is_trusted(name):
        return None
    if folder is not None and (folder / _file(name)).exists():
        if allow_code:
            return folder / _file(name)
        what = f"'{name}' is native code in {folder / _file(name)}, which a scene alone does not run"
        raise InputError(what, location, f"if you trust it, --allow-code lets the scene run it, or {VARIABLE}={folder}")
    _refuse_current_folder(name, location)
    return None


def register(register_kind: Callable[[str, OfVariant], None], name: str, make: OfVariant) -> None:
    """Register a plugin of Python's by `mi.register_bsdf` or one of its kind; see `_refuse_current_folder`."""
    _refuse_current_folder(name, "Mitsuba")
    register_kind(name, make)


def _refuse_current_folder(name: str, location: str) -> None:
    """Raise InputError where Mitsuba would load the plugin of that name from the current folder."""
    if os.path.exists(_file(name)) and not _is_trusted(name):
        what = f"Mitsuba would run {os.path.abspath(_file(name))}, native code in the current folder"
        hint = f"call Gonio from another folder, or if you trust it, set {VARIABLE}={os.getcwd()}"
        raise InputError(what, location, hint)


def _is_trusted(name: str) -> bool:
    """Whether the plugin lies in a trusted folder, which Mitsuba searches first."""
    return any((folder / _file(name)).exists() for folder in trusted())


def _file(name: str) -> str:
    """Where Mitsuba looks for a plugin's file, within a folder."""
    return os.path.join("plugins", name + _SUFFIX)
