"""`gonio models`."""

from __future__ import annotations

import json

from ..options import Json
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=4)
def models(as_json: Json = False) -> None:
    """List the materials.

    \b
    Example:
      gonio models
    """
    from ...models import models

    rows = {
        name: ((cls.__doc__ or "").strip().partition("\n")[0], list(cls.parameters())) for name, cls in models().items()
    }
    if as_json:
        print(json.dumps({name: {"doc": doc, "parameters": parameters} for name, (doc, parameters) in rows.items()}))
        return
    table = listing("material", "what it is", "parameters")
    for name, (doc, parameters) in rows.items():
        table.add_row(name, doc, ", ".join(parameters))
    print_rich(table)
