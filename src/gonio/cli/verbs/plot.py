"""`gonio plot`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Json, Material, Options, output_option
from .base import MATERIALS, verb


class Interface(Options):
    """The interface of `gonio plot fresnel`."""

    eta: Annotated[float | None, Option(metavar="ETA", help="Relative index of fresnel: inside over outside.")] = None
    k: Annotated[float, Option("--k", metavar="K", help="Imaginary part of the index of fresnel.")] = 0.0
    metal: Annotated[str | None, Option(metavar="NAME", help="Metal of fresnel, such as Au.")] = None


@verb(MATERIALS, place=1)
def plot(
    model: Annotated[
        list[str],
        Argument(
            metavar="MODEL...",
            help="Materials; `gonio models` lists them. Or a baked folder, or fresnel.",
            autocompletion=completion.materials,
        ),
    ],
    *,
    made: Material,
    kind: Annotated[str, Option(metavar="lobe|slice|albedo|image", help="What to draw.")] = "lobe",
    angles: Annotated[str | None, Option(metavar="A,B,..", help="Viewing angles, degrees from the normal.")] = None,
    interface: Interface,
    output: Annotated[Path | None, output_option("FILE", "The figure: .png, .pdf, .svg.")] = None,
    as_json: Json = False,
) -> None:
    """Draw materials: their lobes (polar), slices over angle, albedo, or image slices; or the tables in a baked folder;
    or, as `fresnel`, the reflectance of an interface.

    The sampling density of a material is drawn dashed over its values. Several materials share their axes.

    \b
    Examples:
      gonio plot conductor --preset Au --param alpha=0.3
      gonio plot "conductor(preset=Au)" "conductor(preset=Cu)" lambert --kind slice
      gonio plot phong -p p=32 --kind slice -o phong.pdf
      gonio plot dielectric -p alpha=0.2 --kind albedo
      gonio plot gold.binary "conductor(preset=Au,alpha=0.2)" --kind image
      gonio plot ./tables -o tables.png
      gonio plot fresnel --eta 1.5
      gonio plot fresnel --metal Au
    """
    from ...catalog import notation
    from ...viewer import figures, plots

    if len(model) == 1 and plots.is_tables(model[0]):
        made.refuse(model[0])
        interface = Interface()  # of no meaning here
        texts, name = model, f"{Path(model[0]).resolve().stem}-tables"
    elif model == ["fresnel"]:
        texts, name = model, "fresnel"
    else:
        texts = made.texts(model)
        heads = dict.fromkeys(notation.split(text)[0] for text in texts)
        name = f"{'-'.join(map(_file_name, heads))}-{kind}"
    views = None if angles is None else figures.split_values(angles)
    output = output or Path(f"{name}.png")
    drawing = plots.plot(*texts, kind=kind, angles=views, output=output, **vars(interface))
    print(json.dumps({"output": str(drawing.path), "about": drawing.about}) if as_json else drawing.path)


def _file_name(head: str) -> str:
    """A material's name in that of a file: of FILE.py:CLASS the class, behind the file where that differs; of JSON,
    "material"."""
    if head.startswith("{"):
        return "material"
    file, _, name = head.lower().rpartition(".py:")
    stem = Path(file).name
    return Path(name).name.replace(":", "-") if stem in ("", name) else f"{stem}-{name}"
