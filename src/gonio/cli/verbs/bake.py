"""`gonio bake`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Executor, Json, Material, Seed, output_option, samples_option
from ..output import print_tables
from .base import MATERIALS, verb


@dataclass(frozen=True)
class Baking:
    """What is baked, and how."""

    lut: Annotated[str, Option(metavar="E,Eavg,dfg,glass,prefiltered", help="The tables to bake.")] = ""
    resolution: Annotated[int, Option(metavar="N", help="Texels along each axis.")] = 128
    method: Annotated[str, Option(metavar="NAME", help="Integrate by quadrature, cosine, ggx, visible, ...")] = (
        "quadrature"
    )
    masking: Annotated[
        str | None, Option(metavar="NAME", help="Masking term of a distribution: smith-correlated, ..., FILE.py:CLASS.")
    ] = None
    samples: Annotated[int, samples_option("Random samples per texel, of the methods that sample.")] = 1024
    sampler: Annotated[str, Option(metavar="NAME", help="Random points of these: hammersley or independent.")] = (
        "hammersley"
    )
    seed: Seed = None
    layout: Annotated[str, Option(metavar="linear|stretched|homework", help="Axes and files.")] = "linear"
    aspect: Annotated[
        float | None, Option(metavar="A", help="alpha_y / alpha_x of a distribution: adds the axis phi.")
    ] = None
    azimuths: Annotated[int, Option(metavar="N", help="Values along phi, of anisotropic tables.")] = 24
    store: Annotated[str, Option(metavar="E|1-E", help="What the homework's pictures hold.")] = "E"
    flip: Annotated[bool, Option("--flip/--no-flip", help="Homework: lowest roughness at the bottom.")] = True
    ndf: Annotated[
        str | None, Option(metavar="NAME", help="Distribution that blurs an environment: ggx, ..., FILE.py:CLASS.")
    ] = None
    levels: Annotated[
        int | None, Option(metavar="N", help="Maps of an environment, from roughness 0 to 1; 6 by default.")
    ] = None


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
    output: Annotated[Path, output_option("DIR", "Folder of the tables.")] = Path("tables"),
    made: Material,
    how: Baking,
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, its average, the split sum and rough glass, with their measured error.

    Tables of an anisotropic distribution have a third axis, the azimuth. Of a material without roughness: E over the
    cosine. Of an environment: its light blurred for each roughness, which the split sum multiplies by the albedo.

    \b
    Examples:
      gonio bake ggx -o tables
      gonio bake ggx --aspect 0.25 --layout stretched -o brushed
      gonio bake ggx --lut glass --resolution 32 -o glass
      gonio bake ggx --layout homework --masking schlick-ibl -o pictures
      gonio bake ggx --layout homework --masking schlick-direct -o text
      gonio bake conductor --preset Au --lut E,Eavg -o gold
      gonio bake sky.hdr --lut prefiltered -o sky
    """
    from ...render import tables

    options = {**vars(how), "lut": how.lut.split(",") if how.lut else None}
    with executor.running():
        baked = tables.bake(made.text(target, tables.BAKED), output, **options)
    print_tables(baked.manifest, output, as_json)
