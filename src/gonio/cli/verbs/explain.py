"""`gonio explain`."""

from __future__ import annotations

import json
import shutil

from ..options import Json, Model
from .base import MATERIALS, verb


@verb(MATERIALS, place=5)
def explain(model: Model, as_json: Json = False) -> None:
    """Print a material's manual page: formula, parameters, limits, source.

    \b
    Example:
      gonio explain conductor
    """
    from ...catalog import notation
    from ...viewer import manual

    page = manual.page(notation.class_named(model))
    print(json.dumps(page.as_dict()) if as_json else page.text(shutil.get_terminal_size().columns))
