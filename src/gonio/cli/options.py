"""Options and arguments that several verbs take, declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Size = Annotated[str | None, typer.Option(metavar="WxH", help="Film size in pixels, such as 640x480.")]
Spp = Annotated[int | None, typer.Option(metavar="N", help="Samples per pixel.")]
Exposure = Annotated[float, typer.Option(metavar="EV", help="Stops of brightness, for .png.")]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene's folder or .json; or a Mitsuba .xml.")]
Integrator = Annotated[str | None, typer.Option(metavar="NAME", help="direct, path, whitted, normal, ...")]
MaxDepth = Annotated[int | None, typer.Option(metavar="N", help="Longest path, for the integrator path.")]
Sampler = Annotated[str | None, typer.Option(metavar="NAME", help="Where random numbers come from.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Same seed, same picture, to the bit.")]
Device = Annotated[str, typer.Option(metavar="cpu|cuda|auto", help="Where to compute.")]
Threads = Annotated[int | None, typer.Option(metavar="N", help="CPU cores to use; all if not given.")]
Denoise = Annotated[bool, typer.Option("--denoise", help="Remove noise with Open Image Denoise.")]
Outside = Annotated[bool, typer.Option("--allow-outside", help="Let the scene read files outside its folder.")]
