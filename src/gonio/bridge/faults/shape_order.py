"""Mitsuba 3.9: a scene hands its shapes and lights on in a random order where meshes are merged.

    [shape.id() for shape in mi.load_dict({"type": "merge", ...})]       # another order in another process

Meshes of equal material are merged by the address of that material. With the order of the shapes goes that of the
lights, the kernels, and the last bits of every picture.

Workaround: sort by what does not change between two runs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..types import Emitter, Plugin


def light_key(emitter: Emitter) -> tuple[str, list[float]]:
    """What lights are sorted by."""
    shape = emitter.get_shape()
    box = [] if shape is None else [float(x) for x in (*shape.bbox().min, *shape.bbox().max)]
    return str(emitter), box


def shape_key(shape: Plugin) -> tuple[str, list[float], int, bytes]:
    """What shapes are sorted by."""
    if shape.id():  # a shape of the scene; those that were merged have lost their names
        return shape.id(), [], 0, b""
    box = shape.bbox()
    corners = [float(x) for corner in (box.min, box.max) for x in np.ravel(corner)]
    vertices: Any = np.asarray(shape.vertex_positions_buffer()) if shape.is_mesh() else np.zeros(0)
    return "", corners, shape.primitive_count(), vertices.tobytes()
