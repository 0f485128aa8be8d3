"""`gonio compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Exit, Option

from ..options import Json
from .base import PICTURES, verb


@verb(PICTURES, place=3)
def compare(
    test: Annotated[Path, Argument(metavar="A", help="The picture to judge: .exr, .hdr, .png, .npz.")],
    reference: Annotated[Path, Argument(metavar="B", help="The picture to judge it by.")],
    tolerance: Annotated[float | None, Option(metavar="X", help="Exit with 1 where the metric is over X.")] = None,
    metric: Annotated[str, Option(metavar="relmse|rmse|flip", help="What --tolerance is for.")] = "relmse",
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="A map of the error: .png, .pdf, .svg.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Say how far picture A is from picture B: RMSE, relMSE, ratio of the means, FLIP.

    FLIP of .exr, .hdr and .npz is HDR-FLIP: the worst of the exposures at which B can be shown.

    \b
    Examples:
      gonio compare mine.exr reference.exr
      gonio compare mine.exr reference.exr --tolerance 0.01 -o error.png
    """
    from ...viewer import error_map

    found = error_map.compare(test, reference, metric=metric, tolerance=tolerance, output=output)
    if as_json:
        print(json.dumps({"test": str(test), "reference": str(reference), **found.as_dict()}))
    else:
        for name, text in found.rows().items():
            print(f"{name:10}  {text}")
        if output is not None:
            print(f"error map   {output}")
    if not found.passed:
        raise Exit(1)
