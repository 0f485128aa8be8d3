"""A long-lived process: renders with changing values, renders with changing shapes, evaluations and bakes in a loop.

    python benchmarks/long_life.py [--values 10000] [--shapes 2000] [--evaluations 2000] [--bakes 500]

Prints memory and time per step in ten intervals, and their drift after the first twentieth. Limits: memory within 2 %,
time within 5 %.
"""

from __future__ import annotations

import argparse
import gc
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import gonio as go
import numpy as np

SIZE = (64, 64)


def memory() -> int:
    """Resident memory of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def values(step: int) -> None:
    """Render a ball with another alpha and color."""
    x = (step * 0.6180339887) % 1.0
    material = go.Conductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4 + x, 2.2), alpha=0.05 + 0.5 * x)
    go.render(material, size=SIZE, spp=1, max_depth=3)


def shapes(step: int) -> None:
    """Render the same ball elsewhere, with another size, on a floor that has moved."""
    x = (step * 0.6180339887) % 1.0
    moved = {"shapes.0.radius": 0.5 + 0.5 * x, "shapes.0.center": [x, 1, 0], "shapes.1.base": [-3.6, 0.1 * x, -3.6]}
    go.render(go.Lambert(), size=SIZE, spp=1, max_depth=3, overrides=moved)


def evaluations(step: int) -> None:
    """Evaluate a thousand values of a material."""
    rng = np.random.default_rng(step)
    w = rng.normal(size=(2, 1000, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    go.Conductor(eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2), alpha=0.1 + 0.001 * (step % 500)).eval(w[0], w[1])


def bakes(step: int) -> None:
    """Bake a small table."""
    from gonio.energy.tables import bake

    bake.bake("ggx", size=8 + step % 2, masking=("smith-correlated", "smith-separable")[step % 2])


def drift(name: str, step: Callable[[int], None], count: int) -> bool:
    """Whether memory and time remain constant over `count` steps."""
    if count == 0:
        return True
    times, used = [], []
    every = max(count // 200, 1)
    for number in range(count):
        began = time.perf_counter()
        step(number)
        times.append(time.perf_counter() - began)
        if number % every == 0:
            used.append(memory())
    skip = max(count // 20, 1)
    late, sizes = times[skip:], used[max(len(used) // 20, 1) :]
    tenth = max(len(late) // 10, 1)
    pace = [statistics.median(late[at : at + tenth]) for at in range(0, tenth * 10, tenth)][:10]
    room = [sizes[min(at * len(sizes) // 10, len(sizes) - 1)] for at in range(10)] + [sizes[-1]]
    more, slower = max(room) / room[0] - 1, pace[-1] / pace[0] - 1
    print(f"{name}: {count} steps, {statistics.median(late) * 1e3:.1f} ms each, garbage {len(gc.garbage)}")
    print("  MB:", *(f"{x / 1e6:.0f}" for x in room), f"  {more:+.1%}")
    print("  ms:", *(f"{x * 1e3:.1f}" for x in pace), f"  {slower:+.1%}", flush=True)
    return more <= 0.02 and slower <= 0.05


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--values", type=int, default=10000)
    parser.add_argument("--shapes", type=int, default=2000)
    parser.add_argument("--evaluations", type=int, default=2000)
    parser.add_argument("--bakes", type=int, default=500)
    given = vars(parser.parse_args())
    flat = [drift(name, globals()[name], count) for name, count in given.items()]
    print("flat" if all(flat) else "NOT FLAT")
    return int(not all(flat))


if __name__ == "__main__":
    sys.exit(main())
