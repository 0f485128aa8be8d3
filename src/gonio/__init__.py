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
from typing import TYPE_CHECKING

from . import llvm
from ._version import __version__ as __version__
from .errors import MachineError

# Before Dr.Jit looks for one. Where there is none, whoever computes on the CPU says so; a GPU does without.
with contextlib.suppress(MachineError):
    llvm.use()

_PLACES = {
    "errors": ("GonioError", "GonioWarning", "InputError", "MachineError"),
    "members": ("register",),
    "ops": ("Direction", "Mask", "Mode", "Pair", "Scalar", "Spectrum", "get_precision", "set_precision"),
    "optics.indices": ("indices", "refractive_index"),
    "optics.ndf": ("NDF", "Stretched"),
    "optics.masking": ("Masking",),
    "optics.fresnel": ("Fresnel", "Interface", "fresnel"),
    # what a material of one's own is written with
    "models": (
        *("Angle", "BSDF", "Breach", "Colour", "Index", "Number", "Parameter", "Preset", "Sample", "Width"),
        *("angle", "bsdf", "choice", "file", "flag", "index", "method", "model", "never", "number", "spectrum"),
        "width",
    ),
    "models.library": ("fits", "materials"),
    "models.notation": ("material",),
    "measure.compression.compress": ("compress",),
    "measure.fitting.fit": ("fit",),
    "energy": ("Albedo", "albedo"),
    "instruments.capture.run": ("capture",),
    "render": ("resume",),
    "render.integrators": ("Integrator",),
    "verify.laws": ("Law",),
    "render.tables": ("bake",),
    "viewer.error_map": ("compare",),
    "viewer.panels": ("Panel",),
    "viewer.plots": ("plot",),
    "viewer.contact_sheet": ("study",),
    "viewer.widget": ("view",),
    "work.cluster": ("Cluster",),
}
_FLAT = {name: place for place, names in _PLACES.items() for name in names}
_CALLABLE = (
    "emit",
    "measure",
    "models",
    "render",
    "verify",
)  # packages that can be called: go.models()
_ALIASES = {"cluster": "Cluster", "mix": "Mix", "two_sided": "TwoSided"}

if TYPE_CHECKING:
    from . import ops
    from .emit import emit
    from .energy.albedo import Albedo, albedo
    from .energy.materials.fdez_aguera import FdezAguera
    from .energy.materials.kulla_conty import KullaConty
    from .energy.materials.openpbr import OpenPBR
    from .energy.materials.random_walk import RandomWalk
    from .energy.materials.turquin import Turquin
    from .errors import GonioError, GonioWarning, InputError
    from .instruments.capture.run import capture
    from .instruments.goniometer.run import measure
    from .measure.compression.compress import compress
    from .measure.fitting.fit import fit
    from .measure.materials.measured import Measured
    from .members import register
    from .models import BSDF, Breach, Parameter, Preset, Sample, method, model, models, never
    from .models.blinn_phong import BlinnPhong
    from .models.conductor import Conductor
    from .models.dielectric import Dielectric
    from .models.film_conductor import FilmConductor
    from .models.film_dielectric import FilmDielectric
    from .models.lambert import Lambert
    from .models.library import fits, materials
    from .models.metal import Metal
    from .models.mirror import Mirror
    from .models.mix import Mix
    from .models.mix import Mix as mix
    from .models.notation import material
    from .models.oren_nayar import OrenNayar
    from .models.parameters import (
        Angle,
        Colour,
        Index,
        Number,
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
    from .models.phong import Phong
    from .models.thin_dielectric import ThinDielectric
    from .models.two_sided import TwoSided
    from .models.two_sided import TwoSided as two_sided
    from .ops import Direction, Mask, Mode, Pair, Scalar, Spectrum, get_precision, set_precision
    from .optics.fresnel import Fresnel, Interface, fresnel
    from .optics.indices import indices, refractive_index
    from .optics.masking import Masking
    from .optics.ndf import NDF, Stretched
    from .render import render, resume
    from .render.integrators import Integrator
    from .render.tables import bake
    from .verify import verify
    from .verify.laws import Law
    from .viewer.contact_sheet import study
    from .viewer.error_map import compare
    from .viewer.panels import Panel
    from .viewer.plots import plot
    from .viewer.widget import view
    from .work.cluster import Cluster
    from .work.cluster import Cluster as cluster


if not TYPE_CHECKING:  # or every misspelt name would be one that a checker believes in

    def __getattr__(name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in _CALLABLE or name == "ops":
            return import_module("." + name, __name__)
        if name in _FLAT:
            return getattr(import_module("." + _FLAT[name], __name__), name)
        wanted = _ALIASES.get(name, name)
        if wanted in _FLAT:
            return __getattr__(wanted)
        if wanted.islower():  # a submodule on its way in, no material
            raise AttributeError(f"module 'gonio' has no attribute '{name}'")
        for cls in import_module(".models", __name__).models().values():
            if cls.__name__ == wanted:
                return cls
        raise AttributeError(f"module 'gonio' has no attribute '{name}'")


def __dir__() -> list[str]:
    classes = import_module(".models", __name__).models().values()
    return sorted([*globals(), *_FLAT, "ops", *_CALLABLE, *_ALIASES, *(cls.__name__ for cls in classes)])


__all__ = [
    "BSDF", "NDF", "Albedo", "Angle", "BlinnPhong", "Breach", "Cluster", "Colour", "Conductor", "Dielectric",
    "Direction", "FdezAguera", "FilmConductor", "FilmDielectric", "Fresnel", "GonioError", "GonioWarning", "Index",
    "InputError", "Integrator", "Interface", "KullaConty", "Lambert", "Law", "MachineError", "Mask", "Masking",
    "Measured", "Metal", "Mirror", "Mix", "Mode", "Number", "OpenPBR", "OrenNayar", "Pair", "Panel", "Parameter",
    "Phong", "Preset", "RandomWalk", "Sample", "Scalar", "Spectrum", "Stretched", "ThinDielectric", "Turquin",
    "TwoSided", "Width", "albedo", "angle", "bake", "bsdf", "capture", "choice", "cluster", "compare", "compress",
    "emit", "file", "fit", "fits", "flag", "fresnel", "get_precision", "index", "indices", "material", "materials",
    "measure", "method", "mix", "model", "models", "never", "number", "ops", "plot", "refractive_index", "register",
    "render", "resume", "set_precision", "spectrum", "study", "two_sided", "verify", "view", "width",
]  # fmt: skip
