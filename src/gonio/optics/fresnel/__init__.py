"""Fresnel reflectance. Each Fresnel kind, exact or approximate, is one file in this folder."""

from __future__ import annotations

from .base import Fresnel, average, cos_transmitted, kind, r0_conductor, r0_dielectric
from .waves import Interface, brewster_angle, fresnel

__all__ = [
    "Fresnel", "Interface", "average", "brewster_angle", "cos_transmitted", "fresnel", "kind",
    "r0_conductor", "r0_dielectric",
]  # fmt: skip
