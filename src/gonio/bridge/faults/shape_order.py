"""Mitsuba 3.9: a scene with merged meshes returns its shapes and lights in a random order.

    kinds = [mi.load_dict({"type": "diffuse"}) for _ in range(3)]
    walls = {f"s{k}": {"type": "rectangle", "bsdf": kinds[k // 3]} for k in range(9)}
    [kinds.index(mesh.bsdf()) for mesh in mi.load_dict({"type": "merge", **walls})]     # [2, 1, 0], by address

Meshes of equal material are merged in the order of the memory address of the material. The order of the shapes
determines the order of the lights, the kernels, and the last bits of every picture.

Workaround: sort by properties that do not change between runs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..types import Emitter, Plugin


def light_key(emitter: Emitter) -> tuple[str, list[float]]:
    """A sort key for lights that does not change between runs."""
    shape = emitter.get_shape()
    box = [] if shape is None else [float(x) for x in (*shape.bbox().min, *shape.bbox().max)]
    return str(emitter), box


def shape_key(shape: Plugin) -> tuple[str, list[float], int, bytes]:
    """A sort key for shapes that does not change between runs."""
    if shape.id():  # a shape of the scene; merged shapes have no names
        return shape.id(), [], 0, b""
    box = shape.bbox()
    corners = [float(x) for corner in (box.min, box.max) for x in np.ravel(corner)]
    vertices: Any = np.asarray(shape.vertex_positions_buffer()) if shape.is_mesh() else np.zeros(0)
    return "", corners, shape.primitive_count(), vertices.tobytes()
