"""Mitsuba 3.9: `Properties.get_emissive_texture` of a property that is not there follows a null pointer.

    mi.Properties("x").get_emissive_texture("radiance")    # segmentation fault

Workaround: ask first whether the property is there.
"""

from __future__ import annotations

from ...errors import InputError
from ..types import Properties, Texture


def emissive_texture(properties: Properties, name: str, location: str) -> Texture:
    """The texture of a property; InputError, which names `location`, where there is none."""
    if name not in properties:
        raise InputError("missing", location, f"give the {name}: a number, a color or a texture")
    return properties.get_emissive_texture(name)
