"""Surfaces of hemispheres on a plane."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ...errors import InputError
from .base import Floats, Patch, Surface, parameter

SIDE = 16.0  # side length of the period, in radii
SPLITS = 4  # subdivisions of the icosahedron, each of which splits a triangle into four
TRIES = 200_000


@dataclass(frozen=True)
class Spheres(Surface):
    """Hemispheres of equal size, distributed randomly on a plane without overlap, like beads half embedded in a binder.

    Each sphere is a subdivided icosahedron with a random rotation, so the spheres together have normals in all
    directions.
    """

    name: ClassVar[str] = "spheres"
    random: ClassVar[bool] = True

    coverage: float = parameter(0.4, "fraction of the plane that is covered", 0.0, 0.5)

    def patch(self, rng: np.random.Generator) -> Patch:
        places = self._places(rng)
        vertices, faces = [_SQUARE * (0.5 * SIDE + 2.0)], [np.array([[0, 1, 2], [0, 2, 3]])]
        ball, triangles = _ball()
        turns = Rotation.random(len(places), random_state=rng) if len(places) else None
        shifts = np.array([(x, y, 0.0) for x in (-SIDE, 0.0, SIDE) for y in (-SIDE, 0.0, SIDE)])
        start = 4
        for index, place in enumerate(places):
            rotated = turns[index].apply(ball) if turns is not None else ball
            for center in np.append(place, 0.0) + shifts:
                if np.abs(center).max() < 0.5 * SIDE + 1.0:
                    vertices.append(rotated + center)
                    faces.append(triangles + start)
                    start += len(ball)
        top = 1.0 if len(places) else 0.0
        return Patch(np.concatenate(vertices), np.concatenate(faces).astype(np.uint32), (SIDE, SIDE), top)

    def _places(self, rng: np.random.Generator) -> Floats:
        """The centers of the spheres in one period, at least two radii apart."""
        wanted = round(self.coverage * SIDE * SIDE / np.pi)
        centers = np.empty((0, 2))
        for place in rng.uniform(-0.5 * SIDE, 0.5 * SIDE, (TRIES, 2)):
            if len(centers) == wanted:
                return centers
            apart = np.abs(centers - place)
            if not len(centers) or np.square(np.minimum(apart, SIDE - apart)).sum(axis=1).min() > 4.0:
                centers = np.vstack([centers, place])
        raise InputError(f"{wanted} hemispheres do not fit without touching", "spheres.coverage", "cover less")


_SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


@functools.cache
def _ball() -> tuple[Floats, NDArray[np.int64]]:
    """The vertices and triangles of a unit sphere, whose lower half is hidden below the plane."""
    hull = ConvexHull(_icosahedron())
    points, faces = hull.points, hull.simplices
    for _ in range(SPLITS):
        corners = points[faces]
        middles = corners + np.roll(corners, -1, axis=1)  # midpoints of the edges ab, bc and ca
        middles /= np.linalg.norm(middles, axis=-1, keepdims=True)
        (a, b, c), (ab, bc, ca) = corners.swapaxes(0, 1), middles.swapaxes(0, 1)
        parts = [np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        points = np.concatenate(parts).reshape(-1, 3)
        faces = np.arange(len(points)).reshape(-1, 3)
    corners = points[faces]
    inward = np.einsum(
        "ni,ni->n", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]
    )
    faces = np.where(inward[:, None] < 0.0, faces[:, ::-1], faces)
    return points, faces


def _icosahedron() -> Floats:
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corners = [(0.0, x, y * golden) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    points = np.array([np.roll(corner, turn) for corner in corners for turn in range(3)])
    return points / np.linalg.norm(points, axis=1, keepdims=True)
