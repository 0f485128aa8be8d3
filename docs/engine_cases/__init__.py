"""The measurements of `make_engine_cards.py`: one file per engine, which defines `ENGINE`, and shared code."""

from __future__ import annotations

import importlib
import pkgutil

from .base import Engine


def engines() -> dict[str, Engine]:
    """All engines, keyed by package."""
    names = sorted(one.name for one in pkgutil.iter_modules(__path__))
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return {one.ENGINE.package: one.ENGINE for one in modules if hasattr(one, "ENGINE")}
