"""`gonio compensation`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Json, Material
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=8)
def compensation(
    model: Annotated[
        list[str] | None,
        Argument(
            metavar="[MODEL]...",
            help="Materials to compare too: one with a base as a method, any other as a base.",
            autocompletion=completion.materials,
        ),
    ] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="DIR", help="Write a picture and JSON.")] = None,
    walks: Annotated[int, Option(metavar="N", help="Random walks a point of the referee.")] = 200_000,
    as_json: Json = False,
) -> None:
    """Compare the ways to give back lost light: furnace, distance to the random walk, reciprocity, cost.

    \b
    Examples:
      gonio compensation -o comparison
      gonio compensation mine.py:Compensation
    """
    import numpy as np

    from ...catalog import notation
    from ...materials.compensated import comparison

    if output is not None:
        from ... import files
        from ...viewer import energy_figures

        output = files.check_folder(output)
    found = comparison.compare(walks=walks, own=[notation.named(text)[0] for text in Material().texts(model or ())])
    if output is not None:
        energy_figures.plot_comparison(found, output)
    if as_json:
        print(json.dumps(found))
        return
    names = list(found["rms"])
    table = listing("method", *names, "loss", "recip.", "time")
    print("RMS distance of the albedo to the random walk; largest loss in a white furnace; breach of reciprocity; time")
    for method in found["cost"]:
        distances = [found["rms"][n].get(method) for n in names]
        rms = ["" if d is None else f"{d:.3f}" if d >= 1e-3 else f"{d:.0e}" for d in distances]
        broken = f"{found['reciprocity'][method]:.0e}" if method in found["reciprocity"] else ""
        furnace = f"{found['furnace']['white'].get(method, 0.0):.0e}"
        table.add_row(method, *rms, furnace, broken, f"{found['cost'][method]:.2f}")
    print_rich(table)
    for name in (n for n in names if not found["rms"][n]):
        means = (f"{method} {np.mean(values):.4f}" for method, values in found["albedo"][name].items())
        print(f"{name}: albedo, the mean over roughness and angle: {', '.join(means)}")
