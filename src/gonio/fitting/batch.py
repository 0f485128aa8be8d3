"""Fits of several models to several files, each kept when it is done."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import files as whole
from ..catalog import operands
from ..catalog.operands import Kind
from ..errors import InputError
from ..measure import names_table, read
from ..work import parts
from .data import GRAZING, data_of
from .fit import Fit, fit, ranked


@dataclass(frozen=True)
class Row:
    """One file.

    file    its path
    fits    of each model, as `Fit.as_dict` has them, the best first
    best    the best one itself, where it was fitted now
    failed  why nothing came of it, in words
    """

    file: str
    fits: tuple[dict[str, Any], ...]
    best: Fit | None = None
    failed: str = ""

    def as_dict(self) -> dict[str, Any]:
        return {"file": self.file, **({"failed": self.failed} if self.failed else {"fits": list(self.fits)})}


def files_of(named: Sequence[str]) -> list[str]:
    """The files that are named, those in a folder among them, by name. InputError where there is none."""
    found: list[str] = []
    for text in named:
        folder = Path(os.path.expanduser(text))
        if operands.kind_of(str(folder), {Kind.TABLE, Kind.FOLDER}, "DATA") is Kind.FOLDER:
            inside = sorted(str(path) for path in folder.iterdir() if names_table(path.name) and path.is_file())
            if not inside:
                raise InputError("no file of measurements in it", text, "such as .binary, .bsdf or .gonio")
            found += inside
        else:
            found.append(text)
    return found


def check_output(path: Path) -> Path:
    """Raise InputError where the result cannot be written."""
    if path.suffix.lower() != ".json":
        raise InputError(f"'{path.suffix}' given, .json expected", str(path), "such as -o fit.json")
    return whole.check_file(path)


def run(
    files: Sequence[str],
    models: Sequence[str],
    *,
    lobes: int = 1,
    metric: str = "relative",
    fixed: Mapping[str, object] | None = None,
    free: tuple[str, ...] = (),
    grazing: float = GRAZING,
    report: Callable[[int, int, str], None] = lambda done, total, text: None,
    notice: Callable[[str], None] = lambda text: None,
) -> list[Row]:
    """Each model fitted to each file. Of one file an error is raised; of several it becomes the row's `failed`."""
    given = dict(fixed or {})
    how = (tuple(models), lobes, metric, tuple(sorted(given.items())), free, grazing)
    job = parts.Parts("fit", how, tuple(files)) if len(files) > 1 else None
    if job is not None and job.found:
        notice(f"{job.found} of {len(files)} files were fitted before")
    rows: list[Row] = []
    for number, file in enumerate(files):
        report(number, len(files), Path(file).name)
        key = _key(how, file)
        kept = job.get(key) if job is not None else None
        if kept is not None:
            rows.append(Row(file, tuple(json.loads(str(kept.facts["fits"])))))
            continue
        try:
            cells = data_of(read(file), grazing, file)
            fits = ranked(
                [
                    fit(cells, model, lobes=lobes, loss=metric, param=given, free=free, grazing=grazing)
                    for model in models
                ]
            )
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
    """What a fit depends on: the question and the file's state."""
    path = Path(os.path.expanduser(file.rpartition(":")[0] if not Path(file).exists() and ":" in file else file))
    try:
        state = path.stat()
        return parts.key_of(how, file, state.st_size, state.st_mtime_ns)
    except OSError:
        return parts.key_of(how, file)


def write(path: Path, rows: Sequence[Row]) -> None:
    """The rows as JSON, whole or not at all."""
    found = [row.as_dict() for row in rows]
    text = json.dumps(found[0] if len(found) == 1 else found, indent=1, default=_plain)
    whole.write_whole(path, (text + "\n").encode())


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else str(value)
