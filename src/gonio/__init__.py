"""Gonio: a laboratory for the scattering of light by materials.

    import gonio as go
    gold = go.Conductor.preset("Au", alpha=0.2)
    value = gold.eval(wo, wi)            # (N, 3) arrays in, (N, 3) out
    sample = gold.sample(wo, u)          # .wi .weight .pdf .delta

Names are loaded on first use; Dr.Jit and Mitsuba are loaded by the first computation. Importing Gonio selects a libLLVM
for Dr.Jit; `import drjit` and `import mitsuba` may precede or follow `import gonio`.
"""

from __future__ import annotations

import contextlib
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from . import llvm, moved
from ._version import __version__ as __version__
from .errors import MachineError

# Must run before Dr.Jit searches for a libLLVM. Without LLVM, the first computation on the CPU fails; a GPU does not
# need it.
with contextlib.suppress(MachineError):
    llvm.use()

moved.install()

_PLACES = {
    "errors": ("GonioError", "GonioWarning", "InputError", "MachineError"),
    "members": ("register",),
    "ops": ("Direction", "Mask", "Mode", "Pair", "Scalar", "Spectrum", "get_precision", "set_precision"),
    "optics.indices": ("indices", "refractive_index"),
    "optics.ndf": ("NDF", "Stretched"),
    "optics.masking": ("Masking",),
    "optics.fresnel": ("Fresnel", "Interface", "fresnel"),
    # for user-defined materials
    "material": (
        *(
            "Angle",
            "BSDF",
            "KnownViolation",
            "Limit",
            "Colour",
            "Index",
            "Number",
            "Parameter",
            "Preset",
            "Sample",
            "Width",
        ),
        *("angle", "bsdf", "choice", "file", "flag", "index", "method", "model", "models", "never", "number"),
        *("spectrum", "width"),
    ),
    "catalog.library": ("fits", "materials"),
    "catalog.material": ("material",),
    "catalog.shaders": ("Shader",),
    "measure.compression.compress": ("compress",),
    "fitting.fit": ("fit",),
    "energy": ("Albedo",),
    "viewer.albedos": ("albedo",),
    "instruments.capture.run": ("capture",),
    "instruments.goniometer.run": ("measure",),
    "instruments.pictures": ("fit_picture",),
    "render": ("render", "resume"),
    "render.tables": ("bake",),
    "shaders": ("emit",),
    "transport.integrators": ("Integrator",),
    "verify": ("verify",),
    "verify.laws": ("Law",),
    "check": ("check",),
    "report": ("report",),
    "viewer.error_map": ("compare",),
    "viewer.panels": ("Panel",),
    "viewer.plots": ("plot",),
    "viewer.compensations": ("compensation",),
    "viewer.contact_sheet": ("study",),
    "viewer.conversion": ("convert",),
    "viewer.description": ("info",),
    "viewer.explanation": ("explain",),
    "viewer.widget": ("view",),
    "work.cluster": ("Cluster",),
}
_FLAT = {name: place for place, names in _PLACES.items() for name in names}
_ALIASES = {"cluster": "Cluster", "mix": "Mix", "two_sided": "TwoSided"}

if TYPE_CHECKING:
    from . import ops
    from .catalog import material as _catalog_material
    from .catalog.library import fits, materials
    from .catalog.shaders import Shader
    from .check import check
    from .energy.albedo import Albedo
    from .errors import GonioError, GonioWarning, InputError
    from .fitting.fit import fit
    from .instruments.capture.run import capture
    from .instruments.goniometer.run import measure
    from .instruments.pictures import fit_picture
    from .material import BSDF, KnownViolation, Limit, Parameter, Preset, Sample, method, model, models, never
    from .material.parameters import (
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
    from .materials.combined.mix import Mix
    from .materials.combined.mix import Mix as mix
    from .materials.combined.two_sided import TwoSided
    from .materials.combined.two_sided import TwoSided as two_sided
    from .materials.compensated.fdez_aguera import FdezAguera
    from .materials.compensated.kulla_conty import KullaConty
    from .materials.compensated.random_walk import RandomWalk
    from .materials.compensated.turquin import Turquin
    from .materials.diffuse.lambert import Lambert
    from .materials.diffuse.oren_nayar import OrenNayar
    from .materials.empirical.blinn_phong import BlinnPhong
    from .materials.empirical.phong import Phong
    from .materials.layered.openpbr import OpenPBR
    from .materials.measured.measured import Measured
    from .materials.microfacet.conductor import Conductor
    from .materials.microfacet.dielectric import Dielectric
    from .materials.microfacet.film_conductor import FilmConductor
    from .materials.microfacet.film_dielectric import FilmDielectric
    from .materials.microfacet.metal import Metal
    from .materials.microfacet.mirror import Mirror
    from .materials.microfacet.thin_dielectric import ThinDielectric
    from .measure.compression.compress import compress
    from .members import register
    from .ops import Direction, Mask, Mode, Pair, Scalar, Spectrum, get_precision, set_precision
    from .optics.fresnel import Fresnel, Interface, fresnel
    from .optics.indices import indices, refractive_index
    from .optics.masking import Masking
    from .optics.ndf import NDF, Stretched
    from .render import render, resume
    from .render.tables import bake
    from .report import report
    from .shaders import emit
    from .transport.integrators import Integrator
    from .verify import verify
    from .verify.laws import Law
    from .viewer.albedos import albedo
    from .viewer.compensations import compensation
    from .viewer.contact_sheet import study
    from .viewer.conversion import convert
    from .viewer.description import info
    from .viewer.error_map import compare
    from .viewer.explanation import explain
    from .viewer.panels import Panel
    from .viewer.plots import plot
    from .viewer.widget import view
    from .work.cluster import Cluster
    from .work.cluster import Cluster as cluster

    material = _catalog_material.material  # after `from .material`, which type checkers read as the subpackage


if not TYPE_CHECKING:  # a type checker would accept every misspelt name

    class _Gonio(ModuleType):
        """A module whose public functions are not replaced when a subpackage of the same name is imported."""

        def __setattr__(self, name: str, value: object) -> None:
            if not (name in _FLAT and isinstance(value, ModuleType)):
                super().__setattr__(name, value)

    sys.modules[__name__].__class__ = _Gonio

    def __getattr__(name: str) -> object:
        if name.startswith("_"):
            raise AttributeError(name)
        if name == "ops":
            return import_module(".ops", __name__)
        if name == "Breach":  # its name in Gonio 0.1
            return import_module(".material", __name__).Breach
        if name in _FLAT:
            return getattr(import_module("." + _FLAT[name], __name__), name)
        class_name = _ALIASES.get(name, name)
        if class_name in _FLAT:
            return __getattr__(class_name)
        if class_name.islower():  # a submodule that is being imported, not a material
            module = Path(__file__).with_name(name)
            hint = f": write `import gonio.{name}`" if module.is_dir() or module.with_suffix(".py").is_file() else ""
            raise AttributeError(f"module 'gonio' has no attribute '{name}'{hint}")
        for cls in __getattr__("models")().values():
            if cls.__name__ == class_name:
                return cls
        raise AttributeError(f"module 'gonio' has no attribute '{name}'")


def __dir__() -> list[str]:
    classes = import_module(".material", __name__).models().values()
    return sorted([*globals(), *_FLAT, "ops", *_ALIASES, *(cls.__name__ for cls in classes)])


__all__ = [
    "BSDF",
    "NDF",
    "Albedo",
    "Angle",
    "BlinnPhong",
    "Cluster",
    "Colour",
    "Conductor",
    "Dielectric",
    "Direction",
    "FdezAguera",
    "FilmConductor",
    "FilmDielectric",
    "Fresnel",
    "GonioError",
    "GonioWarning",
    "Index",
    "InputError",
    "Integrator",
    "Interface",
    "KnownViolation",
    "KullaConty",
    "Lambert",
    "Law",
    "Limit",
    "MachineError",
    "Mask",
    "Masking",
    "Measured",
    "Metal",
    "Mirror",
    "Mix",
    "Mode",
    "Number",
    "OpenPBR",
    "OrenNayar",
    "Pair",
    "Panel",
    "Parameter",
    "Phong",
    "Preset",
    "RandomWalk",
    "Sample",
    "Scalar",
    "Shader",
    "Spectrum",
    "Stretched",
    "ThinDielectric",
    "Turquin",
    "TwoSided",
    "Width",
    "albedo",
    "angle",
    "bake",
    "bsdf",
    "capture",
    "check",
    "choice",
    "cluster",
    "compare",
    "compensation",
    "compress",
    "convert",
    "emit",
    "explain",
    "file",
    "fit",
    "fit_picture",
    "fits",
    "flag",
    "fresnel",
    "get_precision",
    "index",
    "indices",
    "info",
    "material",
    "materials",
    "measure",
    "method",
    "mix",
    "model",
    "models",
    "never",
    "number",
    "ops",
    "plot",
    "refractive_index",
    "register",
    "render",
    "report",
    "resume",
    "set_precision",
    "spectrum",
    "study",
    "two_sided",
    "verify",
    "view",
    "width",
]  # fmt: skip
