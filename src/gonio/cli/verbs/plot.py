"""`gonio plot`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from typer import Option

from ..options import Material, Model
from .base import MATERIALS, verb


@verb(MATERIALS, place=1)
def plot(
    model: Model,
    *,
    made: Material,
    kind: Annotated[str, Option(metavar="lobe|slice|albedo", help="What to draw.")] = "lobe",
    angles: Annotated[str, Option(metavar="A,B,..", help="Directions of view, degrees from the normal.")] = "",
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help=".png, .pdf, .svg.")] = None,
) -> None:
    """Draw a material: its lobes (polar), a slice over angle, or its albedo curve; or the tables in a baked folder.

    The density it is sampled with is drawn dashed over its values.

    \b
    Examples:
      gonio plot conductor --preset Au --param alpha=.3
      gonio plot phong -p p=32 --kind slice -o phong.pdf
      gonio plot dielectric -p alpha=.2 --kind albedo
      gonio plot ./tables -o tables.png
    """
    if os.sep in model or model.endswith(".npz") or Path(model).is_dir():
        from ...viewer import energy_figures

        print(energy_figures.plot_tables(model, output))
        return
    from ...viewer import plots

    print(plots.plot(model, made.param or [], made.preset, kind, angles, output))
