"""Fits of several models to several files; each result is stored as soon as it is ready."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..catalog import operands
from ..catalog.operands import Kind
from ..errors import InputError
from ..files import check_file, write_whole
from ..measure import names_table, read
from ..measure.formats.base import by_suffix
from ..work import parts
from .data import GRAZING, Data, data_of
from .fit import Fit, fit, ranked


@dataclass(frozen=True)
class Settings:
    """Settings shared by all fits, as in `fit`; `metric` is its `loss`, `fixed` its `param`."""

    lobes: int = 1
    metric: str = "relative"
    fixed: Mapping[str, object] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    grazing: float = GRAZING

    @property
    def key(self) -> tuple[object, ...]:
        """The part of a cache key that these settings determine."""
        return (self.lobes, self.metric, tuple(sorted(self.fixed.items())), self.free, self.grazing)

    def fit(self, cells: Data, model: str) -> Fit:
        """The fit of a model to measured values."""
        return fit(
            cells,
            model,
            lobes=self.lobes,
            loss=self.metric,
            param=self.fixed,
            free=self.free,
            grazing=self.grazing,
        )


@dataclass(frozen=True)
class Row:
    """The fits to one file.

    file    path of the file
    fits    one entry per model, as returned by `Fit.as_dict`, best first
    best    the best fit; None if the entries come from an earlier run
    failed  reason for the failure; empty if the fits succeeded
    """

    file: str
    fits: tuple[dict[str, Any], ...]
    best: Fit | None = None
    failed: str = ""

    def as_dict(self) -> dict[str, Any]:
        return {"file": self.file, **({"failed": self.failed} if self.failed else {"fits": list(self.fits)})}


def files_of(named: Sequence[str]) -> list[str]:
    """Paths of the named files and of all measurement files in named folders. Raises InputError if there are none."""
    paths: list[str] = []
    for text in named:
        folder = Path(os.path.expanduser(text))
        if operands.kind_of(str(folder), {Kind.TABLE, Kind.FOLDER}, "DATA") is Kind.FOLDER:
            measured = (path for path in folder.iterdir() if names_table(path.name) and path.is_file())
            inside = sorted(str(path) for path in measured if not by_suffix(path)[0].common)
            if not inside:
                raise InputError("the folder contains no measurement file", text, "such as .binary, .bsdf or .gonio")
            paths += inside
        else:
            paths.append(text)
    return paths


def check_output(path: Path) -> Path:
    """Return the path, or raise InputError if the result cannot be written there."""
    if path.suffix.lower() != ".json":
        raise InputError(f"'{path.suffix}' given, .json expected", str(path), "such as -o fit.json")
    return check_file(path)


def run(
    files: Sequence[str],
    models: Sequence[str],
    settings: Settings | None = None,
    *,
    report: Callable[[int, int, str], None] = lambda done, total, text: None,
    notice: Callable[[str], None] = lambda text: None,
) -> list[Row]:
    """Fit each model to each file. If a fit fails, the error is raised if there is a single file, or else stored in
    `failed`.

    report  called before each file with the number of finished files, the total number of files, and the file's name
    notice  called at the start with a message if an earlier run has already fitted some of the files
    """
    settings = settings or Settings()
    how = (tuple(models), *settings.key)
    job = parts.Parts("fit", how, tuple(files)) if len(files) > 1 else None
    if job is not None and job.found:
        notice(f"{job.found} of {len(files)} files were already fitted")
    rows: list[Row] = []
    for number, file in enumerate(files):
        report(number, len(files), Path(file).name)
        key = _key(how, file)
        stored = job.get(key) if job is not None else None
        if stored is not None:
            rows.append(Row(file, tuple(json.loads(str(stored.facts["fits"])))))
            continue
        try:
            cells = data_of(read(file), settings.grazing, file)
            fits = ranked([settings.fit(cells, model) for model in models])
        except InputError as error:
            if len(files) == 1:
                raise
            rows.append(Row(file, (), failed=f"{error.what} ({error.where})" if error.where else error.what))
            continue
        about = tuple(one.as_dict() for one in fits)
        if job is not None:
            job.put(key, {"values": fits[0].values}, {"fits": json.dumps(about)})
        rows.append(Row(file, about, fits[0]))
    if job is not None:
        job.clear()
    return rows


def _key(how: tuple[object, ...], file: str) -> str:
    """Cache key of a fit: its settings, and the size and time stamp of the file."""
    path = Path(os.path.expanduser(file.rpartition(":")[0] if not Path(file).exists() and ":" in file else file))
    try:
        state = path.stat()
        return parts.key_of(how, file, state.st_size, state.st_mtime_ns)
    except OSError:
        return parts.key_of(how, file)


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write the rows as JSON, atomically."""
    entries = [row.as_dict() for row in rows]
    text = json.dumps(entries[0] if len(entries) == 1 else entries, indent=1, default=_plain)
    write_whole(path, (text + "\n").encode())


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else str(value)
