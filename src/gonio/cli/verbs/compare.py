"""`gonio compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from .. import completion
from ..options import Json, Material, output_option
from ..output import listing, print_rich
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...energy.difference import Difference, View
    from ...pictures.metrics import Comparison


@verb(PICTURES, place=3)
def compare(
    test: Annotated[
        str,
        Argument(
            metavar="A",
            help="The picture to compare: .exr, .hdr, .png, .npz; or a material.",
            autocompletion=completion.materials,
        ),
    ],
    reference: Annotated[
        str,
        Argument(metavar="B", help="The reference: a picture or a material.", autocompletion=completion.materials),
    ],
    *,
    tolerance: Annotated[float | None, Option(metavar="X", help="Exit with 1 if the metric exceeds X.")] = None,
    metric: Annotated[
        str | None,
        Option(metavar="NAME", help="Metric of --tolerance: relmse, rmse, flip; of materials mean, largest, albedo."),
    ] = None,
    encoding: Annotated[
        str, Option(metavar="srgb|linear", help="Encoding of .png files; linear is for data, such as tables.")
    ] = "srgb",
    output: Annotated[Path | None, output_option("FILE", "A map of the error: .png, .pdf, .svg.")] = None,
    made: Material,
    as_json: Json = False,
) -> None:
    """Measure the difference between picture A and picture B, or between material A and material B.

    Of pictures: RMSE, relMSE, ratio of the means, FLIP. A .png is decoded from sRGB; with --encoding linear it is read
    as data. FLIP of .exr, .hdr and .npz is HDR-FLIP: the worst over the exposures at which B can be shown.

    Of materials: the largest and the mean difference of f, and the albedos. --param and --preset apply to each of the
    two that has them.

    \b
    Examples:
      gonio compare mine.exr reference.exr
      gonio compare mine.exr reference.exr --tolerance 0.01 -o error.png
      gonio compare tables/E.png reference/E.png --encoding linear
      gonio compare mine.py:Rough oren-nayar -p sigma=0.5 -o difference.png
    """
    from ...catalog import operands
    from ...catalog.operands import Kind
    from ...errors import InputError
    from ...viewer import error_map

    accepted = {Kind.PICTURE, *operands.MATERIALS}
    kinds = {operands.kind_of(one, accepted, name) is Kind.PICTURE for one, name in ((test, "A"), (reference, "B"))}
    if len(kinds) > 1:
        raise InputError("a picture and a material", f"{test}, {reference}", "compare two of a kind")
    found: Comparison | Difference
    if True in kinds:
        made.refuse(test)
        found = error_map.compare(test, reference, metric=metric, tolerance=tolerance, output=output, encoding=encoding)
        text = "\n".join(f"{name:10}  {row}" for name, row in found.rows().items())
    else:
        test, reference = made.texts([test, reference])
        found = error_map.compare_materials(test, reference, metric or "mean", tolerance, output)
        text = _heading(test, reference, found)
    if as_json:
        print(json.dumps({"test": test, "reference": reference, **found.as_dict()}))
    else:
        print(text)
        if True not in kinds:
            _print_views(found)  # type: ignore[arg-type]  # of materials
        if output is not None:
            print(f"error map   {output}")
    if not found.passed:
        raise Exit(1)


def _heading(a: str, b: str, found: Difference) -> str:
    at = found.largest_at
    f_a, f_b = at.f
    lines = [
        f"A           {a}",
        f"B           {b}",
        f"mean        {100.0 * found.mean:.4g} % of B's light, over all light and views",
        f"largest     {100.0 * found.largest:.4g} % of the larger f: A {f_a:.4g}, B {f_b:.4g} 1/sr "
        f"at wo {at.theta:.3g}, wi {_angles(at)} degrees",
        f"albedo      {found.albedo:.4g} apart at most",
    ]
    if not found.known.everything:
        lines.insert(2, f"compared    {found.known}, which both are known at")
    if found.has_specular:
        lines.append("specular    perfectly specular parts have no f, and count in the albedo alone")
    if found.tolerance is not None:
        relation, word = ("<=", "passes") if found.passed else (">", "fails")
        lines.append(f"{word:10}  {found.metric} {found.value(found.metric):.6g} {relation} {found.tolerance:g}")
    return "\n".join(lines)


def _print_views(found: Difference) -> None:
    table = listing("wo", "mean", "largest", "at wi", "f of A, of B", "albedo of A", "albedo of B")
    for view in found.views:
        albedos = ("  ".join(f"{x:.4f}" for x in one) for one in view.albedo)
        shares = (f"{100.0 * share:.3g} %" for share in (view.mean, view.largest))
        table.add_row(f"{view.theta:.3g}", *shares, _angles(view), "  ".join(f"{x:.4g}" for x in view.f), *albedos)
    print_rich(table)


def _angles(view: View) -> str:
    """theta and phi from wo, degrees, as `gonio verify --at` has them."""
    return f"{view.wi[0]:.3g},{view.wi[1]:.3g}"
