"""A cache of computed tables in the user's cache folder; the keys are hashes of their inputs.

The folder is `$GONIO_CACHE`, else `$XDG_CACHE_HOME/gonio`, else `~/.cache/gonio`. The name of a file is the hash of the
request and of the formulas involved; the file contains the hash of its content. If a file is truncated, altered or
foreign, or if another user can change it, it is rebuilt with a warning. If the folder is not writable, nothing is
stored.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import inspect
import io
import os
import sys
import time
import warnings
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .. import archives, files
from ..errors import GonioError, GonioWarning
from ..material.user_code import with_imports
from ..members import Family
from ..optics.fresnel import Fresnel
from ..optics.masking import Masking
from ..optics.ndf import NDF
from ..work.parts import folder

Kept = TypeVar("Kept")


def content_hash(values: np.ndarray) -> str:
    """SHA-256 of an array's shape and float64 values."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    return hashlib.sha256(repr(array.shape).encode() + array.tobytes()).hexdigest()


PACKAGES = ("energy", "material", "materials", "ops", "optics")  # packages whose formulas determine a table


@lru_cache
def formulas() -> str:
    """Hash of the code of `PACKAGES` without comments and docstrings, so that tables are computed again if a formula
    has changed.

    Parsing takes a tenth of a second, so the hash is cached until a file changes.
    """
    package = Path(__file__).parent.parent
    files = sorted(p for name in PACKAGES for p in (package / name).rglob("*.py"))
    states = [(str(p.relative_to(package)), p.stat().st_mtime_ns, p.stat().st_size) for p in files]
    state = hashlib.sha256(repr((sys.version_info[:2], package, states)).encode()).hexdigest()
    note = folder() / "formulas.txt"
    with contextlib.suppress(OSError, ValueError):
        known, hashed = note.read_text().split()
        if known == state and len(hashed) == 64:
            return hashed
    hashed = hashlib.sha256("\n".join(_meaning(p.read_text(encoding="utf-8")) for p in files).encode()).hexdigest()
    _store(note, f"{state} {hashed}".encode())
    return hashed


def _store(path: Path, content: bytes) -> None:
    """Write a file of the cache. If the folder is read-only, nothing is written, and the table is computed again
    later."""
    with contextlib.suppress(OSError, GonioError):
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_whole(path, content, rescue=False)


def _meaning(source: str) -> str:
    """The syntax tree of a source without docstrings and annotations, as text."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node, clean=False):
            node.body = node.body[1:]
        for annotation in ("returns", "annotation"):
            if hasattr(node, annotation):
                setattr(node, annotation, None)
    return ast.dump(tree, annotate_fields=False)


FAMILIES: tuple[Family[Any], ...] = (NDF.family, Masking.family, Fresnel.family)  # their members determine tables


def of_members(build: Callable[..., Kept]) -> Callable[..., Kept]:
    """Memoize a function of the names of a distribution, a masking term and a Fresnel kind, in this order. The result
    is recomputed if a name refers to a different member than before."""
    made: dict[tuple[object, ...], Kept] = {}

    @functools.wraps(build)
    def remembered(*names: str) -> Kept:
        key = tuple(family.get(name) for family, name in zip(FAMILIES, names, strict=False))
        if key not in made:
            made[key] = build(*names)
        return made[key]

    return remembered


def origin(*names: str) -> tuple[str, ...]:
    """Hashes of the files of user-defined members among the named ones, and of their local imports, for a key on disk.
    A class without a file has a new hash in every process."""
    members = [type(family.get(name)) for family, name in zip(FAMILIES, names, strict=False)]
    return tuple(_hash_of(cls) for cls in members if not cls.__module__.startswith("gonio."))


def _hash_of(cls: type) -> str:
    try:
        files = with_imports(Path(inspect.getsourcefile(cls) or ""))
        return hashlib.sha256(b"".join(file.read_bytes() for file in sorted(files))).hexdigest()
    except (OSError, TypeError):  # defined at an interactive prompt
        return f"{cls.__qualname__} {id(cls)} {_PROCESS}"


_PROCESS = f"{os.getpid()} {time.time_ns()}"


def _path(key: tuple) -> tuple[Path, str]:
    """The file and the full name that belong to a key, whose first entry is the type of the content."""
    name = hashlib.sha256((repr(key) + formulas()).encode()).hexdigest()
    return folder() / f"{key[0]}-{name[:32]}.npz", name


def keep(key: tuple, build: Callable[[], Kept], write: Callable[[Kept], bytes], read: Callable[[Path], Kept]) -> Kept:
    """The object for `key`, read from the cache, or built and stored there.

    key    all inputs except the formulas of `PACKAGES`, which are added
    build  function that computes the object
    write  function that converts the object to the bytes to store
    read   function that reads the object from a file; it raises ValueError if the file was not written by `write`
    """
    path, _ = _path(key)
    if os.path.isfile(path):
        try:
            if files.changeable_by_others(path) or files.changeable_by_others(path.parent):
                raise ValueError("other users may have changed it")
            return read(path)
        except ValueError as error:
            warnings.warn(f"{path}: {error}; it is rebuilt", GonioWarning, stacklevel=3)
    made = build()
    _store(path, write(made))
    return made


def remember(key: tuple, build: Callable[[], np.ndarray]) -> np.ndarray:
    """The array for `key`, cached by `keep`.

    build  function that computes the array
    """
    _, name = _path(key)

    def write(values: np.ndarray) -> bytes:
        stream = io.BytesIO()
        np.savez(stream, values=values, name=np.array(name), hash=np.array(content_hash(values)))
        return stream.getvalue()

    def read(path: Path) -> np.ndarray:
        try:
            file = archives.read(path)
            values = file["values"]
            fine = str(file["name"]) == name and str(file["hash"]) == content_hash(values)
        except (KeyError, ValueError, OSError) as error:
            raise ValueError("damaged, or not written by Gonio") from error
        if not fine:
            raise ValueError("altered, or not written by Gonio")
        return values

    return keep(key, lambda: np.asarray(build(), dtype=np.float64), write, read)
