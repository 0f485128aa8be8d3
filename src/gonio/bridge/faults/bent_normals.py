"""Mitsuba 3.9: `normalmap` and `bumpmap` shade in a perturbed frame, which no method of the BSDF returns.

    bumpy = mi.load_dict({"type": "bumpmap", "texture": {"type": "checkerboard"}, "bsdf": {"type": "diffuse"}})
    [name for name in dir(bumpy) if "frame" in name or "normal" in name]       # []

Veach's correction of the scattering of particles at shading normals (Veach1997, sec. 5.3) requires the cosines in the
shading frame.

Workaround: evaluate these BSDFs in the reverse direction, as radiance, and use a sampled half vector as the normal.
"""

from __future__ import annotations

import re

from ..types import Scene

_BENT = re.compile("NormalMap|BumpMap")


def bends_normals(scene: Scene) -> bool:
    """Whether a BSDF of the scene, or one nested in it, is a `normalmap` or `bumpmap`."""
    return any(_BENT.search(str(shape.bsdf())) for shape in scene.shapes())
