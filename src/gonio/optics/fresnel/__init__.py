"""Fresnel reflectance. A kind, exact or approximate, is one file in this folder: discovery finds it."""

from __future__ import annotations

from .base import Fresnel, average, cos_transmitted, kind, r0_conductor, r0_dielectric

__all__ = ["Fresnel", "average", "cos_transmitted", "kind", "r0_conductor", "r0_dielectric"]
