"""The command `gonio bake`."""

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
    """Options that select the tables to bake and the integration method."""

    lut: Annotated[
        str, Option(metavar="E,Eavg,dfg,glass,ltc,prefiltered", help="Tables to bake, separated by commas.")
    ] = ""
    resolution: Annotated[
        int | None,
        Option(metavar="N", help="Number of texels along each axis; 128 by default, or 64 for ltc (anisotropic: 16)."),
    ] = None
    method: Annotated[
        str,
        Option(
            metavar="NAME", help="Integration method: quadrature, or a sampling density (cosine, ggx, visible, ...)."
        ),
    ] = "quadrature"
    masking: Annotated[
        str | None,
        Option(metavar="NAME", help="Masking term of a distribution, such as smith-correlated or FILE.py:CLASS."),
    ] = None
    samples: Annotated[int, samples_option("Number of samples per texel, for all methods except quadrature.")] = 1024
    sampler: Annotated[
        str,
        Option(metavar="NAME", help="Sampler of all methods except quadrature: hammersley, stratified or independent."),
    ] = "hammersley"
    seed: Seed = None
    layout: Annotated[
        str,
        Option(
            metavar="linear|stretched|homework",
            help="Layout of the axes; homework also writes the pictures of homework 4.",
        ),
    ] = "linear"
    aspect: Annotated[
        float | None,
        Option(
            metavar="A", help="Ratio alpha_y / alpha_x of a distribution; a ratio other than 1 adds an azimuth axis."
        ),
    ] = None
    azimuths: Annotated[int, Option(metavar="N", help="Number of azimuths in anisotropic tables.")] = 24
    store: Annotated[str, Option(metavar="E|1-E", help="Quantity stored in the pictures of --layout homework.")] = "E"
    flip: Annotated[
        bool, Option("--flip/--no-flip", help="Put the lowest roughness at the bottom of the homework pictures.")
    ] = True
    floor: Annotated[float, Option(metavar="X", help="Lower bound of the denominator of D, for --method cosine.")] = 0.0
    wrap: Annotated[
        bool, Option("--wrap", help="Truncate values to bytes, modulo 256, as the program of homework 4 does.")
    ] = False
    ndf: Annotated[
        str | None, Option(metavar="NAME", help="Distribution for blurring environments, such as ggx or FILE.py:CLASS.")
    ] = None
    levels: Annotated[
        int | None,
        Option(metavar="N", help="Number of blurred maps of an environment, from roughness 0 to 1; 6 by default."),
    ] = None


def _refuse(made: Material, options: dict[str, object]) -> None:
    """Raise InputError for options whose values are set by a preset of the homework."""
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
            help="Distribution (ggx, beckmann), material, or environment (.hdr, .exr).",
            autocompletion=completion.materials_and_distributions,
        ),
    ] = None,
    *,
    output: Annotated[Path, output_option("DIR", "Folder for the tables.")] = Path("tables"),
    made: Material,
    how: Baking,
    executor: Executor,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, average albedo, the split sum and rough glass, with their errors.

    The text of homework 4 uses k = (roughness + 1)^2 / 8, but its figures use k = alpha / 2. --preset homework-text
    bakes the tables of the text, and --preset homework-figure bakes those of the figures, with the same sampling.

    Tables of an anisotropic distribution have a third axis, the azimuth. For a material without roughness, E depends
    only on the cosine. An environment is blurred once per roughness; the split sum multiplies the blurred light by the
    albedo.

    `--lut ltc` fits linearly transformed cosines to a material, and writes the tables, their error, and shader code for
    area lights. Tables of an anisotropic material also have an azimuth axis, and by default 16 texels along the other
    axes.

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
