"""`gonio explain`."""

from __future__ import annotations

import json
import shutil
from typing import Annotated

from typer import Argument

from .. import completion
from ..options import Json
from .base import MATERIALS, verb


@verb(MATERIALS, place=5)
def explain(
    model: Annotated[
        str,
        Argument(
            metavar="[NAME]",
            help="A material, any other member of a family (ggx, smith-correlated, path), or a family (fresnel).",
            autocompletion=completion.materials_and_distributions,
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """Print the manual page of a material, or of any member of a family: formula, parameters, limits, source.

    The families are materials, distributions of normals, masking terms, Fresnel kinds, integrators, laws and more: a
    family's own name lists its members, no name the families.

    \b
    Examples:
      gonio explain conductor
      gonio explain ggx
      gonio explain fresnel
      gonio explain
    """
    from ...catalog import notation, operands
    from ...viewer import families, manual

    width = shutil.get_terminal_size().columns
    if not model:
        page = families.index()
        print(json.dumps(page.as_dict()) if as_json else page.text(width))
        return
    found: list[manual.Page | families.MemberPage | families.FamilyPage]
    if operands.is_material(model):
        found = [manual.page(notation.taken_apart(model)[0])]
    else:
        found = [*families.pages(model)]
    if as_json:
        first, *others = (page.as_dict() for page in found)
        print(json.dumps({**first, "also": others} if others else first))
        return
    print("\n\n".join(page.text(width) for page in found))
