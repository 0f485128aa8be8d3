"""Hemispheres on a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...errors import InputError
from .base import Floats, Patch, Surface, parameter

SIDE = 24.0  # of the period, in radii
RINGS, SECTORS = 24, 96  # facets of a hemisphere
TRIES = 200_000


@dataclass(frozen=True)
class Spheres(Surface):
    """Hemispheres of one size, scattered over a plane without touching: beads half sunk into their binder."""

    name: ClassVar[str] = "spheres"
    random: ClassVar[bool] = True

    coverage: float = parameter(0.4, "share of the plane that is covered", 0.0, 0.5)

    def patch(self, rng: np.random.Generator) -> Patch:
        places = self._places(rng)
        vertices, faces = [_SQUARE * (0.5 * SIDE + 2.0)], [np.array([[0, 1, 2], [0, 2, 3]])]
        ball, triangles = _hemisphere()
        shifts = np.array([(x, y) for x in (-SIDE, 0.0, SIDE) for y in (-SIDE, 0.0, SIDE)])
        centres = (places[:, None] + shifts).reshape(-1, 2)
        start = 4
        for x, y in centres[np.abs(centres).max(axis=1) < 0.5 * SIDE + 1.0]:
            vertices.append(ball + np.array([x, y, 0.0]))
            faces.append(triangles + start)
            start += len(ball)
        top = 1.0 if len(places) else 0.0
        return Patch(np.concatenate(vertices), np.concatenate(faces).astype(np.uint32), (SIDE, SIDE), top)

    def _places(self, rng: np.random.Generator) -> Floats:
        """Centres in the period, two radii or more apart."""
        wanted = round(self.coverage * SIDE * SIDE / np.pi)
        found = np.empty((0, 2))
        for place in rng.uniform(-0.5 * SIDE, 0.5 * SIDE, (TRIES, 2)):
            if len(found) == wanted:
                return found
            apart = np.abs(found - place)
            if not len(found) or np.square(np.minimum(apart, SIDE - apart)).sum(axis=1).min() > 4.0:
                found = np.vstack([found, place])
        raise InputError(f"no room for {wanted} hemispheres without touching", "spheres.coverage", "cover less")


_SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


def _hemisphere() -> tuple[Floats, np.ndarray]:
    """Its vertices, ring by ring from below the plane to the pole, and its triangles."""
    theta = np.linspace(0.5 * np.pi, 0.0, RINGS + 1)[:-1]
    phi = np.arange(SECTORS) * (2.0 * np.pi / SECTORS)
    rings = [
        np.stack([np.sin(t) * np.cos(phi), np.sin(t) * np.sin(phi), np.full(SECTORS, np.cos(t))], -1) for t in theta
    ]
    vertices = np.concatenate([*rings, [[0.0, 0.0, 1.0]]])
    a = np.arange(SECTORS)
    b = (a + 1) % SECTORS
    faces = []
    for ring in range(RINGS - 1):
        low, high = ring * SECTORS, (ring + 1) * SECTORS
        faces += [np.stack([a + low, b + low, b + high], -1), np.stack([a + low, b + high, a + high], -1)]
    last = (RINGS - 1) * SECTORS
    faces.append(np.stack([a + last, b + last, np.full(SECTORS, RINGS * SECTORS)], -1))
    return vertices, np.concatenate(faces)
