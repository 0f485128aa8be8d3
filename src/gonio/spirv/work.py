"""The limits of a call: instructions and time.

A short text can require any amount of work: twenty functions, each of which calls the previous one twice, make a
million calls. The largest known engine shader, that of three-gpu-pathtracer, executes 4,054 instructions; 4,096
iterations of a loop over a page of code execute 200,000.
"""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Iterator

from .module import Function, Module
from .values import Value, refuse

MAX_INSTRUCTIONS = 250_000  # instructions per external call
SECONDS = 20.0  # thread time per external call; a single instruction may compute an array of 65,536 numbers
COPIED = 256  # array entries per additional instruction that a copy counts as, in time and memory
_HINT = "store the result of a function and reuse it; shorten loops"


class Work:
    """The work of a call so far, by function. Raises InputError if a limit is exceeded."""

    def __init__(self, module: Module) -> None:
        self.module = module
        self.instructions, self.calls = Counter[int](), Counter[int]()
        self.total, self.end = 0, time.thread_time() + SECONDS

    def enter(self, function: Function) -> None:
        """Count the start of a call."""
        self.calls[function.id] += 1

    def step(self, function: Function) -> None:
        """Count an instruction."""
        self._add(function, 1)
        if time.thread_time() > self.end:
            raise refuse(f"over {SECONDS:g} s to run the shader once: {self._most()}", _HINT)

    @contextlib.contextmanager
    def shared(self, function: Function) -> Iterator[None]:
        """Count a call that is recorded once for all equal calls; each counts, because each runs when values are
        computed."""
        before = self.total
        yield
        if self.total > before:
            self.module.costs[function.id] = max(self.total - before, self.module.costs.get(function.id, 0))
        else:
            self.enter(function)
            self._add(function, self.module.costs.get(function.id, 0))

    def _add(self, function: Function, count: int) -> None:
        self.instructions[function.id] += count
        self.total += count
        if self.total > MAX_INSTRUCTIONS:
            raise refuse(f"more than {MAX_INSTRUCTIONS:,} instructions: {self._most()}", _HINT)

    def copied(self, value: Value) -> None:
        """Count the creation of a value; a large value counts as several instructions."""
        if isinstance(value, tuple):
            self.total += len(value) // COPIED

    def _most(self) -> str:
        (id, count), *_ = self.instructions.most_common(1)
        name = self.module.names.get(id, str(id)).partition("(")[0]
        return f"{count:,} in {self.calls[id]:,} calls of '{name}'"
