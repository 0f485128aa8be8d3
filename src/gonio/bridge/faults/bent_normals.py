"""Mitsuba 3.9: `normalmap` and `bumpmap` shade with a frame of their own that no call of a BSDF tells.

    bumpy = mi.load_dict({"type": "bumpmap", ...})
    si.bsdf(ray), si.sh_frame                              # the plugin, and the frame of the surface, not of the plugin

The correction of particles at shading normals (Veach1997, sec. 5.3) needs the cosines of the frame that shades.

Workaround: evaluate such BSDFs from the other side, as radiance, and take a sampled half vector for the normal.
"""

from __future__ import annotations

import re

from ..types import Scene

_BENT = re.compile("NormalMap|BumpMap")


def bends_normals(scene: Scene) -> bool:
    """Whether a BSDF of the scene, here or further in, is one of those two plugins."""
    return any(_BENT.search(str(shape.bsdf())) for shape in scene.shapes())
