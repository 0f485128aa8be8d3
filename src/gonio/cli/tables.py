"""Verbs about tables of energy: bake, info, compensation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError, did_you_mean
from .app import MATERIALS, app
from .options import (
    Json,
)
from .output import listing, print_rich

if TYPE_CHECKING:
    pass


@app.command(rich_help_panel=MATERIALS)
def bake(
    target: Annotated[str, typer.Argument(metavar="TARGET", help="A distribution (ggx, beckmann), or a material.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write.")] = Path("tables"),
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    preset: Annotated[str, typer.Option(metavar="NAME", help="A named preset, such as Au for conductor.")] = "",
    lut: Annotated[str, typer.Option(metavar="E,Eavg,dfg,glass", help="Which tables.")] = "",
    size: Annotated[int, typer.Option(metavar="N", help="Texels along each axis.")] = 128,
    method: Annotated[str, typer.Option(metavar="NAME", help="quadrature, cosine, ggx, visible, ...")] = "quadrature",
    masking: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a distribution: smith-correlated, ...")
    ] = None,
    spp: Annotated[int, typer.Option(metavar="N", help="Samples a texel, where sampled.")] = 1024,
    points: Annotated[str, typer.Option(metavar="hammersley|independent", help="Which random points.")] = "hammersley",
    seed: Annotated[int, typer.Option(metavar="N", help="Of independent points.")] = 0,
    layout: Annotated[str, typer.Option(metavar="linear|stretched|homework", help="Axes and files.")] = "linear",
    aspect: Annotated[
        float | None, typer.Option(metavar="A", help="alpha_y / alpha_x of a distribution: adds the axis phi.")
    ] = None,
    azimuths: Annotated[int, typer.Option(metavar="N", help="Slices along phi, with two widths.")] = 24,
    store: Annotated[str, typer.Option(metavar="E|1-E", help="What the homework's pictures hold.")] = "E",
    flip: Annotated[bool, typer.Option("--flip/--no-flip", help="Homework: lowest roughness at the bottom.")] = True,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, its average, the split sum and rough glass, with their measured error.

    With two widths the tables have a third axis, the azimuth. Of a material without a width: E over the cosine.

    \b
    Examples:
      gonio bake ggx -o tables
      gonio bake ggx --aspect 0.25 --layout stretched -o brushed
      gonio bake ggx --lut glass --size 32 -o glass
      gonio bake ggx --layout homework --masking schlick-direct --method ggx -o homework
      gonio bake conductor --preset Au --lut E,Eavg -o gold
    """
    from ..models import models as known_models
    from ..models import notation
    from ..optics.ndf import distributions
    from ..render import tables

    if target in distributions():
        what: Any = target
        if param or preset:
            hint = "bake a material, such as conductor; alpha is an axis of the table"
            raise InputError(f"'{target}' is a distribution, without parameters", "--param", hint)
    else:
        known = [*distributions(), *known_models()]
        if target.replace("_", "-") not in known:
            raise InputError(f"unknown distribution or material '{target}'", "TARGET", did_you_mean(target, known))
        what = notation.named(target, param or [], preset)[0]
    options: dict[str, Any] = {"lut": lut.split(",")} if lut else {}
    options |= {"size": size, "method": method, "masking": masking, "spp": spp, "points": points, "seed": seed}
    options |= {"aspect": aspect, "azimuths": azimuths}
    baked = tables.bake(what, output, layout=layout, store=store, flip=flip, **options)
    _print_tables(baked.manifest, output, as_json)


@app.command(rich_help_panel=MATERIALS)
def info(
    path: Annotated[Path, typer.Argument(metavar="DIR", help="A baked folder or tables.npz.")], as_json: Json = False
) -> None:
    """Read baked tables back: what they hold, how they were made, how far they err.

    \b
    Example:
      gonio info tables
    """
    from ..render import tables

    _print_tables(tables.describe(path), path, as_json)


def _print_tables(manifest: dict[str, Any], path: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"path": str(path), **manifest}))
        return
    facts = [manifest["ndf"], manifest["masking"], manifest["method"], f"layout {manifest['layout']}"]
    facts += [f"alpha_y / alpha_x = {manifest['aspect']:g}"] if "aspect" in manifest else []
    print(f"{path}: {', '.join(filter(None, facts))}")
    table = listing("table", "shape", "max error", "rms", "between")
    for name, shape in manifest["tables"].items():
        error = manifest["error"].get(name, {})
        figures = [f"{error[key]:.1e}" if key in error else "" for key in ("max", "rms", "interpolation")]
        dims = [*manifest["dims"][name], ""]
        table.add_row(name, " x ".join(f"{n} {axis}".strip() for n, axis in zip(shape, dims, strict=False)), *figures)
    print_rich(table)
    for axis, text in manifest["axes"].items():
        print(f"{axis:10} {text}")


@app.command(rich_help_panel=MATERIALS)
def compensation(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write a picture and JSON.")
    ] = None,
    walks: Annotated[int, typer.Option(metavar="N", help="Random walks a point of the referee.")] = 200_000,
    as_json: Json = False,
) -> None:
    """Compare the ways to give back lost light: furnace, distance to the random walk, reciprocity, cost.

    \b
    Example:
      gonio compensation -o comparison
    """
    from ..energy import comparison

    if output is not None:
        from .. import files
        from ..viewer import energy_figures

        output = files.check_folder(output)
    found = comparison.compare(walks=walks)
    if output is not None:
        energy_figures.plot_comparison(found, output)
    if as_json:
        print(json.dumps(found))
        return
    names = list(found["rms"])
    table = listing("method", *names, "loss", "recip.", "time")
    print("RMS distance of the albedo to the random walk; largest loss in a white furnace; breach of reciprocity; time")
    for method in comparison.METHODS:
        distances = [found["rms"][n].get(method) for n in names]
        rms = ["" if d is None else f"{d:.3f}" if d >= 1e-3 else f"{d:.0e}" for d in distances]
        broken = f"{found['reciprocity'][method]:.0e}" if method in found["reciprocity"] else ""
        furnace = f"{found['furnace']['white'].get(method, 0.0):.0e}"
        table.add_row(method, *rms, furnace, broken, f"{found['cost'][method]:.2f}")
    print_rich(table)
