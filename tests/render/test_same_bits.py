"""A picture has the same bits in every process, however its passes are timed."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from drawings import EXAMPLES
from gonio.render.prepare import prepare
from gonio.render.request import Request

PROCESSES = 6


@pytest.mark.slow
def test_touching_surfaces_do_not_make_a_picture_depend_on_its_passes() -> None:
    # The foot of the ball touches the floor: one camera ray of these 16 pixels hits both at the same distance.
    render = prepare(Request(EXAMPLES / "shader-ball", size=(200, 150), spp=96)).render

    def sums(*passes: int) -> np.ndarray:
        render.select(slice(28448, 28464))
        for count in passes:
            render.advance(count)
        return np.array([render.state()[f"radiance{i}"] for i in range(3)])

    whole = sums(96)
    for first in (7, 8, 12, 14, 15, 18, 19, 20):
        assert np.array_equal(sums(first, 96 - first), whole), f"a pass of {first} samples, then one of {96 - first}"


@contextlib.contextmanager
def busy() -> Iterator[None]:
    """Load on the cores, by another process."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as other:
        try:
            yield
        finally:
            other.kill()


def drawn(seed: int, examples: int, scenes: int) -> dict[str, str]:
    """The hash of every picture, from a process of its own with another hash seed and other passes."""
    program = [sys.executable, str(Path(__file__).with_name("drawings.py")), *map(str, (seed, examples, scenes))]
    environment = {**os.environ, "PYTHONHASHSEED": str(seed), "PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(program, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(line.split() for line in done.stdout.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize(
    "processes, examples, scenes", [(2, 3, 2), pytest.param(PROCESSES, 99, 60, marks=pytest.mark.slow)]
)
def test_fresh_processes_draw_the_same_bits(processes: int, examples: int, scenes: int) -> None:
    with busy():
        first, *others = [drawn(seed, examples, scenes) for seed in range(processes)]
    assert len(first) >= examples % 99 + scenes
    for seed, other in enumerate(others, start=1):
        assert {name for name in first if first[name] != other[name]} == set(), f"process {seed}"
