"""A fresh process that draws every example and random scenes: `python drawings.py SEED EXAMPLES RANDOM`.

The seed decides into which passes each picture is parted, as timing does in a render, the order of the scenes, and the
number of threads. Prints one line per picture: its name and a hash of its sums.
"""

from __future__ import annotations

import hashlib
import json
import random
import sys
from pathlib import Path
from typing import Any

import numpy as np
from gonio.bridge import engine
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.transport.integrators import Render, Settings

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(
    path.relative_to(EXAMPLES).as_posix()
    for path in EXAMPLES.glob("*/*.json")
    if "scene" in json.loads(path.read_text())
    and path.parent.name != "polarizer"  # Mitsuba's film adds in arbitrary order
)
SPP = 24


def digest(render: Any, choose: random.Random) -> str:
    """A hash of the sums of SPP samples, drawn in passes of random sizes."""
    fixed = getattr(render, "pass_size", None)
    while render.done < SPP:
        render.advance(min(fixed or choose.randint(1, SPP), SPP - render.done))
    state = render.state()
    return hashlib.sha256(b"".join(np.ascontiguousarray(state[name]).tobytes() for name in sorted(state))).hexdigest()


def main(seed: int, examples: int, scenes: int) -> None:
    choose = random.Random(seed)
    engine.load("cpu", threads=choose.randint(1, 2))
    jobs: list[str | int] = [*SCENES[:examples], *range(scenes)]
    choose.shuffle(jobs)
    for job in jobs:
        if isinstance(job, str):
            render: Any = prepare(Request(EXAMPLES / job, size=(96, 72), spp=SPP)).render
        else:
            from test_random_scenes import POINTS, ROUGH, SMOOTH, SURFACES, Scene

            engine.load("cpu")
            scene = Scene(1000 + job, ROUGH + SMOOTH, SURFACES + POINTS)
            render = Render(scene.loaded, Settings(("path", "caustics")[job % 2], scene.depth))
        print(job, digest(render, choose), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
