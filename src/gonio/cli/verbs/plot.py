"""`gonio plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from .. import completion
from ..options import Material
from .base import MATERIALS, verb


@verb(MATERIALS, place=1)
def plot(
    model: Annotated[
        list[str],
        Argument(
            metavar="MODEL...",
            help="Materials' names; see `gonio models`. Or a baked folder, or fresnel.",
            autocompletion=completion.materials,
        ),
    ],
    *,
    made: Material,
    kind: Annotated[str, Option(metavar="lobe|slice|albedo|image", help="What to draw.")] = "lobe",
    angles: Annotated[str | None, Option(metavar="A,B,..", help="Directions of view, degrees from the normal.")] = None,
    eta: Annotated[float | None, Option(metavar="ETA", help="Of fresnel: index inside over outside.")] = None,
    k: Annotated[float, Option("--k", metavar="K", help="Of fresnel: imaginary part of the index.")] = 0.0,
    metal: Annotated[str | None, Option(metavar="NAME", help="Of fresnel: a metal, such as Au.")] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help=".png, .pdf, .svg.")] = None,
) -> None:
    """Draw materials: their lobes (polar), slices over angle, albedo, or image slices; or the tables in a baked folder;
    or, as `fresnel`, the reflectance of an interface.

    The density that a material is sampled with is drawn dashed over its values. Several materials share their axes.

    \b
    Examples:
      gonio plot conductor --preset Au --param alpha=.3
      gonio plot "conductor(preset=Au)" "conductor(preset=Cu)" lambert --kind slice
      gonio plot phong -p p=32 --kind slice -o phong.pdf
      gonio plot dielectric -p alpha=.2 --kind albedo
      gonio plot gold.binary "conductor(preset=Au,alpha=.2)" --kind image
      gonio plot ./tables -o tables.png
      gonio plot fresnel --eta 1.5
      gonio plot fresnel --metal Au
    """
    from ...catalog import notation
    from ...viewer import figures, plots

    views = None if angles is None else figures.split_values(angles)
    if len(model) == 1 and plots.is_tables(model[0]):
        made.refuse(model[0])
        output = output or Path(f"{Path(model[0]).resolve().stem}-tables.png")
        print(plots.plot(model[0], output=output).path)
        return
    if model == ["fresnel"]:
        output = output or Path("fresnel.png")
        print(plots.plot("fresnel", eta=eta, k=k, metal=metal, output=output).path)
        return
    texts = made.texts(model)
    heads = dict.fromkeys(notation.split(text)[0] for text in texts)
    output = output or Path(f"{'-'.join(map(_file_name, heads))}-{kind}.png")
    print(plots.plot(*texts, kind=kind, angles=views, eta=eta, k=k, metal=metal, output=output).path)


def _file_name(head: str) -> str:
    """A material's name in that of a file: of FILE.py:CLASS the class, behind the file where that differs; of JSON,
    "material"."""
    if head.startswith("{"):
        return "material"
    file, _, name = head.lower().rpartition(".py:")
    stem = Path(file).name
    return Path(name).name.replace(":", "-") if stem in ("", name) else f"{stem}-{name}"
