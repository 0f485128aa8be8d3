"""Checkpoints of a render: the accumulated samples, and hashes of everything else on which the picture depends.

A render that continues from a checkpoint is bit-identical to an uninterrupted one, because samples are summed in the
same order. This requires that nothing else has changed. The file therefore contains hashes of the scene, of every file
that the scene names, of the settings and of Gonio's own code, and the name of the processor or GPU. If one of these has
changed, an error names it.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, Field

from .. import files, garbage
from ..errors import GonioError, InputError
from ..transport.passes import Progress, Renders
from ..work import kept
from ..work.kept import Arrays, Facts
from .identity import check
from .prepare import Prepared
from .request import MAX_COUNT, Request
from .request_json import STRICT, described, request_of, validated

INTERVAL = 3.0  # seconds between checkpoints; including a pass and the writing, less than 5 s of work can be lost
MAX_COST = 0.015  # maximum fraction of the time for writing; if it takes longer, checkpoints are written less often
LONG_JOB = 60.0  # seconds that a job must be expected to take before an automatic checkpoint is written
SUFFIX = ".checkpoint"  # suffix of an automatic checkpoint, appended to the picture's name
KIND = "render"


def load(path: Path) -> kept.Kept:
    """Read a checkpoint, or the previous one if the file is damaged.

    Raises InputError if there is no checkpoint, or if the file is not a checkpoint of a render.
    """
    saved = kept.read(path)
    if saved.facts.get("kind") != KIND:
        raise InputError("this is not a checkpoint of a render", str(path), "give one that `gonio render` has written")
    validated(_Facts, saved.facts, str(path))
    return saved


class _Facts(BaseModel):
    """The facts that a checkpoint contains in addition to the accumulated samples."""

    model_config = STRICT
    kind: str
    done: int = Field(ge=0, le=MAX_COUNT)
    wanted: int = Field(ge=1, le=MAX_COUNT)
    size: tuple[int, int]
    output: str  # the picture's file, if the render writes one
    temporary: bool
    request: dict[str, Any] | None
    identity: dict[str, str]


def restore(render: Renders, saved: kept.Kept, where: str) -> None:
    """Copy the accumulated samples of a checkpoint into a render.

    Raises InputError, which names `where`, if they do not match the render.
    """
    try:
        render.restore(int(saved.facts["done"]), saved.arrays)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError("this checkpoint does not fit the picture", where, "render again without it") from error


class Keeper:
    """Writes checkpoints during a render, in a separate thread.

    path       the file; None writes no checkpoints
    prepared   the render whose accumulated samples are written
    temporary  whether the checkpoint is automatic: it is written only if the job is expected to take more than
               `LONG_JOB` seconds, and removed after the picture has been written
    long       duration in seconds to use instead of `LONG_JOB`
    """

    def __init__(
        self,
        path: Path | None,
        prepared: Prepared,
        temporary: bool = False,
        long: float | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.path, self._prepared, self._temporary, self._clock = path, prepared, temporary, clock
        self.written = path is not None and kept.exists(path)
        self._long = LONG_JOB if long is None else long
        self.error: GonioError | None = None
        self._began = self._last = clock()
        self._remaining = float("inf")
        self._thread: threading.Thread | None = None
        self._held: Arrays | None = None  # keeps the arrays alive while the thread reads them
        self._identity: dict[str, str] = {}
        self._cost = 0.0  # seconds by which the last checkpoint delayed the render
        self._request = None if path is None else self._describe()

    def _describe(self) -> Facts | None:
        try:
            return described(self._prepared.request)
        except InputError:
            if not self._temporary:
                raise
            self.path = None
            return None

    def _short(self, now: float) -> bool:
        """Whether the job is too short for an automatic checkpoint."""
        return self._temporary and not self.written and now - self._began + self._remaining < self._long

    def after_pass(self, progress: Progress) -> None:
        """Write a checkpoint if enough time has passed since the last one."""
        now, self._remaining = self._clock(), progress.remaining
        if self._thread is not None and not self._thread.is_alive():
            self.close()
        if self.path is None or now - self._last < max(INTERVAL, self._cost / MAX_COST) or self._short(now):
            return
        if self._thread is not None:
            return
        self._last = now
        self._begin()

    def end(self, stopped: bool) -> None:
        """Write a last checkpoint, so that the render can be continued later or with more samples."""
        self.close()
        if self.path is not None and (stopped or not self._temporary) and not self._short(self._clock()):
            self._begin()
            self.close()

    def remove(self) -> None:
        """Remove an automatic checkpoint after the picture has been written."""
        if self.path is not None and self._temporary:
            kept.remove(self.path)
            self.written = False

    def close(self) -> None:
        """Wait until the current checkpoint is written."""
        if self._thread is not None:
            self._thread.join()
            garbage.resume()
        self._thread = self._held = None

    def _begin(self) -> None:
        started = self._clock()
        self._held = self._prepared.render.state()
        about = {
            "kind": KIND,
            "done": self._prepared.render.done,
            "wanted": self._prepared.spp,
            "size": [*self._prepared.size],
            "output": str(self._prepared.output.absolute()),
            "request": self._request,
            "temporary": self._temporary,
        }
        garbage.pause()  # until the thread ends, see `gonio.garbage`
        self._thread = threading.Thread(target=self._write, args=(about, self._held, self._clock() - started))
        self._thread.start()

    def _write(self, about: Facts, arrays: Arrays, before: float) -> None:
        assert self.path is not None
        began = time.thread_time()
        try:
            if not self._identity:  # in this thread, so that hashing large files does not delay the render
                self._identity = self._prepared.sources.identity()
                kept.remove_damaged(self.path)
            kept.write(self.path, {**about, "identity": self._identity}, arrays, previous=True)
            self.written, self.error = True, None
        except GonioError as error:
            self.error = error
        except OSError as error:
            self.error = InputError(f"the checkpoint cannot be written: {error.strerror or error}", str(self.path))
        self._cost = before + (time.thread_time() - began) / (os.cpu_count() or 1)


def default_path(output: Path) -> Path:
    """The path of the automatic checkpoint of a picture."""
    return files.with_ending(output, SUFFIX)


def earlier(path: Path, prepared: Prepared, temporary: bool) -> tuple[str, bool]:
    """Continue from the checkpoint of an earlier run of the same render.

    Returns a notice for the user, or "", and whether the checkpoint is automatic.

    temporary  whether no checkpoint was requested; a checkpoint that does not match is then removed, with a notice
    """
    if not kept.exists(path):
        return "", temporary
    try:
        saved = load(path)
        check(saved.facts, prepared.sources.identity(), str(path))
        done = int(saved.facts["done"])
        if done > prepared.spp:
            what = f"the checkpoint has {done} samples per pixel, but {prepared.spp} are requested"
            raise InputError(what, str(path), f"give --spp {done} or more, or another --checkpoint")
        restore(prepared.render, saved, str(path))
    except InputError as error:
        if not temporary:
            raise
        kept.remove(path)
        return f"{path} is not used, and removed: {error.what}", temporary
    text = f"continues from {path}: {done} of {prepared.spp} samples per pixel are done"
    if "lanes" in saved.arrays:
        share = float(np.mean(saved.arrays["lanes"] >= prepared.spp))
        text = f"continues from {path}: {share:.0%} of the pixels are done"
    return text, temporary or bool(saved.facts.get("temporary"))


def asked_again(path: Path, change: Request, allow_code: bool, writes: bool = False) -> tuple[Request, str]:
    """The request of a checkpoint with the options of `gonio resume`, and a notice about the file of the picture.

    change      the options to replace: output, spp, timeout and threads; None uses the option of the original request
    allow_code  whether the scene may run the Python files that it names
    writes      whether the picture will be written to a file: the one in the original request, or else the one that the
                scene names
    """
    saved = load(path)
    if saved.facts["request"] is None:
        what = "its material exists only in the program that rendered it"
        raise InputError(what, str(path), "run that program again with the same checkpoint")
    old = request_of(saved.facts["request"], str(path), allow_code)
    output, notice = change.output, ""
    if output is None and (old.output is not None or writes):
        output, notice = _placed(old.output or Path(saved.facts["output"]), path)
    request = replace(
        old,
        output=output,
        spp=change.spp or saved.facts["wanted"],
        timeout=change.timeout,
        threads=change.threads,
        checkpoint=path,
    )
    return request, notice


def _placed(output: Path, checkpoint: Path) -> tuple[Path, str]:
    """The file to which the picture of an untrusted checkpoint is written, and a notice about it.

    This is the file that the checkpoint names if it is in the folder of the checkpoint, and otherwise a file of the
    same name next to the checkpoint.
    """
    folder = checkpoint.absolute().parent
    try:
        inside = output.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):
        inside = False
    placed, notice = output, ""
    if not inside:
        placed = folder / (output.name or "picture.exr")
        notice = f"the picture goes to {placed}: the checkpoint names {output}, outside its folder; -o writes it there"
    if placed.absolute() in (checkpoint.absolute(), default_path(checkpoint.absolute())):
        raise InputError("the checkpoint has the picture's name", str(checkpoint), "name another file with -o")
    return placed, notice
