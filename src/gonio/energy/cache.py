"""Tables that were computed once: kept in the user's cache folder by a hash of what they are.

The folder is `$GONIO_CACHE`, else `$XDG_CACHE_HOME/gonio`, else `~/.cache/gonio`. A file's name is the hash of what was
asked for and of the formulas behind it; inside stands the hash of its content. A file that is truncated, altered or not
ours is rebuilt, with a warning; a folder that cannot be written is no hindrance.
"""

from __future__ import annotations

import hashlib
import io
import os
import warnings
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..errors import GonioWarning

Kept = TypeVar("Kept")


def folder() -> Path:
    """Where tables are kept."""
    given = os.environ.get("GONIO_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gonio"


def content_hash(values: np.ndarray) -> str:
    """SHA-256 of an array's shape and float64 values."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    return hashlib.sha256(repr(array.shape).encode() + array.tobytes()).hexdigest()


@lru_cache
def _formulas() -> str:
    """Hash of the source of every room that a table depends on: changed optics make new tables."""
    package = Path(__file__).parent.parent
    files = sorted(p for room in ("energy", "models", "optics") for p in (package / room).rglob("*.py"))
    return hashlib.sha256(b"\0".join(p.read_bytes() for p in files)).hexdigest()


def _path(key: tuple) -> tuple[Path, str]:
    """(file, full name) of what `key` names; its first entry says what kind of thing it is."""
    name = hashlib.sha256((repr(key) + _formulas()).encode()).hexdigest()
    return folder() / f"{key[0]}-{name[:32]}.npz", name


def keep(key: tuple, build: Callable[[], Kept], write: Callable[[Kept], bytes], read: Callable[[Path], Kept]) -> Kept:
    """What `key` names, read from the cache or built and kept there.

    key   everything that it depends on besides the formulas of the rooms, which are added
    read  raises ValueError where the file is not what `write` made
    """
    path, _ = _path(key)
    if path.is_file():
        try:
            return read(path)
        except ValueError as error:
            warnings.warn(f"{path}: {error}; it is built again", GonioWarning, stacklevel=3)
    made = build()
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(write(made))
        os.replace(part, path)
    except OSError:
        pass  # a read-only home costs time, not correctness
    finally:
        if part.exists():
            part.unlink(missing_ok=True)
    return made


def remember(key: tuple, build: Callable[[], np.ndarray]) -> np.ndarray:
    """The array that `key` names, as `keep` keeps it."""
    _, name = _path(key)

    def write(values: np.ndarray) -> bytes:
        stream = io.BytesIO()
        np.savez(stream, values=values, name=np.array(name), hash=np.array(content_hash(values)))
        return stream.getvalue()

    def read(path: Path) -> np.ndarray:
        try:
            with np.load(path, allow_pickle=False) as file:
                values = file["values"]
                fine = str(file["name"]) == name and str(file["hash"]) == content_hash(values)
        except Exception as error:  # a file of any content: zip, zlib and NumPy each have their own ways to fail
            raise ValueError("damaged, or not ours") from error
        if not fine:
            raise ValueError("altered, or not ours")
        return values

    return keep(key, lambda: np.asarray(build(), dtype=np.float64), write, read)
