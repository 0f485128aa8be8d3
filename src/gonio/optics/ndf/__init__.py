"""Distributions of microfacet normals. A new one is one new file in this folder: discovery finds it."""

from __future__ import annotations

import importlib
import pkgutil
from functools import lru_cache

from ...errors import InputError, did_you_mean
from .base import NDF

__all__ = ["NDF", "distribution", "distributions"]


@lru_cache
def distributions() -> dict[str, NDF]:
    """Every distribution by name."""
    found: dict[str, NDF] = {}
    for module in pkgutil.iter_modules(__path__):
        members = vars(importlib.import_module(f"{__name__}.{module.name}"))
        for member in members.values():
            if isinstance(member, type) and issubclass(member, NDF) and member.name:
                found[member.name] = member()
    return found


def distribution(name: str) -> NDF:
    """The distribution of that name; InputError where there is none."""
    known = distributions()
    if name not in known:
        raise InputError(f"unknown microfacet distribution '{name}'", "ndf", did_you_mean(name, list(known)))
    return known[name]
