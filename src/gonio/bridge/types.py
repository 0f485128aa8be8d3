"""Names for the types of Mitsuba and Dr.Jit.

Both libraries provide type information only for single variants, but this package supports all variants. These names
therefore document the type of a value, but type checkers treat them as `Any`. Values of materials have their own types,
in `gonio.ops.types`.
"""

from __future__ import annotations

from typing import Any, TypeAlias

OfVariant: TypeAlias = Any  # an object of a class that exists once per variant

# Objects of Mitsuba
Plugin: TypeAlias = OfVariant  # the result of loading a dictionary or a file
Scene: TypeAlias = Plugin
Sensor: TypeAlias = Plugin
Shape: TypeAlias = Plugin
Emitter: TypeAlias = Plugin
Texture: TypeAlias = Plugin
BSDFPlugin: TypeAlias = Plugin
Properties: TypeAlias = OfVariant  # properties of a plugin under construction
BSDFContext: TypeAlias = OfVariant
TraversalCallback: TypeAlias = OfVariant
PluginDict: TypeAlias = dict[str, Any]  # the argument of `mi.load_dict`

# The contents of a scene file
Json: TypeAlias = "dict[str, Json] | list[Json] | str | int | float | bool | None"

# Records with one entry per lane
Ray: TypeAlias = OfVariant
Hit: TypeAlias = OfVariant  # mi.PreliminaryIntersection3f
Interaction: TypeAlias = OfVariant  # mi.Interaction3f
SurfaceInteraction: TypeAlias = OfVariant
PositionSample: TypeAlias = OfVariant
DirectionSample: TypeAlias = OfVariant
BSDFSample: TypeAlias = OfVariant
Record: TypeAlias = OfVariant  # any other record

# Values with one entry per lane, of the variant's types
Float: TypeAlias = OfVariant
UInt: TypeAlias = OfVariant
Whole: TypeAlias = OfVariant  # signed 64-bit integer
Mask: TypeAlias = OfVariant
Point: TypeAlias = OfVariant  # a point with two or three components
Vector: TypeAlias = OfVariant
Color: TypeAlias = OfVariant  # linear RGB
Radiance: TypeAlias = OfVariant  # mi.Spectrum: the variant's channels, or Mueller matrices in polarized variants
