"""What rays meet, and what they find there."""

from __future__ import annotations

from types import ModuleType

from ..bridge.types import Hit, Mask, Ray, Scene, SurfaceInteraction
from . import fast
from .fast.inline import Inline
from .fast.placements import MANY, Placements
from .placement import placement_reader


class Surfaces:
    """The surfaces of a scene as they are when this is made.

    inline      traces rays in the kernel, in scenes of a few simple shapes; else Mitsuba does
    placements  knows the surfaces of many shapes, or of those that are traced inline; the others are asked
    """

    def __init__(self, mi: ModuleType, scene: Scene) -> None:
        self.mi, self.scene = mi, scene
        self.inline: Inline | None = None
        self.placements: Placements | None = None
        if fast.enabled():
            self.inline = Inline.of(mi, scene, placement_reader(mi))
            self.placements = Placements.of(mi, scene, MANY if self.inline is None else 1)

    def nearest(self, ray: Ray, active: Mask = True, coherent: bool = False) -> Hit:
        """The surface that a ray meets first; `coherent` where neighboring rays go the same way."""
        if self.inline is not None:
            return self.inline.nearest(ray, active)
        return self.scene.ray_intersect_preliminary(ray, coherent=coherent, active=active)

    def blocked(self, ray: Ray, active: Mask = True) -> Mask:
        """Whether a ray meets anything."""
        return self.scene.ray_test(ray, active) if self.inline is None else self.inline.blocked(ray, active)

    def interaction(self, hit: Hit, ray: Ray, active: Mask = True) -> SurfaceInteraction:
        """Mitsuba's record of the surface that was met."""
        if self.placements is not None:
            return self.placements.interaction(hit, ray, active)
        return hit.compute_surface_interaction(ray, self.mi.RayFlags.All, active)
