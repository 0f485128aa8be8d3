"""Media between surfaces: absorption, and the priorities of overlapping media.

Every medium has a priority, and where several media overlap, the one with the highest priority applies (Schmidt2002).
For example, water that extends slightly into the glass around it has no surface inside the glass. A surface is real
only if the media with the highest priority on its two sides differ; light passes straight through all other surfaces.
If priorities are equal, the material that the scene names first has the higher priority.

A path counts how many times it is inside each medium. The counts are stored in one number, with four bits per medium in
the order of priorities, so the highest bit belongs to the medium with the highest priority.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import NamedTuple

import drjit as dr
import numpy as np

from ..bridge.faults.ray_offset import Offsets
from ..bridge.types import BSDFPlugin, Float, Mask, Point, Radiance, Scene, SurfaceInteraction, UInt
from ..errors import InputError
from ..material.bsdf import Interior

MAX_MEDIA = 8  # maximum number of media, with four bits each in a 32-bit number
CROSSINGS = 256  # maximum number of surfaces between the camera and the outside of the scene


class Crossing(NamedTuple):
    """The media at a surface that a path hits.

    here     media of the path before the surface
    beyond   media of the path beyond the surface
    surface  whether the surface is real; otherwise, light passes straight through
    outer    index of refraction of the medium outside the surface
    """

    here: UInt
    beyond: UInt
    surface: Mask
    outer: Float


class Media:
    """The media of a scene.

    known  whether media are tracked along paths, because at least one of them absorbs light or has a priority
    """

    def __init__(self, mi: ModuleType, scene: Scene):
        self.mi, self.scene = mi, scene
        result = list(_interiors(scene))
        plain = [(bsdf, bsdf.placed.model.interior) for bsdf in result]
        self.known = any(np.any(np.asarray(i.absorption) > 0) or np.any(np.asarray(i.priority) != 0) for _, i in plain)
        if not self.known:
            return
        if len(result) > MAX_MEDIA:
            what = f"{len(result)} transparent materials, at most {MAX_MEDIA} expected if one absorbs or has a priority"
            raise InputError(what, "absorption, priority", "give shapes the same material")
        order = sorted(range(len(result)), key=lambda i: (float(np.max(np.asarray(plain[i][1].priority))), -i))
        self.bsdfs = [result[i] for i in order]
        numbers = [int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0]) for bsdf in self.bsdfs]
        place = np.full(max([*numbers, *_pointers(mi, scene)]) + 1, MAX_MEDIA, np.uint32)
        place[numbers] = np.arange(len(numbers))
        self.place = mi.UInt32(place)
        dr.make_opaque(self.place)

    def containing(self, point: Point) -> UInt:
        """The media that contain a point: those that a ray from the point leaves without having entered them."""
        mi, depth, inside = self.mi, [0] * MAX_MEDIA, [0] * MAX_MEDIA
        offsets = Offsets(mi, self.scene)
        ray = mi.Ray3f(point, dr.normalize(mi.Vector3f(0.29, 0.83, 0.47)))
        for _ in range(CROSSINGS):
            si = self.scene.ray_intersect(ray)
            if not dr.any(si.is_valid()):
                break
            number = int(self._number(si.bsdf(ray))[0])
            if number < MAX_MEDIA:
                depth[number] += 1 if si.wi.z[0] > 0.0 else -1
                inside[number] = max(inside[number], -depth[number])
            ray = offsets.ray(si, ray.d)
        packed = sum(min(count, 15) << (4 * number) for number, count in enumerate(inside))
        return dr.opaque(mi.UInt32, packed)

    def crossing(self, si: SurfaceInteraction, bsdf: BSDFPlugin, inside: UInt, active: Mask) -> Crossing:
        """The media on the two sides of a surface that a path hits inside the media `inside`."""
        mi = self.mi
        number = self._number(bsdf, active)
        medium = active & (number < MAX_MEDIA)
        one = mi.UInt32(1) << (4 * dr.minimum(number, MAX_MEDIA - 1))
        entering = si.wi.z > 0.0
        counted = (inside & (15 * one)) != 0  # False if the path began inside, or if the surface is not closed
        others = dr.select(entering | ~counted, inside, inside - one)
        beyond = dr.select(medium, dr.select(entering, inside + one, others), inside)
        surface = ~medium | (others < one)  # all other media have a lower priority
        return Crossing(inside, beyond, surface, self.eta(others, si))

    def eta(self, inside: UInt, si: SurfaceInteraction) -> Float:
        """The index of refraction of the medium with the highest priority; 1 outside all media."""
        value = self.mi.Float(1.0)
        for here, interior in self._each(inside, si):
            value = dr.select(here, interior.eta, value)
        return value

    def absorption(self, inside: UInt, si: SurfaceInteraction) -> Radiance:
        """The absorption coefficient of the medium with the highest priority."""
        value = self.mi.UnpolarizedSpectrum(0.0)
        for here, interior in self._each(inside, si):
            value = dr.select(here, interior.absorption, value)
        return value

    def transmitted(self, inside: UInt, si: SurfaceInteraction, length: Float) -> Radiance:
        """The transmittance of the medium of highest priority over a length, exp(-absorption length) (Beer-Lambert)."""
        loss = self.absorption(inside, si)
        return self.mi.Spectrum(dr.select(loss > 0.0, dr.exp(-loss * length), 1.0))

    def _each(self, inside: UInt, si: SurfaceInteraction) -> Iterator[tuple[Mask, Interior]]:
        """Each medium, and the lanes on which it has the highest priority."""
        for number, bsdf in enumerate(self.bsdfs):
            lowest = 1 << (4 * number)
            here = (inside >= lowest) & ((inside >> (4 * number)) <= 15)
            interior = bsdf.placed.at(si, True, separates=True).interior
            assert interior is not None, "only materials with an interior are listed"
            yield here, interior

    def _number(self, bsdf: BSDFPlugin, active: Mask = True) -> UInt:
        """The index of a surface's material in the order of priorities; MAX_MEDIA if it has no interior."""
        return dr.gather(self.mi.UInt32, self.place, dr.reinterpret_array(self.mi.UInt32, bsdf), active)


def _interiors(scene: Scene) -> Iterator[BSDFPlugin]:
    """Gonio's plugins that have an interior, without duplicates, in the order of the scene."""
    visited: set[int] = set()
    for shape in scene.shapes():
        bsdf = shape.bsdf()
        placed = getattr(bsdf, "placed", None)
        if placed is None or id(bsdf) in visited:
            continue
        visited.add(id(bsdf))
        if placed.model.transmits and placed.model.interior is not None:
            yield bsdf


def _pointers(mi: ModuleType, scene: Scene) -> list[int]:
    """The numbers that represent the materials in kernels."""
    return [int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(shape.bsdf()))[0]) for shape in scene.shapes()]
