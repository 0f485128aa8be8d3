"""Intersect rays with surfaces."""

from __future__ import annotations

from types import ModuleType

from ..bridge.faults.ray_offset import Offsets
from ..bridge.types import Hit, Mask, Ray, Scene, SurfaceInteraction
from . import fast
from .fast.inline import Inline
from .fast.placements import MANY, Placements
from .placement import placement_reader


class Surfaces:
    """The surfaces that a scene has when this object is constructed.

    inline      intersects rays in the kernel, for scenes with few simple shapes; None if Mitsuba intersects rays
    placements  computes the surface interactions of many shapes, or of those that are intersected inline, without calls
    offsets     distances from surfaces at which rays begin and end
    """

    def __init__(self, mi: ModuleType, scene: Scene) -> None:
        self.mi, self.scene, self.offsets = mi, scene, Offsets(mi, scene)
        self.inline: Inline | None = None
        self.placements: Placements | None = None
        if fast.enabled():
            self.inline = Inline.of(mi, scene, placement_reader(mi), self.offsets.unit)
            self.placements = Placements.of(mi, scene, MANY if self.inline is None else 1)

    def nearest(self, ray: Ray, active: Mask = True) -> Hit:
        """The first surface that a ray hits.

        Rays are traced one by one, which takes about as long as tracing packets with `coherent=True`. If a ray in a
        packet hits two surfaces at the same distance, the result depends on the other rays of the packet. The rays of a
        packet depend on where a pass ends, so the picture would depend on timing.
        """
        if self.inline is not None:
            return self.inline.nearest(ray, active)
        return self.scene.ray_intersect_preliminary(ray, coherent=False, active=active)

    def blocked(self, ray: Ray, active: Mask = True) -> Mask:
        """Whether a ray hits any surface."""
        return self.scene.ray_test(ray, active) if self.inline is None else self.inline.blocked(ray, active)

    def interaction(self, hit: Hit, ray: Ray, active: Mask = True) -> SurfaceInteraction:
        """Mitsuba's surface interaction for a hit."""
        if self.placements is not None:
            return self.placements.interaction(hit, ray, active)
        return hit.compute_surface_interaction(ray, self.mi.RayFlags.All, active)
