"""Who does the parts of a job: this process, one after the other, or a cluster.

    for index, arrays in each(function, arguments, keys):
        ...                                  # in the order in which they are done

A part is a function at the top of a module and its arguments, both of which can travel; what comes back are arrays. It
must depend on nothing else, so that it gives the same bits wherever it is done, and may be done twice.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from . import parts
from .kept import Arrays

Function: TypeAlias = Callable[..., Arrays]
Argument: TypeAlias = Any  # what can be pickled


class Crew(Protocol):
    """Who does parts."""

    remote: bool
    """Whether other processes do them, if only one: arguments and files travel then."""

    @property
    def size(self) -> int:
        """How many at a time."""
        ...

    def run(
        self, function: Function, arguments: Sequence[tuple[Argument, ...]], files: Mapping[str, Path]
    ) -> Generator[tuple[int, Arrays], None, None]:
        """Number and result of each part as it is done; (-1, {}) where none was done for a while.

        files  what parts ask for by `file`, by content hash
        """
        ...


class Here:
    """This process."""

    size, remote = 1, False

    def run(
        self, function: Function, arguments: Sequence[tuple[Argument, ...]], files: Mapping[str, Path]
    ) -> Generator[tuple[int, Arrays], None, None]:
        token = _files.set(files)
        try:
            for index, given in enumerate(arguments):
                yield index, function(*given)
        finally:
            _files.reset(token)


_crew: ContextVar[Crew] = ContextVar("crew")
_files: ContextVar[Mapping[str, Path]] = ContextVar("files")


def current() -> Crew:
    """Who does parts at present."""
    return _crew.get(Here())


@contextlib.contextmanager
def working(crew: Crew) -> Iterator[None]:
    """Inside, these do the parts."""
    token = _crew.set(crew)
    try:
        yield
    finally:
        _crew.reset(token)


def file(content_hash: str) -> Path:
    """The file of that content, on the machine where the part is done."""
    return _files.get()[content_hash]


def each(
    function: Function,
    arguments: Sequence[tuple[Argument, ...]],
    keys: Sequence[str] | None = None,
    files: Mapping[str, Path] | None = None,
) -> Generator[tuple[int, Arrays], None, None]:
    """Number and result of each part, in the order in which they are found and done; (-1, {}) where none was done for a
    while, so that whoever asks can look whether somebody wants to stop.

    keys   a hash of all that each part depends on: then it is kept until the job is done (`parts.job`)
    files  files that the parts read, by content hash
    """
    kept = parts.current() if keys else None
    left = []
    for index in range(len(arguments)):
        found = kept.get(keys[index]) if kept and keys else None
        if found is None:
            left.append(index)
        else:
            yield index, found.arrays
    for number, arrays in current().run(function, [arguments[index] for index in left], files or {}):
        if number < 0:
            yield number, arrays
            continue
        index = left[number]
        if kept and keys:
            kept.put(keys[index], arrays)
        yield index, arrays
