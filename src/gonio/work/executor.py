"""Executors, which run the parts of a job: one after another in this process, or on a cluster.

    for index, arrays in each(function, arguments, keys):
        ...                                  # in the order in which they finish

A part consists of a function at the top level of a module and of arguments that can be pickled; it returns arrays. Its
result must depend on nothing else, so that it is bit-identical on every worker and the part can run twice.
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
Argument: TypeAlias = Any  # anything that can be pickled


class Executor(Protocol):
    """The interface of executors, which run the parts of a job."""

    remote: bool
    """Whether other processes run the parts, so that arguments and files must be sent to them."""

    @property
    def size(self) -> int:
        """The number of parts that run at the same time."""
        ...

    def run(
        self, function: Function, arguments: Sequence[tuple[Argument, ...]], files: Mapping[str, Path]
    ) -> Generator[tuple[int, Arrays], None, None]:
        """Yield the index and result of each part when it finishes, and (-1, {}) if no part finishes for a while.

        arguments  the arguments of `function` for each part
        files      the files that parts open through `file`, by content hash
        """
        ...


class LocalExecutor:
    """An executor that runs the parts in this process."""

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


_executor: ContextVar[Executor] = ContextVar("executor")
_files: ContextVar[Mapping[str, Path]] = ContextVar("files")


def current() -> Executor:
    """The executor in use."""
    return _executor.get(LocalExecutor())


@contextlib.contextmanager
def using(executor: Executor) -> Iterator[None]:
    """Use an executor to run parts inside the `with` block."""
    token = _executor.set(executor)
    try:
        yield
    finally:
        _executor.reset(token)


def file(content_hash: str) -> Path:
    """The path of the file with the given content hash, on the machine that runs the part."""
    return _files.get()[content_hash]


def each(
    function: Function,
    arguments: Sequence[tuple[Argument, ...]],
    keys: Sequence[str] | None = None,
    files: Mapping[str, Path] | None = None,
) -> Generator[tuple[int, Arrays], None, None]:
    """Yield the index and result of each part: first those of stored parts, then those of the others as they finish.

    Yields (-1, {}) if no part finishes for a while, so that the caller can check for an interrupt.

    arguments  the arguments of `function` for each part
    keys       for each part, a hash of everything that it depends on; its result is then stored until the job is done
               (`parts.job`). None stores nothing
    files      files that the parts read, by content hash
    """
    stored = parts.current() if keys else None
    left = []
    for index in range(len(arguments)):
        part = stored.get(keys[index]) if stored and keys else None
        if part is None:
            left.append(index)
        else:
            yield index, part.arrays
    for number, arrays in current().run(function, [arguments[index] for index in left], files or {}):
        if number < 0:
            yield number, arrays
            continue
        index = left[number]
        if stored and keys:
            stored.put(keys[index], arrays)
        yield index, arrays
