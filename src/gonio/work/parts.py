"""Store the finished parts of a job in the user's cache folder until the whole job is done.

Each part is stored under a hash of everything that it depends on, so a stored part is always valid. Damaged files count
as missing. If the folder cannot be written, parts are computed again, but results remain correct.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import time
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path

from ..errors import GonioError, InputError
from . import kept
from .kept import Arrays, Facts, Kept

EXPIRY = 30 * 86400.0  # seconds after which the parts of an unfinished job are removed


def folder() -> Path:
    """The user's cache folder: `$GONIO_CACHE`, `$XDG_CACHE_HOME/gonio` or `~/.cache/gonio`, in this order."""
    given = os.environ.get("GONIO_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gonio"


def key_of(*what: object) -> str:
    """A hash of everything that a part depends on: of bytes themselves, and of the `repr` of other values."""
    digest = hashlib.sha256()
    for one in what:
        content = one if isinstance(one, bytes) else repr(one).encode("utf-8", "surrogateescape")
        digest.update(len(content).to_bytes(8, "little") + content)
    return digest.hexdigest()


class Parts:
    """The stored parts of one job.

    name  name of the kind of job, such as "study"
    what  everything that distinguishes this job from other jobs of this kind
    """

    def __init__(self, name: str, *what: object) -> None:
        self.folder = folder() / "parts" / f"{name}-{key_of(*what)[:24]}"
        self.found = 0
        with contextlib.suppress(OSError):
            _remove_expired(self.folder.parent)
            self.found = sum(entry.suffix == ".part" for entry in self.folder.iterdir())

    def path(self, key: str, suffix: str = ".part") -> Path:
        return self.folder / f"{key[:40]}{suffix}"

    def get(self, key: str) -> Kept | None:
        """The stored part; None if it does not exist or its file is damaged."""
        try:
            part = kept.read(self.path(key))
        except InputError:
            return None
        return part if part.facts.get("key") == key else None

    def put(self, key: str, arrays: Arrays, facts: Facts | None = None) -> None:
        """Store a part. It is not flushed to the disk, so a power failure may damage it; `get` detects the damage."""
        with contextlib.suppress(OSError, GonioError):
            self.open()
            kept.write(self.path(key), {**(facts or {}), "key": key}, arrays, durable=False)

    def open(self) -> Path:
        """The folder of the parts, which is created if it is missing."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        return self.folder

    def clear(self) -> None:
        """Remove all parts, because the job is done."""
        shutil.rmtree(self.folder, ignore_errors=True)


_current: ContextVar[Parts | None] = ContextVar("parts", default=None)


def current() -> Parts | None:
    """The stored parts of the current job; None if its parts are not stored."""
    return _current.get()


@contextlib.contextmanager
def job(name: str, *what: object) -> Iterator[Parts]:
    """Store the parts of a job inside the `with` block.

    The parts are removed at the end of the block, but are kept if an error or a signal ends it.

    name, what  as for `Parts`
    """
    parts = Parts(name, *what)
    token = _current.set(parts)
    try:
        yield parts
    finally:
        _current.reset(token)
    parts.clear()


def _remove_expired(place: Path) -> None:
    old = time.time() - EXPIRY
    for entry in place.iterdir():
        if entry.stat().st_mtime < old:
            shutil.rmtree(entry, ignore_errors=True)
