"""The protocol of a material, `BSDF`: its parameters, and how its formulas are bound, called and recorded.

The materials themselves are in `gonio.materials`, one file each.
"""

from __future__ import annotations

import warnings

from ..errors import InputError, did_you_mean
from .bsdf import BSDF, KnownViolation, Limit, Microsurface, Preset
from .calling import method
from .parameters import (
    Angle,
    Colour,
    Index,
    Member,
    Number,
    Parameter,
    Width,
    angle,
    bsdf,
    choice,
    file,
    flag,
    index,
    number,
    spectrum,
    width,
)
from .sample import Sample, never

__all__ = [
    "BSDF",
    "Angle",
    "Colour",
    "Index",
    "KnownViolation",
    "Limit",
    "Member",
    "Microsurface",
    "Number",
    "Parameter",
    "Preset",
    "Sample",
    "Width",
    "angle",
    "bsdf",
    "choice",
    "file",
    "flag",
    "index",
    "method",
    "model",
    "models",
    "never",
    "number",
    "spectrum",
    "width",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name == "Breach":  # its name in Gonio 0.1; delete after one release
        warnings.warn("Breach is now KnownViolation", DeprecationWarning, stacklevel=2)
        return KnownViolation
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def models() -> dict[str, type[BSDF]]:
    """Every material class by name, in alphabetical order."""
    return BSDF.family.all()


def is_model(name: str) -> bool:
    """Whether a material class with this name exists. Underscores, hyphens and case are ignored."""
    return bool(_key(name))


def model(name: str) -> type[BSDF]:
    """The material class of this name, ignoring underscores, hyphens and case. Raises InputError if there is none."""
    key = _key(name)
    if not key:
        raise InputError(f"unknown material '{name}'", "model", did_you_mean(_plain(name), list(models())))
    return models()[key]


def _key(name: str) -> str:
    """The name under which a class is registered; "" if it is not registered."""
    known = models()
    by_class = {cls.__name__.lower(): key for key, cls in known.items()}
    return _plain(name) if _plain(name) in known else by_class.get(name.lower(), "")


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")
