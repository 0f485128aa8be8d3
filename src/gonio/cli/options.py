"""Options and arguments that several verbs take, declared once: one by one, or as a dataclass of those that belong
together, whose fields a verb gets as one parameter."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from . import completion

if TYPE_CHECKING:
    from ..models import BSDF
    from ..render.run import Request

Model = Annotated[
    str,
    Argument(metavar="MODEL", help="A material's name; see `gonio models`.", autocompletion=completion.materials),
]
Parameters = Annotated[list[str] | None, Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")]
SceneFile = Annotated[Path, Argument(metavar="SCENE", help="A scene's folder or .json; or a Mitsuba .xml.")]
Json = Annotated[bool, Option("--json", help="Print the result as JSON.")]
Outside = Annotated[bool, Option("--allow-outside", help="Let the scene read files outside its folder.")]
Code = Annotated[bool, Option("--allow-code", help="Let the scene run Python files that it names as materials.")]
Device = Annotated[str, Option(metavar="cpu|cuda|auto", help="Where to compute.")]
Exposure = Annotated[str, Option(metavar="EV|auto", help="Stops of brightness, for .png.")]


@dataclass(frozen=True)
class Material:
    """How a material that is named on the command line is set up."""

    param: Parameters = None
    preset: Annotated[
        str,
        Option(metavar="NAME", help="A named preset, such as Au for conductor.", autocompletion=completion.presets),
    ] = ""

    def text(self, model: str) -> str:
        """The material as one text, such as "conductor(preset=Au,alpha=.3)"."""
        from ..models import notation

        settings = [f"preset={self.preset}"] if self.preset else []
        settings += ["=".join(notation.assignment(text)) for text in self.param or ()]
        if not settings:
            return model
        before, inside = (model[:-1], not model.endswith("()")) if model.endswith(")") else (f"{model}(", False)
        return f"{before}{',' if inside else ''}{','.join(settings)})"

    def of(self, model: str) -> BSDF:
        """The material. Raises InputError for what is unknown or out of range."""
        from ..models import notation

        return notation.named(self.text(model))[0]


@dataclass(frozen=True)
class Rendering:
    """How a scene is rendered; None means: as the scene says."""

    spp: Annotated[int | None, Option(metavar="N", help="Samples per pixel.")] = None
    size: Annotated[str | None, Option(metavar="WxH", help="Film size in pixels, such as 640x480.")] = None
    integrator: Annotated[str | None, Option(metavar="NAME", help="direct, path, whitted, normal, ...")] = None
    max_depth: Annotated[int | None, Option(metavar="N", help="Longest path, for the integrator path.")] = None
    sampler: Annotated[str | None, Option(metavar="NAME", help="Where random numbers come from.")] = None
    seed: Annotated[int | None, Option(metavar="N", help="Same seed, same picture, to the bit.")] = None
    device: Device = "cpu"
    threads: Annotated[int | None, Option(metavar="N", help="CPU cores to use; all if not given.")] = None
    denoise: Annotated[bool, Option("--denoise", help="Remove noise with Open Image Denoise.")] = False
    exposure: Exposure = "0"
    allow_outside: Outside = False
    allow_code: Code = False

    def request(self, scene: Path, output: Path | None = None, timeout: float | None = None) -> Request:
        """The request to render a scene. Raises InputError for a size or an exposure that is none."""
        from ..render import exposures, run

        return run.Request(
            scene,
            output,
            timeout=timeout,
            **vars(self)
            | {
                "size": None if self.size is None else run.parse_size(self.size),
                "exposure": exposures.parse(self.exposure),
            },
        )
