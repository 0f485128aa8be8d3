"""`gonio bake`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Crew, Json, Material
from ..output import print_tables
from .base import MATERIALS, verb


@dataclass(frozen=True)
class Baking:
    """What is baked, and how."""

    lut: Annotated[str, Option(metavar="E,Eavg,dfg,glass,prefiltered", help="Which tables.")] = ""
    size: Annotated[int, Option(metavar="N", help="Texels along each axis.")] = 128
    method: Annotated[str, Option(metavar="NAME", help="quadrature, cosine, ggx, visible, ...")] = "quadrature"
    masking: Annotated[
        str | None, Option(metavar="NAME", help="Of a distribution: smith-correlated, ..., FILE.py:CLASS.")
    ] = None
    spp: Annotated[int, Option(metavar="N", help="Samples a texel, where sampled.")] = 1024
    points: Annotated[str, Option(metavar="hammersley|independent", help="Which random points.")] = "hammersley"
    seed: Annotated[int, Option(metavar="N", help="Of independent points.")] = 0
    layout: Annotated[str, Option(metavar="linear|stretched|homework", help="Axes and files.")] = "linear"
    aspect: Annotated[
        float | None, Option(metavar="A", help="alpha_y / alpha_x of a distribution: adds the axis phi.")
    ] = None
    azimuths: Annotated[int, Option(metavar="N", help="Slices along phi, with two widths.")] = 24
    store: Annotated[str, Option(metavar="E|1-E", help="What the homework's pictures hold.")] = "E"
    flip: Annotated[bool, Option("--flip/--no-flip", help="Homework: lowest roughness at the bottom.")] = True
    ndf: Annotated[
        str | None,
        Option(metavar="NAME", help="Of an environment: the distribution it is blurred by; ggx, ..., FILE.py:CLASS."),
    ] = None
    levels: Annotated[int | None, Option(metavar="N", help="Of an environment: maps from roughness 0 to 1; 6.")] = None


@verb(MATERIALS, place=6)
def bake(
    target: Annotated[
        str,
        Argument(
            metavar="TARGET",
            help="A distribution (ggx, beckmann), a material, or an environment (.hdr, .exr).",
            autocompletion=completion.materials_and_distributions,
        ),
    ],
    *,
    output: Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder to write.")] = Path("tables"),
    made: Material,
    how: Baking,
    crew: Crew,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, its average, the split sum and rough glass, with their measured error.

    With two widths the tables have a third axis, the azimuth. Of a material without a width: E over the cosine. Of an
    environment: its light blurred for each roughness, which the split sum multiplies by the albedo.

    \b
    Examples:
      gonio bake ggx -o tables
      gonio bake ggx --aspect 0.25 --layout stretched -o brushed
      gonio bake ggx --lut glass --size 32 -o glass
      gonio bake ggx --layout homework --masking schlick-ibl -o pictures
      gonio bake ggx --layout homework --masking schlick-direct -o text
      gonio bake conductor --preset Au --lut E,Eavg -o gold
      gonio bake sky.hdr --lut prefiltered -o sky
    """
    from ...render import tables

    options = {**vars(how), "lut": how.lut.split(",") if how.lut else None}
    with crew.working():
        baked = tables.bake(made.text(target, tables.BAKED), output, **options)
    print_tables(baked.manifest, output, as_json)
