"""Prints what a changed value compiles in the live reference: `python kernels.py directional|area|environment`.

Run in a process of its own: a kernel knows all materials and lights that are alive, those of other tests too.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from gonio.viewer import messages, stage
from gonio.viewer.reference import Reference
from test_reference import SUN, WHITE, dr, picture, scene


def compiled(light: str) -> list[Any]:
    """(size, operations) of each kernel that the third picture, with new values, had to compile."""
    what = stage.homework()
    reference = Reference(what)

    def lights(x: float) -> list[Any]:
        return {
            "directional": [{**SUN, "direction": [x, 0.5, 1.0]}],
            "area": [{"type": "area", "center": [x, 2, 5], "u": [1, 0, x], "v": [0, 1, 0], "radiance": [x, 2, 3]}],
            "environment": [{**WHITE, "constant": [x, 1.0, 1.0]}],
        }[light]

    def show(x: float) -> None:
        rows = [[{p: [0.04 + x, 0.04 + x] for p in ball.values} for ball in row.balls] for row in what.rows]
        message = scene(what, lights(x), spp=3, camera={"azimuth": x, "distance": 10 + x}).model_dump()
        for row, balls in zip(message["state"]["rows"], rows, strict=True):
            row["balls"] = balls
        picture(reference, messages.parse(json.dumps(message)))

    show(0.1)
    show(0.2)  # the second time nothing is new any more
    before = reference._balls._scene
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        show(0.37)
        history = dr.kernel_history([dr.KernelType.JIT])
    assert reference._balls._scene is before
    assert len(history) > 2
    return [(kernel["size"], kernel["operation_count"]) for kernel in history if not kernel["cache_hit"]]


if __name__ == "__main__":
    print(json.dumps(compiled(sys.argv[1])))
