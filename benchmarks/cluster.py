"""What a crew costs: parts a second and bytes a part, a model made of them, and the model against processes here.

    python benchmarks/cluster.py [--workers 2,4,8] [--render]

The master hands parts out and takes results in, one after the other: with W workers and parts of s seconds it keeps up
as long as W / s parts a second are not more than R, what it manages where parts do nothing. A part travels while others
are worked on, so that only the first and the last cost: a worker waits half a part at the end on average, and `begin`
seconds at the start, in which it imports Gonio, loads the scene and takes the kernel from the cache. For N parts

    efficiency = T / (T + begin + s / 2),  T = max(N s / W, N / R) + what the bytes take,  relative to N s / W
"""

from __future__ import annotations

import argparse
import os
import pickle
import statistics
import sys
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.render import run, tiles
from gonio.work import crew
from gonio.work.cluster import Cluster

SCENE = Path(__file__).parent.parent / "examples/phong"


def nothing(seconds: float, size: int) -> dict[str, np.ndarray]:
    """A part of so many seconds that gives so many bytes back."""
    time.sleep(seconds)
    return {"x": np.zeros(size // 8)}


def timed(count: int, seconds: float, size: int = 1024) -> float:
    """Seconds for so many parts."""
    begun = time.perf_counter()
    for _ in crew.each(nothing, [(seconds, size)] * count):
        pass
    return time.perf_counter() - begun


def predicted(parts: int, seconds: float, workers: int, rate: float, begin: float, size: float, band: float) -> float:
    """The model's efficiency."""
    ideal = parts * seconds / workers
    return ideal / (max(ideal, parts / rate, parts * size / band) + begin + seconds / 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", default="2,4,8")
    parser.add_argument("--render", action="store_true", help="also time a render of a minute, alone and by crews")
    options = parser.parse_args()
    rates, bands = [], []
    print("workers  parts/s  MB/s   s/part: measured efficiency (model)")
    for workers in map(int, options.workers.split(",")):
        with Cluster(workers=workers):
            timed(4 * workers, 0.0)  # everybody is there
            rates.append(1000 / timed(1000, 0.0))
            bands.append(40 * 4e6 / timed(40, 0.0, 4 << 20))
            row = []
            for seconds in (0.02, 0.1, 0.5):
                count = max(int(6 * workers / (seconds + 0.1)), 4 * workers)
                measured = count * seconds / workers / timed(count, seconds)
                model = predicted(count, seconds, workers, rates[-1], 0.0, 1024, bands[-1])
                row.append(f"{seconds:g}: {measured:.0%} ({model:.0%})")
            print(f"{workers:7}  {rates[-1]:7.0f}  {bands[-1] / 1e6:4.0f}   {',  '.join(row)}", flush=True)
    rate, band = statistics.median(rates), statistics.median(bands)
    prepared = run.prepare(run.Request(SCENE, spp=1))
    spec, _ = tiles.travelling(prepared)
    lanes = (1 << 25) // 4096
    there = len(pickle.dumps((spec, 0, lanes, 0, 4096, None)))
    back = sum(values[:lanes].nbytes for values in prepared.render.state().values())
    print(f"a part of a picture: {there} bytes there, {back} back ({lanes} lanes)")

    speed = 10e6 * (os.cpu_count() or 2) / 2  # samples a second of a worker, as of this machine with two cores
    print("workers  parts  s/part  efficiency of 3840 x 2160 at 4096 samples;  shortest part that keeps 90 %")
    total = 3840 * 2160 * 4096
    for workers in (10, 100, 1000):
        samples = tiles.part_size(total, workers)
        parts, seconds = total // samples, samples / speed
        share = predicted(parts, seconds, workers, rate, 3.0, back * samples / (1 << 25), band)
        need = next(
            s for s in np.geomspace(1e-3, 100, 400) if predicted(100 * workers, s, workers, rate, 0, 1e5, band) > 0.9
        )
        print(f"{workers:7}  {parts:5}  {seconds:6.2f}  {share:.1%};  {need:.2f} s")
    cards, seconds = 100 * 10, 6.0
    share = predicted(cards, seconds, 100, rate, 3.0, 1e5, band)
    print(f"100 materials x 10 laws, {seconds:g} s each, 100 workers: {share:.1%}")

    if options.render:
        go.render(SCENE, spp=16)
        spp = 64
        begun = time.perf_counter()
        go.render(SCENE, spp=spp)
        spp = int(spp * 70 / (time.perf_counter() - begun))
        begun = time.perf_counter()
        alone = go.render(SCENE, spp=spp)
        seconds = time.perf_counter() - begun
        print(f"alone: {seconds:.1f} s, {spp} spp", flush=True)
        for workers in map(int, options.workers.split(",")):
            begun = time.perf_counter()
            with Cluster(workers=workers):
                together = go.render(SCENE, spp=spp)
            took = time.perf_counter() - begun
            same = "same bits" if np.array_equal(alone, together) else "OTHER BITS"
            print(f"{workers} workers: {took:.1f} s, {took / seconds:.2f} of alone, {same}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
