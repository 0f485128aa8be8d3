"""Names for the types of Mitsuba and Dr.Jit.

Both ship type information for single variants only, but this package serves all of them: these names document what a
value is, and check nothing. Values of materials have their own types, in `gonio.ops.types`.
"""

from __future__ import annotations

from typing import Any, TypeAlias

OfVariant: TypeAlias = Any  # of a class that Mitsuba or Dr.Jit has once per variant

# Objects of Mitsuba
Plugin: TypeAlias = OfVariant  # what a dictionary or a file loads to
Scene: TypeAlias = Plugin
Sensor: TypeAlias = Plugin
Shape: TypeAlias = Plugin
Emitter: TypeAlias = Plugin
Texture: TypeAlias = Plugin
BSDFPlugin: TypeAlias = Plugin
Properties: TypeAlias = OfVariant  # of a plugin under construction
BSDFContext: TypeAlias = OfVariant
TraversalCallback: TypeAlias = OfVariant
PluginDict: TypeAlias = dict[str, Any]  # what `mi.load_dict` takes

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
Record: TypeAlias = OfVariant  # one of Gonio's, made for a variant

# Values with one entry per lane, of the variant's types
Float: TypeAlias = OfVariant
UInt: TypeAlias = OfVariant
Whole: TypeAlias = OfVariant  # signed, 64 bits
Mask: TypeAlias = OfVariant
Point: TypeAlias = OfVariant  # of two or three components
Vector: TypeAlias = OfVariant
Color: TypeAlias = OfVariant  # linear RGB
Radiance: TypeAlias = OfVariant  # mi.Spectrum: as many channels as the variant has, a Mueller matrix where polarized
