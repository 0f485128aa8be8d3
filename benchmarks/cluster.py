"""The cost of a cluster: parts per second, bytes per part, and a model of them compared with processes on this machine.

    python benchmarks/cluster.py [--workers 2,4,8] [--render]

The master submits parts and receives results one after the other. With W workers and parts of s seconds it keeps up as
long as W / s parts per second do not exceed R, the rate of parts that do nothing. Parts are transferred while others
are computed, so that only the first and the last cost time: a worker waits half a part at the end on average, and
`begin` seconds at the start, while it imports Gonio, loads the scene and reads the kernel from the cache; `begin` is
measured as the time by which a worker's first picture exceeds its second. For N parts of `size` bytes and `band` bytes
per second

    efficiency = (N s / W) / (T + begin + s / 2),  T = max(N s / W, N / R, N size / band)
"""

from __future__ import annotations

import argparse
import contextlib
import os
import pickle
import statistics
import sys
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.render import tiles
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.work import cluster, executor
from gonio.work.cluster import Cluster

START_INTERVAL = cluster.START_INTERVAL
SCENE = Path(__file__).parent.parent / "examples/phong"


def nothing(seconds: float, size: int) -> dict[str, np.ndarray]:
    """A part that takes `seconds` and returns `size` bytes."""
    time.sleep(seconds)
    return {"x": np.zeros(size // 8)}


def timed(count: int, seconds: float, size: int = 1024) -> float:
    """Seconds for `count` parts."""
    begun = time.perf_counter()
    for _ in executor.each(nothing, [(seconds, size)] * count):
        pass
    return time.perf_counter() - begun


def predicted(parts: int, seconds: float, workers: int, rate: float, begin: float, size: float, band: float) -> float:
    """The efficiency by the model."""
    ideal = parts * seconds / workers
    return ideal / (max(ideal, parts / rate, parts * size / band) + begin + seconds / 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", default="2,4,8")
    parser.add_argument(
        "--render", action="store_true", help="also time a render of a minute, by one process and by clusters"
    )
    options = parser.parse_args()
    rates, bands = [], []
    cluster.START_INTERVAL = 0.0  # start all at once, since the model assumes that all have joined
    print("workers  parts/s  MB/s   s/part: measured efficiency (model)")
    for workers in map(int, options.workers.split(",")):
        with Cluster(workers=workers) as one:
            while len(one._alive()) < workers:  # wait for all workers
                timed(4 * workers, 0.1)
            rates.append(1000 / timed(1000, 0.0))
            bands.append(40 * 4e6 / timed(40, 0.0, 4 << 20))
            row = []
            for seconds in (0.02, 0.1, 0.5):
                count = max(int(6 * workers / (seconds + 0.1)), 4 * workers)
                measured = count * seconds / workers / timed(count, seconds)
                model = predicted(count, seconds, workers, rates[-1], 0.0, 1024, bands[-1])
                row.append(f"{seconds:g}: {measured:.0%} ({model:.0%})")
            print(f"{workers:7}  {rates[-1]:7.0f}  {bands[-1] / 1e6:4.0f}   {',  '.join(row)}", flush=True)
    cluster.START_INTERVAL = START_INTERVAL
    rate, band = statistics.median(rates), statistics.median(bands)
    prepared = prepare(Request(SCENE, spp=1))
    spec, _ = tiles.travelling(prepared)
    lanes = (1 << 25) // 4096
    there = len(pickle.dumps((spec, 0, lanes, 0, 4096, None)))
    back = sum(values[:lanes].nbytes for values in prepared.render.state().values())
    print(f"a part of a picture: {there} bytes there, {back} back ({lanes} lanes)")

    begin = beginning()
    print(f"a worker begins in {begin:.2f} s")
    speed = 10e6 * (os.cpu_count() or 2) / 2  # samples per second of a worker, scaled from a machine with two cores
    print("workers  parts  s/part  efficiency of 3840 x 2160 at 4096 samples;  shortest part that keeps 90 %")
    total = 3840 * 2160 * 4096
    for workers in (10, 100, 1000):
        samples = tiles.part_size(total, workers)
        parts, seconds = total // samples, samples / speed
        share = predicted(parts, seconds, workers, rate, begin, back * samples / (1 << 25), band)
        need = next(
            s for s in np.geomspace(1e-3, 100, 400) if predicted(100 * workers, s, workers, rate, 0, 1e5, band) > 0.9
        )
        print(f"{workers:7}  {parts:5}  {seconds:6.2f}  {share:.1%};  {need:.2f} s")
    cards, seconds = 100 * 10, 6.0
    share = predicted(cards, seconds, 100, rate, begin, 1e5, band)
    print(f"100 materials x 10 laws, {seconds:g} s each, 100 workers: {share:.1%}")

    if options.render:
        against_one(list(map(int, options.workers.split(","))))


def beginning() -> float:
    """Additional seconds that a worker which has just joined takes for a picture."""
    go.render(SCENE, spp=16)
    with Cluster(workers=2):
        timed(8, 0.1)
        took = []
        for _ in range(3):
            begun = time.perf_counter()
            go.render(SCENE, spp=16)
            took.append(time.perf_counter() - begun)
    return took[0] - min(took[1:])


def against_one(worker_counts: list[int]) -> None:
    """Time a render of over a minute on each cluster, and before and after each in one process with two threads."""
    go.render(SCENE, spp=16)
    spp = 4000
    spp = int(spp * 75 / cost(spp)[0])
    seconds, processor, alone = cost(spp)
    print(f"alone: {seconds:.1f} s, {processor:.1f} s of processor, {spp} spp", flush=True)
    for workers in worker_counts:
        by_cluster, by_cluster_processor, together = cost(spp, workers)
        after, after_processor, _ = cost(spp)
        ratio = 2 * by_cluster / (seconds + after), 2 * by_cluster_processor / (processor + after_processor)
        same = "same bits" if np.array_equal(alone, together) else "OTHER BITS"
        print(
            f"{workers} workers: {by_cluster:.1f} s, {ratio[0]:.2f} of one "
            f"({seconds:.1f} s before, {after:.1f} s after); "
            f"{ratio[1]:.2f} of its processor time; {same}",
            flush=True,
        )
        seconds, processor = after, after_processor


def cost(spp: int, workers: int = 0) -> tuple[float, float, np.ndarray]:
    """Wall-clock seconds and CPU seconds, including the cluster's start and end, and the picture."""
    begun, before = time.perf_counter(), sum(os.times()[:4])
    with Cluster(workers=workers) if workers else contextlib.nullcontext():
        picture = go.render(SCENE, spp=spp)
    return time.perf_counter() - begun, sum(os.times()[:4]) - before, picture


if __name__ == "__main__":
    sys.exit(main())
