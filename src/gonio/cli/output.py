"""Output of the verbs: progress bar, tables and warnings."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table

    from ..transport.passes import Progress


def print_warnings(warnings: tuple[str, ...]) -> None:
    """Print warnings on stderr, one line each."""
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


class Bar:
    """A progress bar on stderr that shows the completed samples, the rate and the remaining time. It is hidden if
    stderr is not a terminal."""

    def __init__(self, title: str, total: float | None = None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._console = Console(stderr=True)
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", style="cyan", markup=False),  # the text of a material contains brackets
            BarColumn(),
            TextColumn("{task.fields[state]}", markup=False),
            console=self._console,
            transient=True,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task(title, total=total, state="loading")

    def __enter__(self) -> Bar:
        self._bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):
            self._bar.__exit__(kind, error, trace)

    def update(self, progress: Progress) -> None:
        minutes, seconds = divmod(round(progress.remaining), 60)
        state = f"{progress.done}/{progress.wanted} spp  {progress.rate / 1e6:.2f} M samples/s"
        state += f"  {minutes}:{seconds:02} left" if progress.done < progress.wanted else "  writing"
        self.step(progress.done, progress.wanted, state)

    def step(self, done: int, total: int, state: str) -> None:
        with contextlib.suppress(OSError):  # if the terminal is closed, the picture must still be written
            self._bar.update(self._task, total=total, completed=done, state=state)

    def tell(self, text: str) -> None:
        """Print a line above the bar."""
        with contextlib.suppress(OSError):
            self._console.print(text, markup=False, soft_wrap=True)

    def stopping(self) -> None:
        with contextlib.suppress(OSError):
            self._console.print("ending after the current pass; press Ctrl-C again to end immediately")


def listing(*headings: str) -> Table:
    """A table for `print_rich`, with the given headings."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, show_header=any(headings), pad_edge=False)
    for index, heading in enumerate(headings):
        table.add_column(heading, no_wrap=index == 0, style="cyan" if index == 0 else "")
    return table


def print_intervals(names: Sequence[str], values: Iterable[float], intervals: Iterable[tuple[float, float]]) -> None:
    """Print fitted values with their 95 % confidence intervals."""
    table = listing("", "value", "95 % interval")
    for name, value, (low, high) in zip(names, values, intervals, strict=True):
        table.add_row(name, f"{value:.5g}", f"{low:.5g} to {high:.5g}")
    print_rich(table)


def print_rich(what: RenderableType) -> None:
    """Print with colors; brackets are printed as text, not interpreted as markup."""
    console(markup=False).print(what)


def console(markup: bool = True) -> Console:
    """A console on standard output with the width of the terminal, or 200 columns without a terminal."""
    from rich.console import Console

    return Console(markup=markup, emoji=False, width=None if sys.stdout.isatty() else 200)


def print_tables(manifest: Mapping[str, Any], path: Path, as_json: bool) -> None:
    """Print the contents of a baked folder."""
    if as_json:
        print(json.dumps({"path": str(path), **manifest}))
        return
    from ..energy.tables import baked

    print(f"{path}: {baked.title(manifest)}")
    table = listing(*baked.headings(manifest))
    for row in baked.rows(manifest):
        table.add_row(*row)
    print_rich(table)
    for axis, text in manifest["axes"].items():
        print(f"{axis:10} {text}")
