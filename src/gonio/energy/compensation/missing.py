"""The energy lost by a base, and the check of whether a base can be compensated."""

from __future__ import annotations

from ...errors import InputError
from ...material import BSDF
from .glass import glass
from .lobe import MissingEnergy
from .measured import measured
from .reflecting import reflecting


def missing_energy(base: BSDF, average: str = "exact") -> MissingEnergy:
    """The energy lost by single scattering in a bound base.

    average  "exact" or the name of a fit, as in `BSDF.mean_reflectance`
    """
    surface = base.microsurface
    if surface is None:
        return measured(base)
    return glass(base, surface) if surface.transmits else reflecting(base, surface, average)


def check_base(base: BSDF, location: str, transmitting: bool, any_base: bool = False) -> None:
    """Raise InputError if a base cannot be compensated.

    location      the location of the base, for errors
    transmitting  whether a microsurface may transmit
    any_base      whether any base whose reflection lobes are finite is accepted, not only a microsurface
    """
    name = type(base).__name__
    if base.microsurface is not None:
        if base.transmits and not transmitting:
            hint = "Dielectric(transmission=False), or KullaConty, which splits the energy between both sides"
            raise InputError(f"{name} transmits, a material that only reflects expected", location, hint)
        return
    hint = "compensate a conductor or a dielectric first, then mix it or make it two-sided"
    if not any_base or not base.name or base.two_sided:
        expected = "a Gonio material seen from one side" if any_base else "Conductor or Dielectric"
        raise InputError(f"{name or 'a foreign BSDF'} given, {expected} expected", location, hint)
    if base.transmits:
        raise InputError(f"{name} transmits, a material that only reflects expected", location, hint)
    if base.delta != "never" or base.stochastic:
        why = "has a perfectly specular part" if base.delta != "never" else "is random"
        raise InputError(f"{name} {why}, a material with a finite lobe expected", location, hint)
    if base.needs_uniform:  # nested measurements would take minutes
        what = f"{name} contains a base whose energy is measured; measurements cannot be nested"
        raise InputError(what, location, hint)
    if not base.isotropic:
        raise InputError(f"{name} is anisotropic, an isotropic material expected", location, hint)
