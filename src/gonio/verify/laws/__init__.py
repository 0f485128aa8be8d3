"""The laws, one file each. A new one is one new file in this folder: discovery finds it."""

from __future__ import annotations

import importlib
import pkgutil
from functools import lru_cache

from .base import Law

__all__ = ["Law", "laws"]


@lru_cache
def laws() -> dict[str, Law]:
    """Every law by name, by number."""
    found: list[Law] = []
    for module in pkgutil.iter_modules(__path__):
        members = vars(importlib.import_module(f"{__name__}.{module.name}"))
        own = [
            m
            for m in members.values()
            if isinstance(m, type) and issubclass(m, Law) and m.__module__.endswith(module.name)
        ]
        found += [member() for member in own if member.name]
    return {law.name: law for law in sorted(found, key=lambda law: law.number)}
