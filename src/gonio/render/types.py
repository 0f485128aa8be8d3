"""What Mitsuba and Dr.Jit hand out, by name.

Both ship types for single variants only, and this room serves all of them: so these names say what a value is, and
check nothing. Values of materials have types of their own, in `gonio.ops.types`.
"""

from __future__ import annotations

from typing import Any, TypeAlias

# Mitsuba's objects
Plugin: TypeAlias = Any  # what a dictionary or a file loads to
Scene: TypeAlias = Plugin
Sensor: TypeAlias = Plugin
Shape: TypeAlias = Plugin
Emitter: TypeAlias = Plugin
Texture: TypeAlias = Plugin
MitsubaBSDF: TypeAlias = Plugin
Properties: TypeAlias = Any  # of a plugin that is being built
BSDFContext: TypeAlias = Any
TraversalCallback: TypeAlias = Any

# Records with an entry for every lane
Ray: TypeAlias = Any
Hit: TypeAlias = Any  # mi.PreliminaryIntersection3f
Interaction: TypeAlias = Any  # mi.Interaction3f
SurfaceInteraction: TypeAlias = Any
PositionSample: TypeAlias = Any
DirectionSample: TypeAlias = Any
BSDFSample: TypeAlias = Any
Record: TypeAlias = Any  # one of our own, made for a variant

# Values with an entry for every lane, of the variant's types
Float: TypeAlias = Any
UInt: TypeAlias = Any
Mask: TypeAlias = Any
Point: TypeAlias = Any  # of two or three components
Vector: TypeAlias = Any
Colour: TypeAlias = Any  # linear RGB
Radiance: TypeAlias = Any  # mi.Spectrum: as many channels as the variant has, a Mueller matrix where it is polarized
