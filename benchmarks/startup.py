"""Startup time of the command: `gonio --help`, and a small render with and without compiled kernels.

    python benchmarks/startup.py [--runs 7]

Prints a table and the machine. The cold render has an empty kernel cache, since it runs with a new home folder.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Limits in seconds: delays that do not make a user wonder.
BARS = {"gonio --help": 0.25, "render, cold": 10.0, "render, warm": 6.0}


def ball(metal: float, x: float) -> dict[str, object]:
    material = {
        "type": "conductor",
        "albedo": [1, 1, 1],
        "eta": [0.2, 0.92, 1.1],
        "k": [3.9, 2.45, 2.14],
        "roughness": metal,
        "ndf": "ggx",
    }
    return {"type": "sphere", "center": [x, 0, 0], "radius": 0.45, "material": material}


SCENE = {
    "output": {"filename": "startup.exr"},
    "sampler": {"type": "independent", "xSamples": 8, "ySamples": 8},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 20,
        "film": {"size": [1000, 300]},
    },
    "integrator": {"type": "directSampleLight"},
    "scene": {
        "shapes": [ball(metal, x) for metal, x in ((0.02, -2), (0.1, -1), (0.3, 0), (0.5, 1), (0.9, 2))]
        + [{"type": "parallelogram", "base": [-9, -0.5, 9], "edge0": [18, 0, 0], "edge1": [0, 0, -18]}],
        "lights": [
            {
                "type": "areaLight",
                "energy": [5, 5, 5],
                "shape": {"type": "parallelogram", "base": [0, 3, 4], "edge0": [0, 0, 4], "edge1": [4, 0, 0]},
            }
        ],
    },
}


def seconds(command: list[str], folder: Path, environment: dict[str, str]) -> float:
    started = time.perf_counter()
    subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=7, help="of which the median counts; 3 at most for the cold render")
    runs = parser.parse_args().runs
    command = [str(Path(sys.executable).with_name("gonio"))]
    times: dict[str, list[float]] = {name: [] for name in BARS}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(SCENE))
        render = [*command, "render", str(folder), "-o", "a.exr"]
        for _ in range(runs):
            times["gonio --help"].append(seconds([*command, "--help"], folder, dict(os.environ)))
        for run in range(min(runs, 3)):
            home = folder / f"home{run}"  # Dr.Jit stores its kernels in ~/.drjit
            home.mkdir()
            environment = {**os.environ, "HOME": str(home)}
            times["render, cold"].append(seconds(render, folder, environment))
            times["render, warm"].append(seconds(render, folder, environment))
    print(f"{'what':<14} {'median':>8} {'best':>8} {'bar':>8}  ratio to the bar")
    for what, bar in BARS.items():
        median = statistics.median(times[what])
        print(f"{what:<14} {median:>7.2f}s {min(times[what]):>7.2f}s {bar:>7.2f}s  {median / bar:.2f}")
    print("render: 1000x300, 64 spp, directSampleLight, five GGX conductors, the whole process")
    print(f"machine: {platform.platform()}, {os.cpu_count()} cores, Python {platform.python_version()}")


if __name__ == "__main__":
    main()
