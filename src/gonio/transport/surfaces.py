"""Intersections of rays with surfaces."""

from __future__ import annotations

from types import ModuleType

from ..bridge.faults.ray_offset import Offsets
from ..bridge.types import Hit, Mask, Ray, Scene, SurfaceInteraction
from . import fast
from .fast.inline import Inline
from .fast.placements import MANY, Placements
from .placement import placement_reader


class Surfaces:
    """The surfaces of a scene at construction time.

    inline      traces rays in the kernel, for scenes of a few simple shapes; otherwise Mitsuba does
    placements  computes the surfaces of many shapes, or of those that are traced inline; the others are called
    offsets     how far off the surfaces rays begin and end
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

        Where a ray hits two surfaces at the same distance, the result with `coherent=True` depends on the other rays of
        a packet, which are traced together in a common order. Which paths begin together depends on where a pass ends,
        so the picture would depend on timing. Tracing rays one by one costs about as much.
        """
        if self.inline is not None:
            return self.inline.nearest(ray, active)
        return self.scene.ray_intersect_preliminary(ray, coherent=False, active=active)

    def blocked(self, ray: Ray, active: Mask = True) -> Mask:
        """Whether a ray hits anything."""
        return self.scene.ray_test(ray, active) if self.inline is None else self.inline.blocked(ray, active)

    def interaction(self, hit: Hit, ray: Ray, active: Mask = True) -> SurfaceInteraction:
        """Mitsuba's record of the surface that was hit."""
        if self.placements is not None:
            return self.placements.interaction(hit, ray, active)
        return hit.compute_surface_interaction(ray, self.mi.RayFlags.All, active)
