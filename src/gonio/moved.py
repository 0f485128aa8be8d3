"""Redirect imports of modules that have moved since Gonio 0.1, with a warning that names the new path.

`_MOVED` maps old packages and modules to new ones, and thereby their submodules. The redirects are kept for one more
release; delete this file afterward.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import sys
import warnings
from collections.abc import Sequence
from types import ModuleType

_MOVED = {
    "documents": "catalog.documents",
    "emit": "shaders",
    "energy.compensation.comparison": "materials.compensated.comparison",
    "energy.interior": "materials.layered.interior",
    "energy.materials": "materials.compensated",
    "energy.materials._openpbr_derived": "materials.layered._openpbr_derived",
    "energy.materials._openpbr_formulas": "materials.layered._openpbr_formulas",
    "energy.materials._openpbr_layers": "materials.layered._openpbr_layers",
    "energy.materials._openpbr_sampling": "materials.layered._openpbr_sampling",
    "energy.materials._openpbr_tables": "materials.layered._openpbr_tables",
    "energy.materials.coat": "materials.layered.coat",
    "energy.materials.disney2015": "materials.layered.disney2015",
    "energy.materials.openpbr": "materials.layered.openpbr",
    "measure.fitting": "fitting",
    "measure.materials": "materials.measured",
    "models": "material",
    "models.ashikhmin_shirley": "materials.historic.ashikhmin_shirley",
    "models.base": "material",
    "models.blinn_phong": "materials.empirical.blinn_phong",
    "models.conductor": "materials.microfacet.conductor",
    "models.cook_torrance": "materials.historic.cook_torrance",
    "models.dielectric": "materials.microfacet.dielectric",
    "models.disney": "materials.layered.disney",
    "models.documents": "catalog.documents",
    "models.eon": "materials.diffuse.eon",
    "models.film_conductor": "materials.microfacet.film_conductor",
    "models.film_dielectric": "materials.microfacet.film_dielectric",
    "models.glossy": "materials.historic.glossy",
    "models.he_torrance": "materials.historic.he_torrance",
    "models.lafortune": "materials.historic.lafortune",
    "models.lambert": "materials.diffuse.lambert",
    "models.library": "catalog.library",
    "models.low_microfacet": "materials.historic.low_microfacet",
    "models.low_smooth": "materials.historic.low_smooth",
    "models.material": "material.bsdf",
    "models.metal": "materials.microfacet.metal",
    "models.microfacet": "materials.microfacet.microfacet",
    "models.mirror": "materials.microfacet.mirror",
    "models.mix": "materials.combined.mix",
    "models.modified_phong": "materials.empirical.modified_phong",
    "models.normal_map": "materials.combined.normal_map",
    "models.notation": "catalog.notation",
    "models.opacity": "materials.combined.opacity",
    "models.oren_nayar": "materials.diffuse.oren_nayar",
    "models.outside": "catalog.outside",
    "models.phong": "materials.empirical.phong",
    "models.published": "catalog.published",
    "models.reflector": "materials.microfacet.reflector",
    "models.sheen": "materials.sheen.sheen",
    "models.sheen_charlie": "materials.sheen.sheen_charlie",
    "models.shifted_gamma": "materials.historic.shifted_gamma",
    "models.sum": "materials.combined.sum",
    "models.thin_dielectric": "materials.microfacet.thin_dielectric",
    "models.two_sided": "materials.combined.two_sided",
    "models.ward": "materials.historic.ward",
    "models.ward_duer": "materials.historic.ward_duer",
    "render.adapter": "bridge.adapter",
    "render.answers": "bridge.answers",
    "render.calls": "bridge.calls",
    "render.denoise": "pictures.denoise",
    "render.engine": "bridge.engine",
    "render.exposures": "pictures.exposures",
    "render.foreground": "transport.foreground",
    "render.foreign": "bridge.foreign",
    "render.formats": "pictures.formats",
    "render.gradients": "transport.gradients",
    "render.images": "pictures.images",
    "render.inline": "transport.fast.inline",
    "render.integrators": "transport.integrators",
    "render.lamps": "transport.fast.lamp_table",
    "render.lights": "transport.lights.lights",
    "render.media": "transport.media",
    "render.metrics": "pictures.metrics",
    "render.mitsuba_scene": "scene.mitsuba_scene",
    "render.native": "bridge.native",
    "render.nearby": "transport.fast.light_grid",
    "render.passes": "transport.passes",
    "render.photons": "transport.photons",
    "render.polarizer": "transport.polarizer",
    "render.sampler": "transport.sampler",
    "render.run": "render.finish",
    "render.scene": "scene",
    "render.sky": "transport.lights.sky",
    "render.solid_angles": "transport.lights.solid_angles",
    "render.sources": "transport.lights.sources",
    "render.surfaces": "transport.surfaces",
    "render.types": "bridge.types",
    "render.until": "transport.until",
    "verify.causes": "verify.forensics.causes",
    "verify.child": "verify.isolation.child",
    "verify.crowding": "verify.forensics.crowding",
    "verify.diagnosis": "verify.forensics.diagnosis",
    "verify.factors": "verify.forensics.factors",
    "verify.ratio": "verify.forensics.ratio",
    "verify.reproduction": "verify.forensics.reproduction",
    "verify.watch": "verify.isolation.watch",
    "verify.worker": "verify.isolation.worker",
    "work.crew": "work.executor",
}


def new_name(name: str) -> str:
    """The current name of a module of Gonio 0.1; "" if the module has not moved."""
    head, _, tail = name.removeprefix("gonio.").rpartition(".")
    if name.removeprefix("gonio.") in _MOVED:
        return "gonio." + _MOVED[name.removeprefix("gonio.")]
    parent = new_name("gonio." + head) if head else ""
    return f"{parent}.{tail}" if parent else ""


class _Finder:
    """Finds moved modules. It is the last finder, so Python calls it only for names that no other finder has found.

    It does not derive from the base classes in `importlib.abc`, because importing these would take a sixth of the time
    that importing Gonio takes.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if not name.startswith("gonio.") or not new_name(name):
            return None
        return importlib.machinery.ModuleSpec(name, self, is_package=True)  # type: ignore[arg-type]

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType:
        """The module at its new path, registered under both names."""
        new = new_name(spec.name)
        warnings.warn(f"{spec.name} is now {new}", DeprecationWarning, stacklevel=2)
        module = _Alias(spec.name)
        module.__dict__["_new"] = importlib.import_module(new)
        return module

    def exec_module(self, module: ModuleType) -> None:
        pass


class _Alias(ModuleType):
    """A module of Gonio 0.1 that forwards every attribute access to its replacement."""

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.__dict__["_new"], name)


def install() -> None:
    """Append the finder to Python's import system."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
