"""`gonio models`."""

from __future__ import annotations

import json
from typing import Annotated

from typer import Option

from ..options import Json
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=4)
def models(
    quality: Annotated[bool, Option("--quality", help="How well each samples itself, at its defaults.")] = False,
    as_json: Json = False,
) -> None:
    """List the materials.

    \b
    Examples:
      gonio models
      gonio models --quality
    """
    from ...models import models

    if quality:
        _qualities(as_json)
        return
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


def _qualities(as_json: bool) -> None:
    from ...verify import quality

    found = quality.of_models()
    if as_json:
        print(json.dumps({name: one and {"of": title, **one.as_dict()} for name, (title, one) in found.items()}))
        return
    table = listing("material", "judged as", "fails", "variance of the weight", "against cosine", "of the ideal")
    for name, (title, one) in found.items():
        texts = one.texts if one else ("no light",) * 4
        words = (" fail", "variance ", " cosine sampling", " of the ideal")
        table.add_row(name, title, *(text.replace(word, "") or "-" for text, word in zip(texts, words, strict=True)))
    print_rich(table)
