"""Tables that were computed once: kept in the user's cache folder by a hash of what they are.

The folder is `$GONIO_CACHE`, else `$XDG_CACHE_HOME/gonio`, else `~/.cache/gonio`. A file that is truncated, altered or
not ours is rebuilt, with a warning; a folder that cannot be written is no hindrance.
"""

from __future__ import annotations

import hashlib
import inspect
import io
import os
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import GonioWarning
from ..optics import fresnel, masking, special
from ..optics.ndf import base, distribution, ggx


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


def _fingerprint(key: tuple, ndf: str) -> str:
    """Hash of what is asked for and of the formulas behind it: changed optics make new tables."""
    from . import quadrature

    modules = {m.__name__: m for m in (fresnel, masking, special, base, ggx, quadrature)}
    own = inspect.getmodule(type(distribution(ndf)))
    modules[type(distribution(ndf)).__module__] = own  # type: ignore[assignment]
    text = "".join(inspect.getsource(modules[name]) for name in sorted(modules))
    return hashlib.sha256((repr(key) + text).encode()).hexdigest()


def remember(key: tuple, build: Callable[[], np.ndarray], ndf: str) -> np.ndarray:
    """The array that `key` names, read from the cache or built and kept.

    key  everything the array depends on besides the formulas of the optics, which are added
    """
    name = _fingerprint(key, ndf)
    path = folder() / f"{key[0]}-{name[:32]}.npz"
    found = _read(path, name)
    if found is not None:
        return found
    values = np.asarray(build(), dtype=np.float64)
    stream = io.BytesIO()
    np.savez(stream, values=values, name=np.array(name), hash=np.array(content_hash(values)))
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(stream.getvalue())
        os.replace(part, path)
    except OSError:
        pass  # a read-only home costs time, not correctness
    finally:
        if part.exists():
            part.unlink(missing_ok=True)
    return values


def _read(path: Path, name: str) -> np.ndarray | None:
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            values: Any = file["values"]
            fine = str(file["name"]) == name and str(file["hash"]) == content_hash(values)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        fine = False
    if fine:
        return values
    warnings.warn(f"{path} is damaged or not ours: building the table again", GonioWarning, stacklevel=3)
    return None
