"""`gonio compensation` and `go.compensation`: compare methods that restore light lost by single-scattering models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import files
from ..catalog.material import MaterialLike, material
from ..materials.compensated import comparison
from ..owner import public
from . import energy_figures

SAMPLES = 200_000


@public
def compensation(*models: MaterialLike, output: str | Path | None = None, samples: int = SAMPLES) -> dict[str, Any]:
    """Compare methods that restore light lost by single-scattering models, by furnace test, error, reciprocity and
    cost.

        go.compensation("mine.py:Compensation", samples=20_000)["rms"]["gold"]

    models   additional materials: those with a base are compared as methods; all others are used as bases
    output   folder for a picture and a JSON file; None writes nothing
    samples  number of random walks per reference value
    Returns the dictionary that `gonio compensation --json` prints: `albedo` [material][method] at each `roughness` and
    `mu`, its `rms` error against the random walk, the largest loss in the `furnace`, the largest error of
    `reciprocity`, and the `cost`. Raises InputError for a folder that cannot be written and for invalid materials.
    """
    folder = None if output is None else files.check_folder(Path(output))
    own = [material(model) for model in models]
    result = comparison.compare(walks=samples, own=own)
    if folder is not None:
        energy_figures.plot_comparison(result, folder)
    return result
