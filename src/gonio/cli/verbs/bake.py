"""`gonio bake`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ...errors import InputError
from .. import completion
from ..options import Executor, Json, Material, Options, Seed, output_option, samples_option
from ..output import print_tables
from .base import MATERIALS, verb


class Baking(Options):
    """The tables to bake, and the method."""

    lut: Annotated[str, Option(metavar="E,Eavg,dfg,glass,ltc,prefiltered", help="The tables to bake.")] = ""
    resolution: Annotated[int | None, Option(metavar="N", help="Texels along each axis; 128, for ltc 64 or 16.")] = None
    method: Annotated[str, Option(metavar="NAME", help="Integrate by quadrature, cosine, ggx, visible, ...")] = (
        "quadrature"
    )
    masking: Annotated[
        str | None, Option(metavar="NAME", help="Masking term of a distribution: smith-correlated, ..., FILE.py:CLASS.")
    ] = None
    samples: Annotated[int, samples_option("Random samples per texel, for methods that sample.")] = 1024
    sampler: Annotated[
        str, Option(metavar="NAME", help="Points of these methods: hammersley, stratified, independent.")
    ] = "hammersley"
    seed: Seed = None
    layout: Annotated[str, Option(metavar="linear|stretched|homework", help="Axes and files.")] = "linear"
    aspect: Annotated[
        float | None, Option(metavar="A", help="alpha_y / alpha_x of a distribution: adds the axis phi.")
    ] = None
    azimuths: Annotated[int, Option(metavar="N", help="Values along phi, for anisotropic tables.")] = 24
    store: Annotated[str, Option(metavar="E|1-E", help="Homework: what the pictures hold.")] = "E"
    flip: Annotated[bool, Option("--flip/--no-flip", help="Homework: lowest roughness at the bottom.")] = True
    floor: Annotated[float, Option(metavar="X", help="Lower bound of D's denominator, for --method cosine.")] = 0.0
    wrap: Annotated[
        bool, Option("--wrap", help="Homework: bytes as its program writes them, rounded down and wrapped at 256.")
    ] = False
    ndf: Annotated[
        str | None, Option(metavar="NAME", help="Distribution that blurs an environment: ggx, ..., FILE.py:CLASS.")
    ] = None
    levels: Annotated[
        int | None, Option(metavar="N", help="Maps of an environment, from roughness 0 to 1; 6 by default.")
    ] = None


def _refuse(made: Material, options: dict[str, object]) -> None:
    """Raise InputError for options that a preset of the homework sets itself."""
    given = [name for name, value in options.items() if value != getattr(Baking(), name) and value is not None]
    given += ["param"] if made.param else []
    if given:
        raise InputError(
            f"--{given[0]} given with a preset of the homework, which sets it", f"--{given[0]}", "leave it out"
        )


@verb(MATERIALS, place=6)
def bake(
    target: Annotated[
        str | None,
        Argument(
            metavar="TARGET",
            help="A distribution (ggx, beckmann), a material, or an environment (.hdr, .exr).",
            autocompletion=completion.materials_and_distributions,
        ),
    ] = None,
    *,
    output: Annotated[Path, output_option("DIR", "Folder of the tables.")] = Path("tables"),
    made: Material,
    how: Baking,
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, its average, the split sum and rough glass, with their measured error.

    The homework's text uses k = (roughness + 1)^2 / 8, its figures use k = alpha / 2: --preset homework-text bakes the
    first, --preset homework-figure the second, sampled as in the homework's picture.

    Tables of an anisotropic distribution have a third axis, the azimuth. A material without roughness gives E as a
    function of the cosine. An environment gives its light blurred for each roughness, which the split sum multiplies by
    the albedo.

    `--lut ltc` fits linearly transformed cosines to a material, and writes their error and the shader code of area
    lights. For an anisotropic material, the tables have an axis for the azimuth and 16 texels along the others.

    \b
    Examples:
      gonio bake ggx -o tables
      gonio bake ggx --aspect 0.25 --layout stretched -o brushed
      gonio bake ggx --lut glass --resolution 32 -o glass
      gonio bake --preset homework-text -o text
      gonio bake --preset homework-figure -o figure
      gonio bake conductor --preset Au --lut E,Eavg -o gold
      gonio bake conductor --preset Au --lut ltc -o gold-light
      gonio bake sky.hdr --lut prefiltered -o sky
    """
    from ...render import tables

    options = {**vars(how), "lut": how.lut.split(",") if how.lut else None}
    preset = made.preset if target is None or made.preset in tables.PRESETS else ""
    if target is None and not preset:
        raise InputError("no target given", "TARGET", "such as: gonio bake ggx -o tables")
    with executor.running():
        if preset:
            made.shaders(())
            named = {name: options.pop(name) for name in ("resolution", "seed", "store", "flip")}
            _refuse(made, options)
            baked = tables.bake(target or "ggx", output, preset=preset, **named)
        else:
            baked = tables.bake(made.text(str(target), tables.BAKED), output, **options)
    print_tables(baked.manifest, output, as_json)
