"""The materials, one file each. A new one is one new file in this folder: discovery finds it.

Materials that stand on a later room (compensation on `energy`) live in that room's folder `materials`, and are found
there.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import lru_cache
from pathlib import Path

from .._callable import make_callable
from ..errors import InputError, did_you_mean
from .base import BSDF, Parameter, Sample

__all__ = ["BSDF", "Parameter", "Sample", "model", "models"]


@lru_cache
def models() -> dict[str, type[BSDF]]:
    """Every material class by name, in alphabetical order."""
    found: dict[str, type[BSDF]] = {}
    package = Path(__path__[0]).parent
    rooms = [Path(__path__[0]), *sorted(package.glob("*/materials"))]
    for room in rooms:
        name = ".".join([package.name, *room.relative_to(package).parts])
        for module in pkgutil.iter_modules([str(room)]):
            members = vars(importlib.import_module(f"{name}.{module.name}"))
            for member in members.values():
                if isinstance(member, type) and issubclass(member, BSDF) and member.name:
                    found[member.name] = member
    return dict(sorted(found.items()))


def model(name: str) -> type[BSDF]:
    """The class of that name; underscores, hyphens and case do not matter. InputError where there is none."""
    known = models()
    wanted = name.lower().replace("_", "-")
    by_class = {cls.__name__.lower(): key for key, cls in known.items()}
    key = wanted if wanted in known else by_class.get(name.lower(), "")
    if not key:
        raise InputError(f"unknown material '{name}'", "model", did_you_mean(wanted, list(known)))
    return known[key]


make_callable(__name__, models)
