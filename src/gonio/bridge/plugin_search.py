"""Restrict the folders from which Mitsuba may load native plugins.

Mitsuba loads `plugins/TYPE.so` from the first folder of its file resolver that contains this file, and otherwise from
the current folder; this fallback cannot be disabled. Mitsuba searches even for types registered in Python, because
`load_dict` looks up their kind in another variant. Therefore

- the resolver begins with Mitsuba's own folder and does not contain the current folder (`confine`),
- a type named by a document is checked before Mitsuba reads the document (`check`),
- a type is registered only if the current folder has no plugin of this name (`register`).
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

VARIABLE = "GONIO_PLUGINS"  # the user's folders, each of which has a subfolder `plugins`, as Mitsuba's own folder does
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
# plugins whose properties are memory addresses, which only the program that calls Mitsuba can provide
_UNSAFE = ("blender",)


@functools.cache
def package() -> Path:
    """Mitsuba's own folder, which contains its plugins and data."""
    import mitsuba

    return Path(mitsuba.__file__).parent


def trusted() -> list[Path]:
    """The folders whose subfolder `plugins` may contain native code: Mitsuba's own and those in GONIO_PLUGINS."""
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return [package(), *(Path(folder).absolute() for folder in named if folder)]


def confine(mi: ModuleType) -> None:
    """Set Mitsuba's search path: its own folder, those in GONIO_PLUGINS, then those that the program has added.

    The current folder, which Mitsuba appends when it is imported, is removed.
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
    """Append folders to Mitsuba's search path inside the `with` block."""
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
    """Raise InputError if a plugin type named by a document would load untrusted native code.

    location    file and line of the document, for errors
    folder      folder of the document; plugins in its subfolder `plugins` may be loaded if `allow_code` is set
    Returns the file in that subfolder that will be loaded, or None.
    """
    if not re.fullmatch(r"[^/\\.:\0]+", name):  # Mitsuba makes a path from it and drops everything after a dot
        raise InputError(f"'{name}' is not a plugin type", location, "a type is a name such as sphere, not a path")
    if name.lower() in _UNSAFE:  # file systems may ignore case
        what = f"'{name}' reads from memory addresses, which a file cannot provide"
        raise InputError(what, location, "export the mesh as .ply or .obj")
    if _is_trusted(name):
        return None
    if folder is not None and os.path.exists(folder / _file(name)):
        if allow_code:
            return folder / _file(name)
        what = f"'{name}' is native code in {folder / _file(name)}, which scenes may not run by default"
        raise InputError(what, location, f"if you trust it, --allow-code lets the scene run it, or {VARIABLE}={folder}")
    _refuse_current_folder(name, location)
    return None


def register(register_kind: Callable[[str, OfVariant], None], name: str, make: OfVariant) -> None:
    """Register a Python plugin with `mi.register_bsdf` or a similar function.

    Raises InputError if Mitsuba would load a native plugin of that name from the current folder instead.
    """
    _refuse_current_folder(name, "Mitsuba")
    register_kind(name, make)


def _refuse_current_folder(name: str, location: str) -> None:
    """Raise InputError if Mitsuba would load the plugin with this name from the current folder."""
    if os.path.exists(_file(name)) and not _is_trusted(name):
        what = f"Mitsuba would run {os.path.abspath(_file(name))}, native code in the current folder"
        hint = f"run Gonio in another folder, or if you trust the file, set {VARIABLE}={os.getcwd()}"
        raise InputError(what, location, hint)


def _is_trusted(name: str) -> bool:
    """Whether a trusted folder contains the plugin; Mitsuba searches these folders first."""
    return any(os.path.exists(folder / _file(name)) for folder in trusted())


def _file(name: str) -> str:
    """The path of a plugin's file relative to a search folder."""
    return os.path.join("plugins", name + _SUFFIX)
