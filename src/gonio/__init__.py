"""Gonio: a laboratory for the scattering of light by materials.

    import gonio as go
    gold = go.Conductor.preset("Au", alpha=0.2)
    value = gold.eval(wo, wi)            # (N, 3) arrays in, (N, 3) out
    sample = gold.sample(wo, u)          # .wi .weight .pdf .delta

Names load when first used; Dr.Jit and Mitsuba load when something is first computed. A libLLVM for them is chosen here,
so that `import drjit` and `import mitsuba` work after this, and before it too.
"""

from __future__ import annotations

import contextlib
from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import llvm
from ._version import __version__ as __version__
from .errors import MachineError

# Before Dr.Jit looks for one. Where there is none, whoever computes on the CPU says so; a GPU does without.
with contextlib.suppress(MachineError):
    llvm.use()

_PLACES = {
    "GonioError": "errors",
    "GonioWarning": "errors",
    "InputError": "errors",
    "MachineError": "errors",
    "get_precision": "ops",
    "set_precision": "ops",
    "BSDF": "models",
    "Sample": "models",
    "model": "models",
    "Albedo": "energy",
    "albedo": "energy",
    "bake": "render.tables",
    "compare": "viewer.error_map",
    "plot": "viewer.plots",
    "study": "viewer.contact_sheet",
    "view": "viewer.widget",
}
_CALLABLE = ("emit", "models", "render", "verify")  # packages that can be called: go.models(), go.render(scene)
_ALIASES = {"mix": "Mix", "two_sided": "TwoSided"}

if TYPE_CHECKING:
    from .emit import emit
    from .energy.albedo import Albedo, albedo
    from .errors import GonioError, GonioWarning, InputError
    from .models import BSDF, Sample, model, models
    from .ops import get_precision, set_precision
    from .render import render
    from .render.tables import bake
    from .verify import verify
    from .viewer.contact_sheet import study
    from .viewer.error_map import compare
    from .viewer.plots import plot
    from .viewer.widget import view


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(name)
    if name in _CALLABLE:
        return import_module("." + name, __name__)
    if name in _PLACES:
        return getattr(import_module("." + _PLACES[name], __name__), name)
    wanted = _ALIASES.get(name, name)
    if wanted.islower():  # a submodule on its way in, no material
        raise AttributeError(f"module 'gonio' has no attribute '{name}'")
    for cls in import_module(".models", __name__).models().values():
        if cls.__name__ == wanted:
            return cls
    raise AttributeError(f"module 'gonio' has no attribute '{name}'")


def __dir__() -> list[str]:
    classes = import_module(".models", __name__).models().values()
    return sorted([*globals(), *_PLACES, *_CALLABLE, *_ALIASES, *(cls.__name__ for cls in classes)])


__all__ = [
    "BSDF",
    "Albedo",
    "GonioError",
    "GonioWarning",
    "InputError",
    "MachineError",
    "Sample",
    "albedo",
    "bake",
    "compare",
    "emit",
    "get_precision",
    "model",
    "models",
    "plot",
    "render",
    "set_precision",
    "study",
    "verify",
    "view",
]
