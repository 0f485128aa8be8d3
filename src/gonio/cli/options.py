"""Options and arguments shared by several verbs. Each is declared once, individually or in a group that is a single
parameter of a verb."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, dataclass_transform, get_args, get_type_hints

from typer import Argument, Option
from typer.models import OptionInfo

from ..render.options import RenderOptions
from . import completion

if TYPE_CHECKING:
    from ..catalog import notation, operands
    from ..material import BSDF
    from ..render.request import Request


def output_option(metavar: str, text: str) -> OptionInfo:
    """`-o`, the option for the output of a verb: `Annotated[Path, output_option("FILE", "File for the sheet.")]`."""
    return Option("-o", "--output", metavar=metavar, help=text)


def samples_option(text: str) -> OptionInfo:
    """`--samples`, the number of random samples of a quantity other than a pixel."""
    return Option("--samples", metavar="N", help=text)


@cache
def _declared() -> dict[str, object]:
    return get_type_hints(RenderOptions, include_extras=True)


def render_option(name: str) -> OptionInfo:
    """An option of `RenderOptions`, with its help text."""
    kind, shown = get_args(_declared()[name])
    flag = [f"--{name.replace('_', '-')}"] if kind is bool else []
    return Option(*flag, metavar=shown.metavar or None, help=shown.help)


Model = Annotated[
    str, Argument(metavar="MODEL", help="Material, as listed by `gonio models`.", autocompletion=completion.materials)
]
SceneFile = Annotated[
    str,
    Argument(
        metavar="SCENE", help="Scene folder, scene file (.json or Mitsuba .xml), or a material to show on a ball."
    ),
]
Json = Annotated[bool, Option("--json", help="Print the result as JSON.")]
Models = Annotated[
    list[str] | None,
    Option(
        "--model",
        "-m",
        metavar="NAME",
        help='Model to fit, such as "lambert+ggx"; repeatable; several models are ranked.',
    ),
]
Outside = Annotated[bool, render_option("allow_outside")]
Code = Annotated[bool, render_option("allow_code")]
Device = Annotated[str, render_option("device")]
Threads = Annotated[int | None, render_option("threads")]
Seed = Annotated[int | None, render_option("seed")]
Spp = Annotated[int | None, render_option("spp")]
Exposure = Annotated[str, render_option("exposure")]
Timeout = Annotated[
    float | None,
    Option(metavar="S", help="Time limit in seconds, after which the current picture is written."),
]
Checkpoint = Annotated[
    Path | None, Option(metavar="FILE", help="File for intermediate results; if it exists, the render resumes from it.")
]


@dataclass_transform(frozen_default=True, kw_only_default=True)
class Options:
    """Base class of groups of options, which are annotated fields with defaults.

    It is a substitute for a dataclass without generated methods: compiling those of twelve groups took a tenth of the
    time of `gonio --help`.
    """

    def __init__(self, **values: object) -> None:
        vars(self).update(values)


class Trust(Options):
    """Permissions of scene and material files."""

    allow_outside: Outside = False
    allow_code: Code = False


class Reading(Options):
    """Options for reading shaders that are named on the command line."""

    define: Annotated[
        list[str] | None,
        Option(
            "--define",
            "-D",
            metavar="NAME=VALUE",
            help="Value of a macro or override constant of a shader; repeatable.",
        ),
    ] = None
    adapter: Annotated[
        list[str] | None,
        Option(metavar="KEY=VALUE", help="Entry of a shader's adapter, such as function=BRDF; repeatable."),
    ] = None

    def shaders(self, texts: Sequence[str]) -> list[str]:
        """The materials as strings, with `define` and `adapter` added to the names of shaders. Raises InputError if
        these options are given without a shader."""
        from ..catalog import shaders
        from ..errors import InputError

        options = [shaders.option(one, "--adapter") for one in self.adapter or ()]
        options += [shaders.option(one, "-D", "defines.") for one in self.define or ()]
        heads = [shaders.head_in(one) for one in texts]
        if options and not any(heads):
            hint = f"name one, such as my.glsl ({', '.join(shaders.SUFFIXES)})"
            raise InputError("a macro or an adapter's entry given without a shader", "-D, --adapter", hint)
        if not options:
            return list(texts)
        return [
            shaders.with_options(head, options) + one.strip()[len(head) :] if head else one
            for one, head in zip(texts, heads, strict=True)
        ]


class Material(Reading):
    """Parameters and preset of the materials named on the command line."""

    param: Annotated[
        list[str] | None,
        Option("--param", "-p", metavar="NAME=VALUE", help="Value of a parameter, such as alpha=0.3; repeatable."),
    ] = None
    preset: Annotated[
        str,
        Option(
            metavar="NAME",
            help="Named preset of the material, such as Au for conductor.",
            autocompletion=completion.presets,
        ),
    ] = ""

    def texts(self, models: Sequence[str], accepted: Collection[operands.Kind] = ()) -> list[str]:
        """The materials as strings, such as "conductor(preset=Au,alpha=0.3)". Each parameter is set for every material
        that has it.

        accepted  the accepted kinds of operands; if empty, only materials
        Raises InputError for an operand of another kind, and for a parameter that no material has.
        """
        from ..catalog import notation, operands, texts

        for one in models:
            operands.kind_of(one, accepted or operands.MATERIALS, "MODEL")
        models = self.shaders(models)
        settings = self.settings()
        if not settings:
            return list(models)
        models = [texts.as_call(one) for one in models]
        apart = [notation.split(one) for one in models]
        if len(models) == 1:
            return [_text(apart[0][0], dict(map(notation.assignment, settings)), apart[0][1])]
        given = notation.shared([notation.taken_apart(one) for one in models], settings)
        return [_text(head, {**of, **texts.assignments(own)}) for (head, own), of in zip(apart, given, strict=True)]

    def text(self, model: str, accepted: Collection[operands.Kind] = ()) -> str:
        return self.texts([model], accepted)[0]

    def settings(self) -> list[str]:
        """The settings as "NAME=VALUE", the preset first."""
        return [*([f"preset={self.preset}"] if self.preset else []), *(self.param or ())]

    def refuse(self, target: str) -> None:
        """Raise InputError if parameters are given without a material."""
        from ..errors import InputError

        self.shaders(())
        if self.settings():
            what = f"parameters of a material given, but '{target}' is not one"
            raise InputError(what, "--param", "name a material, such as conductor, or leave the parameters out")

    def instead_of(self, scene: str, allow_code: bool = False) -> notation.Settings | None:
        """The material given in place of a scene, such as "ward.py:Ward" or "conductor(preset=Au)"; None if a scene is
        given. Raises InputError for parameters without a material."""
        from ..catalog import notation, operands

        if operands.kind_of(scene, {operands.Kind.SCENE, *operands.MATERIALS}, "SCENE") in operands.MATERIALS:
            cls, own = notation.taken_apart(self.shaders([scene])[0], allow_code=allow_code)
            return cls, {**own, **dict(map(notation.assignment, self.settings()))}
        self.refuse(scene)
        return None


def _text(head: str, settings: Mapping[str, str], own: str = "") -> str:
    given = ",".join(filter(None, [own, *map("=".join, settings.items())]))
    return head + (f"({given})" if given else "")


class Fitting(Material):
    """Options that determine which parameters of a model are fitted: `param` and `preset` fix parameters, and `free`
    selects additional parameters to fit."""

    free: Annotated[
        list[str] | None,
        Option(metavar="NAME", help="Additional parameter to fit, such as a scale factor of 1; repeatable."),
    ] = None
    grazing: Annotated[
        float, Option(metavar="DEG", help="Largest angle from the normal, in degrees; values beyond it are ignored.")
    ] = 80.0

    def fixed(self) -> dict[str, str]:
        """The fixed parameters by path, as strings."""
        from ..catalog import notation

        return dict(map(notation.assignment, self.param or ()))

    def models(self, names: Sequence[str]) -> list[str]:
        """The models as strings, with the preset if one is given. Raises InputError for a preset of a sum."""
        names = self.shaders(names)
        if not self.preset:
            return list(names)
        from ..errors import InputError

        for name in names:
            if "+" in name:
                hint = f"name it in a part: -m 'lambert+conductor(preset={self.preset})'"
                raise InputError(f"preset '{self.preset}' given, but '{name}' is a sum of materials", "--preset", hint)
        if not names:
            raise InputError(f"preset '{self.preset}' given without a model", "--preset", "name a model with -m")
        return Material(preset=self.preset).texts(names)


class Executor(Options):
    """Options that determine where the parts of a job are computed: in this process, in several processes on this
    machine, or on a cluster."""

    workers: Annotated[int | None, Option(metavar="N", help="Number of worker processes on this machine.")] = None
    cluster: Annotated[
        str | None, Option(metavar="ADDRESS", help="Address of the Dask cluster to use, such as tcp://host:8786.")
    ] = None

    def running(self) -> AbstractContextManager[object]:
        """A context manager; within its `with` block, the parts of a job are computed by the selected processes."""
        if self.workers is None and self.cluster is None:
            return nullcontext()
        from ..work.cluster import Cluster

        return Cluster(self.cluster, workers=self.workers)


class Rendering(RenderOptions, Options):
    """The options of a render on the command line, where size and exposure are strings; `request` converts them."""

    def request(
        self,
        scene: str,
        output: Path | None = None,
        timeout: float | None = None,
        material: BSDF | None = None,
        checkpoint: Path | None = None,
    ) -> Request:
        """The request to render a scene, or a material on a ball. Raises InputError for an invalid size or exposure."""
        from ..pictures import exposures
        from ..render.request import Request, parse_size

        return Request(
            Path(material.name if material else scene),
            output,
            timeout=timeout,
            **vars(self)
            | {
                "size": None if self.size is None else parse_size(str(self.size)),
                "exposure": exposures.parse(str(self.exposure)),
                "material": material,
                "checkpoint": checkpoint,
            },
        )


# size and exposure are parsed by `request`, whose error messages are more specific than those of Typer
_TEXTS: dict[str, object] = {"size": str | None, "exposure": str}
Rendering.__annotations__ = {
    field.name: Annotated[_TEXTS.get(field.name, get_args(_declared()[field.name])[0]), render_option(field.name)]
    for field in fields(RenderOptions)
}
