"""The command `gonio plot`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Json, Material, Options, output_option
from .base import MATERIALS, verb


class Interface(Options):
    """The interface whose reflectance `gonio plot fresnel` plots."""

    eta: Annotated[
        float | None, Option(metavar="ETA", help="Relative index of refraction, inside / outside; only for fresnel.")
    ] = None
    k: Annotated[
        float, Option("--k", metavar="K", help="Imaginary part of the relative index of refraction; only for fresnel.")
    ] = 0.0
    metal: Annotated[str | None, Option(metavar="NAME", help="Metal, such as Au; only for fresnel.")] = None


@verb(MATERIALS, place=1)
def plot(
    model: Annotated[
        list[str],
        Argument(
            metavar="MODEL...",
            help="Materials (listed by `gonio models`), a folder of baked tables, or fresnel.",
            autocompletion=completion.materials,
        ),
    ],
    *,
    made: Material,
    kind: Annotated[str, Option(metavar="lobe|slice|albedo|image", help="Kind of plot.")] = "lobe",
    angles: Annotated[
        str | None, Option(metavar="A,B,..", help="Viewing angles in degrees from the normal, such as 0,45.")
    ] = None,
    interface: Interface,
    output: Annotated[Path | None, output_option("FILE", "File for the figure: .png, .pdf or .svg.")] = None,
    as_json: Json = False,
) -> None:
    """Plot materials (as lobes, slices, albedos or image slices), a folder of baked tables, or a Fresnel reflectance.

    Lobes are polar plots; slices show f as a function of angle. A dashed line shows the sampling density of a material.
    Several materials are plotted on the same axes. The argument fresnel plots the reflectance of an interface.

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
        interface = Interface()  # tables have no interface
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
    """The name of a material for use in a file name: for FILE.py:CLASS, the class, preceded by the file's name if that
    is different; for JSON, "material"."""
    if head.startswith("{"):
        return "material"
    file, _, name = head.lower().rpartition(".py:")
    stem = Path(file).name
    return Path(name).name.replace(":", "-") if stem in ("", name) else f"{stem}-{name}"
