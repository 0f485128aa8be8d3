"""Where the energy goes: directional albedo, the tables E and E_avg, and materials that keep what they receive.

Everything here stands on top of any base material; scenes are unknown in this room.
"""

from .albedo.directional import Albedo, albedo

__all__ = ["Albedo", "albedo"]
