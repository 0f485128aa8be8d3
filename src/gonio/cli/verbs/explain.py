"""The command `gonio explain`."""

from __future__ import annotations

import json
import shutil
from typing import Annotated

from typer import Argument

from .. import completion
from ..options import Json, Reading
from .base import MATERIALS, verb


@verb(MATERIALS, place=5)
def explain(
    name: Annotated[
        str,
        Argument(
            metavar="[NAME]",
            help="Material, member of another family (ggx, smith-correlated, path), or family (fresnel).",
            autocompletion=completion.materials_and_distributions,
        ),
    ] = "",
    *,
    how: Reading,
    as_json: Json = False,
) -> None:
    """Print the manual page of a material, or of any member of a family: formula, parameters, limits, source.

    The families are materials, distributions of normals, masking terms, Fresnel terms, integrators, laws and more. If
    NAME is a family, its members are listed; without NAME, the families are listed.

    \b
    Examples:
      gonio explain conductor
      gonio explain ggx
      gonio explain fresnel
      gonio explain
    """
    from ...viewer.explanation import explain

    page = explain(how.shaders([name])[0])
    print(json.dumps(page.as_dict()) if as_json else page.text(shutil.get_terminal_size().columns))
