"""Every scene of `benchmarks/scenes`: Gonio's path tracer against Mitsuba's with its best sampler, in one process.

    python benchmarks/suite.py                              # all scenes, some minutes
    python benchmarks/suite.py sun-environment many         # some
    python benchmarks/suite.py --figure suite.png           # and a figure of the pictures and ratios

Efficiency is 1 / (relMSE x time); relMSE = mean((x - r)^2 / (r^2 + floor)) with the floor at 1 % of the squared mean of
the picture. Time is that of a whole new render of a loaded scene file, from its dictionary to the picture, kernels
cached: what a user waits for. The rate leaves the start out. The reference is the mean of
Gonio's and Mitsuba's own pictures of many samples, which have to agree within their noise in blocks of 10 x 10 pixels;
caustic scenes have no reference here that paths could reach, so that only time and rate are shown.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from gonio.render import engine
from rich.console import Console
from rich.table import Table

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)
from gonio.render.integrators import Render, Settings  # noqa: E402

from scenes import SCENES, Scene  # noqa: E402

SAMPLERS = ("independent", "stratified", "multijitter", "ldsampler")
ROUNDS = 3
EACH = 16  # samples of a part of the reference
console = Console(width=None if os.isatty(1) else 130)


@dataclass
class Contender:
    name: str
    start: Callable[[], Callable[[int], np.ndarray]]  # loads the scene, and gives what renders it with a seed
    first: list[float] = field(default_factory=list)  # seconds to a picture of one sample
    whole: list[float] = field(default_factory=list)
    steady: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)

    @property
    def cost(self) -> float:
        return float(np.mean(self.errors)) * min(self.whole)


def ours(scene: Scene, spp: int) -> Callable[[], Callable[[int], np.ndarray]]:
    def start() -> Callable[[int], np.ndarray]:
        loaded = scene.load(mi)

        def draw(seed: int) -> np.ndarray:
            render = Render(loaded, Settings("path", scene.depth, seed=seed))
            render.advance(spp)
            return render.image()

        return draw

    return start


def theirs(scene: Scene, sampler: str, spp: int) -> Callable[[], Callable[[int], np.ndarray]]:
    def start() -> Callable[[int], np.ndarray]:
        loaded = scene.load(mi, sampler, spp)
        path = mi.load_dict({"type": "path", "max_depth": scene.depth})

        def draw(seed: int) -> np.ndarray:
            image = mi.render(loaded, integrator=path, spp=spp, seed=seed)
            dr.eval(image)
            dr.sync_thread()
            return np.array(image)

        return draw

    return start


def reference(scene: Scene, seconds: float) -> tuple[np.ndarray, float]:
    """The mean of two path tracers' pictures, and how far apart they are: worst block of 10 x 10 pixels, in sigma."""
    parts: list[list[np.ndarray]] = [[], []]
    drawn = [ours(scene, EACH)(), theirs(scene, "independent", EACH)()]
    begin, seed = time.perf_counter(), 1000
    while time.perf_counter() - begin < seconds or len(parts[0]) < 8:
        for found, draw in zip(parts, drawn, strict=True):
            found.append(blocks_and_picture(draw(seed)))
        seed += 1
    means, squares = [], []
    for found in parts:
        stack = np.stack([blocks for blocks, _ in found])
        means.append(stack.mean(0))
        squares.append(stack.var(0, ddof=1) / len(stack))
    apart = np.abs(means[0] - means[1]) / np.sqrt(squares[0] + squares[1] + 1e-20)
    picture = np.mean([picture for found in parts for _, picture in found], axis=0)
    return picture, float(apart.max())


def blocks_and_picture(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    height, width = (10 * (n // 10) for n in picture.shape[:2])
    grey = picture[:height, :width].mean(-1)
    return grey.reshape(height // 10, 10, width // 10, 10).mean((1, 3)), picture


def relmse(x: np.ndarray, r: np.ndarray) -> float:
    return float(np.mean((x - r) ** 2 / (r**2 + 0.01 * np.mean(r) ** 2)))


def compete(scene: Scene, truth: np.ndarray | None) -> list[Contender]:
    """Gonio first; all take turns, so that a busy machine is busy for all."""
    field = [Contender("Gonio", ours(scene, scene.spp))]
    field += [Contender(s, theirs(scene, s, scene.spp)) for s in SAMPLERS]
    singles = [ours(scene, 1), *(theirs(scene, s, 1) for s in SAMPLERS)]
    for round_number in range(ROUNDS + 1):  # the first compiles
        for contender, single in zip(field, singles, strict=True):
            begin = time.perf_counter()
            single()(7)
            first = time.perf_counter() - begin
            begin = time.perf_counter()
            draw = contender.start()
            picture = draw(round_number)
            whole = time.perf_counter() - begin
            begin = time.perf_counter()
            again = draw(100 + round_number)
            steady = time.perf_counter() - begin
            if round_number:
                contender.first.append(first)
                contender.whole.append(whole)
                contender.steady.append(steady)
                if truth is not None:
                    contender.errors += [relmse(picture, truth), relmse(again, truth)]
    return field


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=", ".join(SCENES))
    parser.add_argument("--seconds", type=float, default=20, help="for each reference")
    parser.add_argument("--figure", type=Path, help="where to draw pictures and ratios")
    given = parser.parse_args()
    if unknown := set(given.scenes) - set(SCENES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    table = Table(title="Gonio's path tracer, and Mitsuba's with the sampler that is best there")
    for title in ("scene", "best peer", "first sample [s]", "peer", "M samples/s", "peer", "error ratio", "efficiency"):
        table.add_column(title, justify="left" if title in ("scene", "best peer") else "right")
    shown: list[tuple[str, np.ndarray, str]] = []
    ratios = []
    for name in given.scenes or SCENES:
        scene = SCENES[name]
        truth, apart = (None, 0.0) if scene.caustic else reference(scene, given.seconds)
        mine, *others = compete(scene, truth)
        best = min(others, key=lambda c: c.cost if truth is not None else min(c.whole))
        samples = scene.size[0] * scene.size[1] * scene.spp / 1e6
        row = [name, best.name, f"{min(mine.first):.2f}", f"{min(best.first):.2f}"]
        row += [f"{samples / min(c.steady):.1f}" for c in (mine, best)]
        words = "caustic"
        if truth is not None:
            logs = np.log(mine.errors) - np.log(best.errors)
            ratio, spread = best.cost / mine.cost, float(np.std(logs, ddof=1) / np.sqrt(len(logs)))
            ratios.append(ratio)
            words = f"{ratio:.2f} ± {ratio * spread:.2f}" + (f" ({apart:.1f} sigma apart)" if apart > 5 else "")
            row += [f"{np.mean(mine.errors) / np.mean(best.errors):.2f}", words]
        table.add_row(*row)
        console.print(" ".join(row))
        shown.append((name, truth if truth is not None else mine.start()(1), words))
    console.print(table)
    if ratios:
        console.print(f"geometric mean of {len(ratios)} efficiencies: {np.exp(np.mean(np.log(ratios))):.2f}")
    if given.figure:
        draw(given.figure, shown)


def draw(path: Path, shown: list[tuple[str, np.ndarray, str]]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(4 * columns, 3 * rows), squeeze=False)
    for place in axes.flat:
        place.axis("off")
    for place, (name, picture, words) in zip(axes.flat, shown, strict=False):
        white = np.percentile(picture, 97) + 1e-9
        place.imshow(np.clip(picture / white, 0, 1) ** (1 / 2.2))
        place.set_title(f"{name}: {words}", fontsize=10)
    figure.suptitle("Efficiency of Gonio's path tracer over Mitsuba's with its best sampler (above 1: Gonio is ahead)")
    figure.tight_layout()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main()
