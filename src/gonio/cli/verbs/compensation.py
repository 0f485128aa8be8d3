"""The command `gonio compensation`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from typer import Argument

from .. import completion
from ..options import Json, Material, output_option, samples_option
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=8)
def compensation(
    model: Annotated[
        list[str] | None,
        Argument(
            metavar="[MODEL]...",
            help="Additional materials: those with a base are compared as methods; all others are used as bases.",
            autocompletion=completion.materials,
        ),
    ] = None,
    output: Annotated[Path | None, output_option("DIR", "Folder for a picture and a JSON file.")] = None,
    samples: Annotated[int, samples_option("Number of random walks per reference value.")] = 200_000,
    as_json: Json = False,
) -> None:
    """Compare methods that restore the light lost by single-scattering models.

    The comparison covers the furnace test, the error, reciprocity and the cost.

    \b
    Examples:
      gonio compensation -o comparison
      gonio compensation mine.py:Compensation
    """
    from ...viewer.compensations import compensation

    result = compensation(*Material().texts(model or ()), output=output, samples=samples)
    if as_json:
        print(json.dumps(result))
    else:
        _print(result)


def _print(result: dict[str, Any]) -> None:
    """Print one row per method, and the albedos of bases that have no random walk as a reference."""
    import numpy as np

    names = list(result["rms"])
    table = listing("method", *names, "loss", "reciprocity", "time")
    print("RMS error of the albedo against the random walk; largest loss in a white furnace; reciprocity error; time")
    for method in result["cost"]:
        distances = [result["rms"][n].get(method) for n in names]
        rms = ["" if d is None else f"{d:.3f}" if d >= 1e-3 else f"{d:.0e}" for d in distances]
        broken = f"{result['reciprocity'][method]:.0e}" if method in result["reciprocity"] else ""
        furnace = f"{result['furnace']['white'].get(method, 0.0):.0e}"
        table.add_row(method, *rms, furnace, broken, f"{result['cost'][method]:.2f}")
    print_rich(table)
    for name in (n for n in names if not result["rms"][n]):
        means = (f"{method} {np.mean(values):.4f}" for method, values in result["albedo"][name].items())
        print(f"{name}: mean albedo over roughness and angle: {', '.join(means)}")
