"""Errors of fits to a folder of measured files, and the excess of each relative to the best of 20 random starts.

    python benchmarks/rgl_fits.py FOLDER [--models conductor,lambert+ggx] [--starts 20] [--values 6000] -o fits.json

Each model is fitted by `go.fit` to a random sample of each file's values, the same for all models. The models of
`JUDGED` are also solved from random starting points, each to convergence, on the same values and by the same loss: a
fit that ends in a poor minimum has a positive excess, error / (least error of the random starts) - 1. The file is
written after every fit; a later run adds what is missing.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gonio.fitting.data import Data, data_of
from gonio.fitting.fit import Fit, fit
from gonio.fitting.models import moving_of
from gonio.fitting.parameters import start_of
from gonio.fitting.solver import Problem, solve
from gonio.fitting.starts import random_starts
from gonio.measure import names_table, read

# models that are also solved from random starts: one of each kind of lobe, and sums
JUDGED = (
    "lambert", "oren-nayar", "conductor", "metal", "ward", "cook-torrance", "ashikhmin-shirley", "modified-phong",
    "disney", "lambert+ggx", "lambert+beckmann", "lambert+ggx+ggx",
)  # fmt: skip
# the other models that contain no material and whose fit to a sample takes under 10 s
OTHERS = (
    "blinn-phong", "dielectric", "eon", "lafortune", "low-microfacet", "low-smooth", "phong", "sheen", "sheen-charlie",
    "ward-duer", "oren-nayar+ggx", "lambert+ward", "lambert+sheen",
)  # fmt: skip
STARTS, STEPS = 20, 40
SEED = 101  # for random starts other than the fit's own


def of_random_starts(cells: Data, model: str, count: int) -> float:
    """The least error, root mean square of the residuals of "relative", over the solutions from random starts."""
    material, moving = moving_of(model)
    problem = Problem(material, moving, cells, "relative")
    starts = random_starts(start_of(material, moving), moving, count, SEED)
    with np.errstate(over="ignore", invalid="ignore"):  # a random start may be far outside the range of float32
        ends = [solve(problem, start, steps=STEPS, tolerance=1e-5).cost for start in starts]
    return float(np.sqrt(min(ends) / (3 * len(cells))))


def row_of(file: Path, model: str, cells: Data, starts: int) -> dict[str, Any]:
    """The results of one fit; `random` is None without random starts."""
    started = time.process_time()
    found: Fit = fit(cells, model)
    seconds = time.process_time() - started
    least = of_random_starts(cells, model, starts) if starts else None
    return {
        "file": file.stem,
        "model": model,
        "numbers": len(found.names),
        "error": float(f"{found.error:.5g}"),
        "relative": float(f"{found.relative:.4g}"),
        "random": None if least is None else float(f"{least:.5g}"),
        "excess": None if least is None else round(found.error / least - 1.0, 5),
        "seconds": round(seconds, 1),
    }


def files_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if names_table(path.name))


def rows_of(
    files: Sequence[Path], models: Sequence[str], known: Sequence[dict[str, Any]], values: int, starts: int
) -> Iterator[dict[str, Any]]:
    """One row per file and model; `known` ones are not fitted again."""
    rows = {(row["file"], row["model"]): row for row in known}
    for file in files:
        cells: Data | None = None
        for model in models:
            if (file.stem, model) not in rows:
                cells = cells or data_of(read(file), where=str(file)).some(values)
                rows[file.stem, model] = row_of(file, model, cells, starts if model in JUDGED else 0)
            yield rows[file.stem, model]


def told(row: dict[str, Any]) -> str:
    excess = "" if row["excess"] is None else f"  {100.0 * row['excess']:+7.2f} % of random starts' {row['random']:.4g}"
    return f"{row['file']:24} {row['model']:18} {row['error']:8.4f} {row['seconds']:6.1f} s{excess}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--models", default=",".join((*JUDGED, *OTHERS)))
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--values", type=int, default=6000)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    known = json.loads(options.output.read_text()) if options.output and options.output.exists() else []
    rows: list[dict[str, Any]] = []
    models = options.models.split(",")
    for row in rows_of(files_in(options.folder), models, known, options.values, options.starts):
        rows.append(row)
        print(told(row), flush=True)
        if options.output and len(rows) >= len(known):
            write(options.output, rows)
    judged = [row["excess"] for row in rows if row["excess"] is not None]
    if judged:
        print(f"{len(judged)} fits, at most {100.0 * max(judged):.2f} % worse than the best of {options.starts} starts")


def write(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write the rows as JSON, one per line; the file is complete at any time."""
    part = path.with_suffix(".part")
    part.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")
    os.replace(part, path)


if __name__ == "__main__":
    main()
