"""The command `gonio compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from .. import completion
from ..options import Json, Material, Options, output_option
from ..output import listing, print_rich
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...energy.difference import Difference, View
    from ...pictures.metrics import Comparison


class Judging(Options):
    """The metric, and the largest difference that passes."""

    tolerance: Annotated[
        float | None,
        Option(metavar="X", help="Largest accepted value of the metric; if it is exceeded, the exit code is 1."),
    ] = None
    metric: Annotated[
        str | None,
        Option(
            metavar="NAME", help="Metric for --tolerance: relmse, rmse, flip; for materials: mean, largest, albedo."
        ),
    ] = None
    encoding: Annotated[
        str,
        Option(
            metavar="srgb|linear", help="Encoding of .png files; use linear for files that store data, such as tables."
        ),
    ] = "srgb"


@verb(PICTURES, place=3)
def compare(
    test: Annotated[
        str,
        Argument(
            metavar="A",
            help="Picture (.exr, .hdr, .png or .npz) or material to compare.",
            autocompletion=completion.materials,
        ),
    ],
    reference: Annotated[
        str,
        Argument(metavar="B", help="Reference picture or material.", autocompletion=completion.materials),
    ],
    *,
    how: Judging,
    output: Annotated[Path | None, output_option("FILE", "File for an error map: .png, .pdf or .svg.")] = None,
    made: Material,
    as_json: Json = False,
) -> None:
    """Measure the difference between two pictures or two materials, A and B.

    Pictures are compared by RMSE, relMSE, the ratio of their means, and FLIP. A .png is decoded from sRGB; with
    --encoding linear, it is read as linear data. For .exr, .hdr and .npz, FLIP is HDR-FLIP, the maximum over the
    exposures at which B can be displayed.

    Materials are compared by the mean and the largest difference of f, and by their albedos. --param and --preset are
    applied to each material that has the parameter or preset.

    \b
    Examples:
      gonio compare mine.exr reference.exr
      gonio compare mine.exr reference.exr --tolerance 0.01 -o error.png
      gonio compare tables/E.png reference/E.png --encoding linear
      gonio compare mine.py:Rough oren-nayar -p sigma=0.5 -o difference.png
    """
    from ...energy.difference import Difference
    from ...viewer import error_map

    result: Comparison | Difference
    if _are_pictures(test, reference):
        made.refuse(test)
        result = error_map.compare(test, reference, output=output, **vars(how))
        lines = [f"{name:10}  {row}" for name, row in result.rows().items()]
    else:
        test, reference = made.texts([test, reference])
        result = error_map.compare_materials(test, reference, how.metric or "mean", how.tolerance, output)
        lines = _heading(test, reference, result)
    if as_json:
        print(json.dumps({"test": test, "reference": reference, **result.as_dict()}))
    else:
        print("\n".join(lines))
        if isinstance(result, Difference):
            _print_views(result)
        if output is not None:
            print(f"error map   {output}")
    if not result.passed:
        raise Exit(1)


def _are_pictures(test: str, reference: str) -> bool:
    """True for two pictures, False for two materials. Raises InputError for a picture and a material."""
    from ...catalog import operands
    from ...catalog.operands import Kind
    from ...errors import InputError

    accepted = {Kind.PICTURE, *operands.MATERIALS}
    kinds = {operands.kind_of(one, accepted, name) is Kind.PICTURE for one, name in ((test, "A"), (reference, "B"))}
    if len(kinds) > 1:
        raise InputError("a picture and a material given", f"{test}, {reference}", "compare two of a kind")
    return True in kinds


def _heading(a: str, b: str, result: Difference) -> list[str]:
    """The results of comparing two materials, one per line."""
    at = result.largest_at
    f_a, f_b = at.f
    lines = [
        f"A           {a}",
        f"B           {b}",
        f"mean        {100.0 * result.mean:.4g} % of the light reflected by B, averaged over the views",
        f"largest     {100.0 * result.largest:.4g} % of the larger f: A {f_a:.4g}, B {f_b:.4g} 1/sr "
        f"at wo {at.theta:.3g}, wi {_angles(at)} degrees",
        f"albedo      largest difference {result.albedo:.4g}",
    ]
    if not result.known.everything:
        lines.insert(2, f"compared    {result.known}, the angles at which both are known")
    if result.has_specular:
        lines.append("specular    delta lobes have no finite f, and contribute only to the albedo")
    if result.tolerance is not None:
        relation, word = ("<=", "passes") if result.passed else (">", "fails")
        lines.append(f"{word:10}  {result.metric} {result.value(result.metric):.6g} {relation} {result.tolerance:g}")
    return lines


def _print_views(result: Difference) -> None:
    table = listing("wo", "mean", "largest", "at wi", "f of A, of B", "albedo of A", "albedo of B")
    for view in result.views:
        albedos = ("  ".join(f"{x:.4f}" for x in one) for one in view.albedo)
        shares = (f"{100.0 * share:.3g} %" for share in (view.mean, view.largest))
        table.add_row(f"{view.theta:.3g}", *shares, _angles(view), "  ".join(f"{x:.4g}" for x in view.f), *albedos)
    print_rich(table)


def _angles(view: View) -> str:
    """theta of wi, and phi relative to wo, in degrees, in the form accepted by `gonio verify --at`."""
    return f"{view.wi[0]:.3g},{view.wi[1]:.3g}"
