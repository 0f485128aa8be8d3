"""Options and arguments that several verbs take, declared once: one by one, or as a dataclass of those that belong
together, whose fields a verb gets as one parameter."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from . import completion

if TYPE_CHECKING:
    from ..catalog import notation, operands
    from ..material import BSDF
    from ..render.request import Request

Model = Annotated[
    str, Argument(metavar="MODEL", help="A material's name; see `gonio models`.", autocompletion=completion.materials)
]
Parameters = Annotated[list[str] | None, Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")]
SceneFile = Annotated[
    str, Argument(metavar="SCENE", help="A scene's folder or .json; a Mitsuba .xml; or a material, shown on a ball.")
]
Json = Annotated[bool, Option("--json", help="Print the result as JSON.")]
Outside = Annotated[bool, Option("--allow-outside", help="Let the scene read files outside its folder.")]
Code = Annotated[bool, Option("--allow-code", help="Let the scene run code that it names: Python files, plugins.")]
Device = Annotated[str, Option(metavar="cpu|cuda|auto", help="Where to compute.")]
Checkpoint = Annotated[
    Path | None, Option(metavar="FILE", help="Keep the sums so far there, and go on from them where it exists.")
]
Exposure = Annotated[str, Option(metavar="EV|auto", help="Stops of brightness, for .png.")]


@dataclass(frozen=True)
class Material:
    """How a material that is named on the command line is set up."""

    param: Parameters = None
    preset: Annotated[
        str, Option(metavar="NAME", help="A named preset, such as Au for conductor.", autocompletion=completion.presets)
    ] = ""

    def texts(self, models: Sequence[str], accepted: Collection[operands.Kind] = ()) -> list[str]:
        """Each material as one text, such as "conductor(preset=Au,alpha=.3)"; several share what they have.

        accepted  the kinds that may stand there; materials alone if not given
        Raises InputError for what is none of these, and for a parameter that none has.
        """
        from ..catalog import notation, operands, texts

        for one in models:
            operands.kind_of(one, accepted or operands.MATERIALS, "MODEL")
        wanted = self._wanted()
        if not wanted:
            return list(models)
        apart = [notation.split(one) for one in models]
        if len(models) == 1:
            return [_text(apart[0][0], dict(map(notation.assignment, wanted)), apart[0][1])]
        given = notation.shared([notation.taken_apart(one) for one in models], wanted)
        return [_text(head, {**of, **texts.assignments(own)}) for (head, own), of in zip(apart, given, strict=True)]

    def text(self, model: str, accepted: Collection[operands.Kind] = ()) -> str:
        return self.texts([model], accepted)[0]

    def _wanted(self) -> list[str]:
        return [*([f"preset={self.preset}"] if self.preset else []), *(self.param or ())]

    def refuse(self, target: str) -> None:
        """Raise InputError for parameters of a material where there is none."""
        from ..errors import InputError

        if self._wanted():
            what = f"parameters of a material given, and '{target}' is none"
            raise InputError(what, "--param", "name a material, such as conductor, or leave the parameters out")

    def instead_of(self, scene: str, allow_code: bool = False) -> notation.Settings | None:
        """The material that is named where a scene may stand, "ward.py:Ward" or "conductor(preset=Au)"; None where it
        is a scene. Raises InputError for parameters without a material."""
        from ..catalog import notation, operands

        if operands.kind_of(scene, {operands.Kind.SCENE, *operands.MATERIALS}, "SCENE") in operands.MATERIALS:
            cls, own = notation.taken_apart(scene, allow_code=allow_code)
            return cls, {**own, **dict(map(notation.assignment, self._wanted()))}
        self.refuse(scene)
        return None


def _text(head: str, settings: Mapping[str, str], own: str = "") -> str:
    given = ",".join(filter(None, [own, *map("=".join, settings.items())]))
    return head + (f"({given})" if given else "")


@dataclass(frozen=True)
class Crew:
    """Who does the work: this process, more of them, or a cluster."""

    workers: Annotated[int | None, Option(metavar="N", help="Work with N processes of this machine.")] = None
    cluster: Annotated[str | None, Option(metavar="ADDRESS", help="Work on a Dask cluster: tcp://host:8786.")] = None

    def working(self) -> AbstractContextManager[object]:
        """Inside, they do it."""
        if self.workers is None and self.cluster is None:
            return nullcontext()
        from ..work.cluster import Cluster

        return Cluster(self.cluster, workers=self.workers)


@dataclass(frozen=True)
class Rendering:
    """How a scene is rendered; None means: as the scene says."""

    spp: Annotated[int | None, Option(metavar="N", help="Samples per pixel.")] = None
    size: Annotated[str | None, Option(metavar="WxH", help="Film size in pixels, such as 640x480.")] = None
    integrator: Annotated[str | None, Option(metavar="NAME", help="direct, path, caustics, light, normal, ...")] = None
    max_depth: Annotated[int | None, Option(metavar="N", help="Longest path, for path, caustics and light.")] = None
    sampler: Annotated[str | None, Option(metavar="NAME", help="Where random numbers come from.")] = None
    seed: Annotated[int | None, Option(metavar="N", help="Same seed, same picture, to the bit.")] = None
    device: Device = "cpu"
    spectral: Annotated[bool, Option("--spectral", help="Light as wavelengths: glass disperses.")] = False
    threads: Annotated[int | None, Option(metavar="N", help="CPU cores to use; all if not given.")] = None
    denoise: Annotated[bool, Option("--denoise", help="Remove noise with Open Image Denoise.")] = False
    exposure: Exposure = "0"
    allow_outside: Outside = False
    allow_code: Code = False

    def request(
        self,
        scene: str,
        output: Path | None = None,
        timeout: float | None = None,
        material: BSDF | None = None,
        checkpoint: Path | None = None,
    ) -> Request:
        """The request to render a scene, or a material on a ball. Raises InputError for a size or an exposure that is
        none."""
        from ..pictures import exposures
        from ..render.request import Request, parse_size

        return Request(
            Path(material.name if material else scene),
            output,
            timeout=timeout,
            **vars(self)
            | {
                "size": None if self.size is None else parse_size(self.size),
                "exposure": exposures.parse(self.exposure),
                "material": material,
                "checkpoint": checkpoint,
            },
        )
