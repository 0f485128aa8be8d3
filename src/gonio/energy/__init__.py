"""Energy: directional albedo, tables of E and E_avg, and the compensation of energy lost by single scattering.

All of this code applies to any base material and is independent of scenes.
"""

from .albedo.directional import Albedo, albedo

__all__ = ["Albedo", "albedo"]
