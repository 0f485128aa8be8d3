"""What a job of many parts has done so far, kept in the user's cache folder until the job is done.

A part is kept by a hash of all that it depends on, so that one that is found is the one that is wanted. Files that are
damaged are not there; a folder that cannot be written costs time and not correctness.
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

FORGOTTEN = 30 * 86400.0  # seconds after which the parts of a job that was never finished go


def folder() -> Path:
    """The user's cache folder: `$GONIO_CACHE`, else `$XDG_CACHE_HOME/gonio`, else `~/.cache/gonio`."""
    given = os.environ.get("GONIO_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gonio"


def key_of(*what: object) -> str:
    """The hash of what a part depends on: texts and numbers by `repr`, bytes as they are."""
    found = hashlib.sha256()
    for one in what:
        content = one if isinstance(one, bytes) else repr(one).encode("utf-8", "surrogateescape")
        found.update(len(content).to_bytes(8, "little") + content)
    return found.hexdigest()


class Parts:
    """The parts of one job.

    name  of the kind of job, such as "study"
    what  all that tells this job from others
    """

    def __init__(self, name: str, *what: object) -> None:
        self.folder = folder() / "parts" / f"{name}-{key_of(*what)[:24]}"
        self.found = 0
        with contextlib.suppress(OSError):
            _forget(self.folder.parent)
            self.found = sum(entry.suffix == ".part" for entry in self.folder.iterdir())

    def path(self, key: str, suffix: str = ".part") -> Path:
        return self.folder / f"{key[:40]}{suffix}"

    def get(self, key: str) -> Kept | None:
        """The part, None where it has not been done, or its file is damaged."""
        try:
            found = kept.read(self.path(key))
        except InputError:
            return None
        return found if found.facts.get("key") == key else None

    def put(self, key: str, arrays: Arrays, facts: Facts | None = None) -> None:
        """Keep a part. It is not forced to the disk: a power cut may cost it, and is noticed."""
        with contextlib.suppress(OSError, GonioError):
            self.open()
            kept.write(self.path(key), {**(facts or {}), "key": key}, arrays, durable=False)

    def open(self) -> Path:
        """The folder, made where it is missing."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        return self.folder

    def clear(self) -> None:
        """The job is done."""
        shutil.rmtree(self.folder, ignore_errors=True)


_current: ContextVar[Parts | None] = ContextVar("parts", default=None)


def current() -> Parts | None:
    """The parts of the job that is being done, None where nobody keeps any."""
    return _current.get()


@contextlib.contextmanager
def job(name: str, *what: object) -> Iterator[Parts]:
    """Inside, parts are kept; they are removed at the end unless it is an error or a signal."""
    parts = Parts(name, *what)
    token = _current.set(parts)
    try:
        yield parts
    finally:
        _current.reset(token)
    parts.clear()


def _forget(place: Path) -> None:
    old = time.time() - FORGOTTEN
    for entry in place.iterdir():
        if entry.stat().st_mtime < old:
            shutil.rmtree(entry, ignore_errors=True)
