"""What `make_engine_cards.py` measures of each engine: one file each, with `ENGINE`, and what these share."""

from __future__ import annotations

import importlib
import pkgutil

from .base import Engine


def engines() -> dict[str, Engine]:
    """All engines by package."""
    names = sorted(one.name for one in pkgutil.iter_modules(__path__))
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return {one.ENGINE.package: one.ENGINE for one in modules if hasattr(one, "ENGINE")}
