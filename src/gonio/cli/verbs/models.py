"""The command `gonio models`."""

from __future__ import annotations

import json
from typing import Annotated

from typer import Option

from ..options import Json
from ..output import listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=4)
def models(
    quality: Annotated[
        bool, Option("--quality", help="Print the sampling quality of each material with default parameters.")
    ] = False,
    library: Annotated[
        bool, Option("--library", help="List the named materials, with the published fits of each.")
    ] = False,
    as_json: Json = False,
) -> None:
    """List the materials.

    \b
    Examples:
      gonio models
      gonio models --quality
      gonio models --library
    """
    from ...material import models

    if library:
        _library(as_json)
        return

    if quality:
        _qualities(as_json)
        return
    rows = {
        name: ((cls.__doc__ or "").strip().partition("\n")[0], list(cls.parameters())) for name, cls in models().items()
    }
    if as_json:
        print(json.dumps({name: {"doc": doc, "parameters": parameters} for name, (doc, parameters) in rows.items()}))
        return
    table = listing("material", "description", "parameters")
    for name, (doc, parameters) in rows.items():
        table.add_row(name, doc, ", ".join(parameters))
    print_rich(table)


def _library(as_json: bool) -> None:
    from ...catalog import library

    published = library.published()
    rows = {name: library.fits(name) for name in library.materials()}
    if as_json:
        fits = {name: {"model": fit.model, "source": fit.source} for name, fit in published.items()}
        print(json.dumps({"materials": rows, "fits": fits}))
        return
    table = listing("fit", "model", "source", "materials")
    for name, fit in published.items():
        table.add_row(name, fit.model, fit.source, str(len(fit.materials)))
    print_rich(table)
    table = listing("material", "fits (default first)")
    for name, fits_of in rows.items():
        left = sorted({fit.split("/")[0] for fit in published if fit not in fits_of})
        table.add_row(name, f"all except those of {', '.join(left)}" if left else "all")
    print_rich(table)


def _qualities(as_json: bool) -> None:
    from ...verify import quality

    qualities = quality.of_models()
    if as_json:
        print(json.dumps({name: one and {"of": title, **one.as_dict()} for name, (title, one) in qualities.items()}))
        return
    heads = ("failed samples", "variance of the weight", "relative to cosine sampling", "of the ideal")
    table = listing("material", "tested as", *heads)
    for name, (title, one) in qualities.items():
        table.add_row(name, title, *(text or "-" for text in (one.numbers if one else ("no light",) * 4)))
    print_rich(table)
