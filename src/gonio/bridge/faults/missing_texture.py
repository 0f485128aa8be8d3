"""Mitsuba 3.9: `Properties.get_emissive_texture` dereferences a null pointer if the property is missing.

    mi.Properties("x").get_emissive_texture("radiance")    # segmentation fault

Workaround: check first that the property exists.
"""

from __future__ import annotations

from ...errors import InputError
from ..types import Properties, Texture


def emissive_texture(properties: Properties, name: str, location: str) -> Texture:
    """The texture of a property. Raises InputError at `location` if it is missing."""
    if name not in properties:
        raise InputError("missing", location, f"give the {name}: a number, a color or a texture")
    return properties.get_emissive_texture(name)
