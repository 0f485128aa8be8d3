"""Checkpoints of a render: the sums so far, and all that the picture depends on besides.

A render that goes on from one gives the same bits as one that was never interrupted, since sums are carried on in the
order of the samples. That holds as long as nothing else has changed; so the file has the hash of the scene, of every
file that it names, of the settings, of Gonio's own code, and of what computes, and a change is refused by name.
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

from .. import files
from ..errors import GonioError, InputError
from ..transport.passes import Progress, Renders
from ..work import garbage, kept
from ..work.kept import Arrays, Facts
from .identity import check
from .prepare import Prepared
from .request import MOST, Request
from .request_json import STRICT, described, request_of, validated

EVERY = 3.0  # seconds between two checkpoints: with a pass and the writing, less than 5 are lost
MOST_COST = 0.015  # of the time; where writing takes more, it is done less often
LONG = 60.0  # seconds that a job must take for a checkpoint that nobody asked for
SUFFIX = ".checkpoint"  # beside the picture
KIND = "render"


def load(path: Path) -> kept.Kept:
    """The checkpoint in a file, or the one before where it is damaged. Raises InputError where there is none, and for
    facts that no render has."""
    saved = kept.read(path)
    if saved.facts.get("kind") != KIND:
        raise InputError("this is no checkpoint of a render", str(path), "give one that `gonio render` has written")
    validated(_Facts, saved.facts, str(path))
    return saved


class _Facts(BaseModel):
    """What a checkpoint says beside its sums."""

    model_config = STRICT
    kind: str
    done: int = Field(ge=0, le=MOST)
    wanted: int = Field(ge=1, le=MOST)
    size: tuple[int, int]
    output: str  # the picture's file, where the render writes one
    temporary: bool
    request: dict[str, Any] | None
    identity: dict[str, str]


def restore(render: Renders, saved: kept.Kept, where: str) -> None:
    """Carry the sums over."""
    try:
        render.restore(int(saved.facts["done"]), saved.arrays)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError("this checkpoint does not fit the picture", where, "render anew") from error


class Keeper:
    """Writes checkpoints while a render goes on, by a thread of its own.

    path       the file; None writes nothing
    temporary  nobody asked for the file: it begins only once the job shows to take over `LONG` seconds, and goes when
               the picture is there
    long       seconds that such a job must take, `LONG` where None
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
        self._long = LONG if long is None else long
        self.error: GonioError | None = None
        self._began = self._last = clock()
        self._remaining = float("inf")
        self._thread: threading.Thread | None = None
        self._held: Arrays | None = None  # what the thread reads stays alive until this one lets it go
        self._identity: dict[str, str] = {}
        self._cost = 0.0  # seconds that the last one took away from the render
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
        """Whether the job is too short for a file that nobody asked for."""
        return self._temporary and not self.written and now - self._began + self._remaining < self._long

    def after_pass(self, progress: Progress) -> None:
        """Write, where it is time for it."""
        now, self._remaining = self._clock(), progress.remaining
        if self._thread is not None and not self._thread.is_alive():
            self.close()
        if self.path is None or now - self._last < max(EVERY, self._cost / MOST_COST) or self._short(now):
            return
        if self._thread is not None:
            return
        self._last = now
        self._begin()

    def end(self, stopped: bool) -> None:
        """Write what there is, for a render that is to go on later, or to more samples."""
        self.close()
        if self.path is not None and (stopped or not self._temporary) and not self._short(self._clock()):
            self._begin()
            self.close()

    def remove(self) -> None:
        """The picture is there: remove the file that nobody asked for."""
        if self.path is not None and self._temporary:
            kept.remove(self.path)
            self.written = False

    def close(self) -> None:
        """Wait for what is being written."""
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
        garbage.pause()  # until it has ended: see there
        self._thread = threading.Thread(target=self._write, args=(about, self._held, self._clock() - started))
        self._thread.start()

    def _write(self, about: Facts, arrays: Arrays, before: float) -> None:
        assert self.path is not None
        began = time.thread_time()
        try:
            if not self._identity:  # here, so that hashing large files costs the render nothing
                self._identity = self._prepared.sources.identity()
            kept.write(self.path, {**about, "identity": self._identity}, arrays, previous=True)
            self.written, self.error = True, None
        except GonioError as error:
            self.error = error
        except OSError as error:
            self.error = InputError(f"no checkpoint: {error.strerror or error}", str(self.path))
        self._cost = before + (time.thread_time() - began) / (os.cpu_count() or 1)


def default_path(output: Path) -> Path:
    """Where the checkpoint of a picture is that nobody asked for."""
    return files.with_ending(output, SUFFIX)


def earlier(path: Path, prepared: Prepared, temporary: bool) -> tuple[str, bool]:
    """Go on from a checkpoint that an earlier run of the same render has left: (what to tell of it, whether it is one
    that nobody asked for).

    temporary  nobody asks for it now either: one that does not fit is left alone, and said
    """
    if not kept.exists(path):
        return "", temporary
    try:
        saved = load(path)
        check(saved.facts, prepared.sources.identity(), str(path))
        done = int(saved.facts["done"])
        if done > prepared.spp:
            what = f"the checkpoint holds {done} samples per pixel, {prepared.spp} are asked for"
            raise InputError(what, str(path), f"give --spp {done} or more, or another --checkpoint")
        restore(prepared.render, saved, str(path))
    except InputError as error:
        if not temporary:
            raise
        kept.remove(path)
        return f"{path} is not used, and removed: {error.what}", temporary
    text = f"goes on from {path}: {done} of {prepared.spp} samples per pixel are done"
    if "lanes" in saved.arrays:
        share = float(np.mean(saved.arrays["lanes"] >= prepared.spp))
        text = f"goes on from {path}: {share:.0%} of the pixels are done"
    return text, temporary or bool(saved.facts.get("temporary"))


def asked_again(path: Path, change: Request, allow_code: bool, writes: bool = False) -> tuple[Request, str]:
    """The request of a checkpoint, with what `gonio resume` was asked for (output, spp, timeout, threads); and what to
    tell of where its picture is written.

    writes  the picture is written, under the name that the scene gives it where the render was asked for no other
    """
    saved = load(path)
    if saved.facts["request"] is None:
        what = "its material is known to the program alone that made it"
        raise InputError(what, str(path), "call that program again with the same checkpoint")
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
    """Where the picture of an untrusted checkpoint is written: the file that it names if that lies in the checkpoint's
    folder, else one of that name beside the checkpoint; and what to tell of that."""
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
        raise InputError("the checkpoint itself has the picture's name", str(checkpoint), "name another file with -o")
    return placed, notice
