"""Reloading of a user's files whenever they are saved.

    >>> code = Code([Path("ward.py")], make)
    >>> stage = code.run()                   # `make()`, which loads the files and their imports from their folder
    >>> Watch(code, show, complain).start()  # and again after each change

Each run starts without the modules of the previous run, so that a saved change in any module takes effect, and an old
module is freed together with the materials created from it.
"""

from __future__ import annotations

import contextlib
import importlib
import linecache
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Generic, TypeVar

from ..catalog import outside, shaders
from ..errors import GonioError

POLL_SECONDS = 0.03
STOP_SECONDS = 5.0
MISSING_POLLS = 10  # number of polls for which a file may be missing: some editors delete a file before they write it

Made = TypeVar("Made")
Stamp = tuple[int, int, int] | None  # modification time, size, inode; None for a missing file


class Code(Generic[Made]):
    """Python files named by the user, the files that they import from their own folders, and the object created from
    these files.

    make   function that loads the files
    texts  shaders named by the user, which are watched together with the files that they include; nothing is imported
           from their folders
    files  all of these files, as of the last run
    """

    def __init__(self, named: Iterable[Path], make: Callable[[], Made], texts: Iterable[Path] = ()):
        self._make = make
        python = frozenset(path.resolve() for path in named)
        self._folders = {path.parent for path in python}
        self._texts = frozenset(path.absolute() for path in texts)
        self._named = python | self._texts
        self._modules: list[str] = []
        self.files = self._named
        self.stamps: dict[Path, Stamp] = {}

    def run(self) -> Made:
        """The result of `make` for the current files."""
        self.stamps = self.look()
        for name in self._modules:
            sys.modules.pop(name, None)
        others = set(sys.modules)
        importlib.invalidate_caches()
        outside.forget()
        linecache.checkcache()  # lines that errors quote
        try:
            with self._importable():
                made = self._make()
        except BaseException:
            # The imports of a failed file are unknown: a change of any file in its folder may correct the error.
            self._follow(others, {path for folder in self._folders for path in folder.glob("*.py")} | self.files)
            raise
        self._follow(others, set())
        return made

    def look(self) -> dict[Path, Stamp]:
        """The stamps of all files, which change when a file is saved."""
        return {path: _stamp(path) for path in self.files}

    @contextlib.contextmanager
    def _importable(self) -> Iterator[None]:
        """Add the folders to Python's path, and write no bytecode. Python would also use the bytecode for another
        version of the file that has the same size and was saved within the same second."""
        path, keeps = list(sys.path), sys.dont_write_bytecode
        sys.path[:0] = sorted(map(str, self._folders))
        sys.dont_write_bytecode = True
        try:
            yield
        finally:
            sys.path[:], sys.dont_write_bytecode = path, keeps

    def _follow(self, others: set[str], more: set[Path]) -> None:
        """Record the modules that the files have loaded: the modules in their folders that were not loaded before."""
        packages = {name.partition(".")[0] for name in others}
        new = {name: module for name, module in sys.modules.items() if name.partition(".")[0] not in packages}
        files = {name: getattr(module, "__file__", None) for name, module in new.items()}
        places = {name: Path(file).resolve() for name, file in files.items() if file}
        own = {name: place for name, place in places.items() if self._is_own(place)}
        self._modules = list(own)
        texts = {file for text in self._texts for file in shaders.files_read(text)}
        self.files = self._named | set(own.values()) | texts | more
        self.stamps = {path: self.stamps[path] if path in self.stamps else _stamp(path) for path in self.files}

    def _is_own(self, place: Path) -> bool:
        """Whether a file is in one of the user's folders, but not in a virtual environment inside it."""
        return not {"site-packages", "dist-packages"} & {*place.parts} and not self._folders.isdisjoint(place.parents)

    def located(self, error: BaseException) -> GonioError:
        """The error, with the line in these files that caused it."""
        causes = list(_causes(error))
        first = causes[-1]
        if isinstance(first, SyntaxError) and first.filename:
            text = f": {first.text.strip()}" if first.text else ""
            return GonioError(
                f"{first.msg}{text}", f"{Path(first.filename).name}:{first.lineno}", "fix it and save the file"
            )
        line = next((line for cause in reversed(causes) if (line := self._line(cause.__traceback__))), "")
        place = line or min(self._named).name
        if isinstance(error, GonioError):
            named = next((path for path in self.files if str(path) in error.where), None)
            if named and not line:
                place = error.where.replace(str(named), named.name)
            elif any(error.where.startswith(path.name) for path in self.files):
                place = error.where
            elif not named and error.where:
                place = f"{place}: {error.where}"
            return GonioError(error.what, place, error.hint)
        text = str(error).strip().partition("\n")[0]
        return GonioError(f"{type(error).__name__}: {text}", place, "fix it and save the file")

    def _line(self, traceback: TracebackType | None) -> str:
        """The innermost call in these files, as file:line; "" if there is none."""
        line = ""
        while traceback is not None:
            place = Path(traceback.tb_frame.f_code.co_filename)
            if place.resolve() in self.files:
                line = f"{place.name}:{traceback.tb_lineno}"
            traceback = traceback.tb_next
        return line


def _causes(error: BaseException) -> Iterator[BaseException]:
    """The error, its cause, and so on to the first cause."""
    next_one: BaseException | None = error
    while next_one is not None:
        yield next_one
        next_one = next_one.__cause__ or next_one.__context__


def _stamp(path: Path) -> Stamp:
    try:
        about = path.stat()
    except OSError:
        return None
    return about.st_mtime_ns, about.st_size, about.st_ino


class Watch(Generic[Made]):
    """A thread that runs the code again whenever one of its files is saved.

    show      called with the result
    complain  called with an error of the code or of `show`, with its location
    """

    def __init__(self, code: Code[Made], show: Callable[[Made], None], complain: Callable[[GonioError], None]):
        self._code, self._show, self._complain = code, show, complain
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._work, name="gonio watch", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """End the thread after its current run; a run that does not end is abandoned."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join(STOP_SECONDS)

    def _work(self) -> None:
        before, quiet = self._code.stamps, 0
        while not self._ended.wait(POLL_SECONDS):
            now = self._code.look()
            quiet = quiet + 1 if now == before else 0
            before = now
            # two equal stamps in succession show that the file is not being written
            if now != self._code.stamps and quiet >= (MISSING_POLLS if None in now.values() else 1):
                self._run()
                before = self._code.stamps

    def _run(self) -> None:
        try:
            self._show(self._code.run())
        except Exception as error:
            self._complain(self._code.located(error))


__all__ = ["Code", "Watch"]
