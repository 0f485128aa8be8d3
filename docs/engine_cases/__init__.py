"""What `make_engine_cards.py` measures of each engine, one file each."""

from __future__ import annotations

import importlib
import pkgutil

from .base import Engine


def engines() -> dict[str, Engine]:
    """All engines by package."""
    names = sorted(one.name for one in pkgutil.iter_modules(__path__) if one.name != "base")
    every = [importlib.import_module(f"{__name__}.{name}").ENGINE for name in names]
    return {one.package: one for one in every}
