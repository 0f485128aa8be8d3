"""`gonio compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from ...errors import InputError, did_you_mean
from ..options import Json
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...render.metrics import Comparison


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
    from ...render import images, metrics

    if metric not in metrics.METRICS:
        raise InputError(f"unknown metric '{metric}'", "--metric", did_you_mean(metric, tuple(metrics.METRICS)))
    if tolerance is not None and not tolerance >= 0:
        raise InputError(f"a tolerance of {tolerance:g}", "--tolerance", "give 0 or more")
    if output is not None:
        from ...viewer import figures

        figures.check_output(output)
    a, b = images.read(test), images.read(reference)
    try:
        result = metrics.compare(a.pixels, b.pixels, hdr=a.hdr and b.hdr)
    except InputError as error:
        raise InputError(error.what, f"{test}, {reference}", error.hint) from error
    if output is not None:
        from ...viewer import error_map

        error_map.write(output, a, b, metric)
    passed = tolerance is None or result.value(metric) <= tolerance
    if as_json:
        verdict = {"metric": metric, "tolerance": tolerance, "passed": passed}
        print(json.dumps({"test": str(test), "reference": str(reference), **result.as_dict(), **verdict}))
    else:
        _print(result, metric, tolerance, passed)
        if output is not None:
            print(f"error map  {output}")
    if not passed:
        raise Exit(1)


def _print(result: Comparison, metric: str, tolerance: float | None, passed: bool) -> None:
    kind = "LDR" if result.exposures is None else "HDR, {:+.1f} to {:+.1f} EV".format(*result.exposures)
    print(f"RMSE        {result.rmse:.6g}")
    print(f"relMSE      {result.relmse:.6g}")
    print(f"mean ratio  {result.mean_ratio:.6f}")
    print(f"FLIP        {result.flip:.6f}  ({kind})")
    if tolerance is not None:
        relation, verdict = ("<=", "passes") if passed else (">", "fails")
        print(f"{verdict}: {metric} {result.value(metric):.6g} {relation} {tolerance:g}")
