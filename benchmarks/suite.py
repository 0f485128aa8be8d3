"""Every scene of `benchmarks/scenes`: Gonio's integrators against Mitsuba's with its best sampler, in one process.

    python benchmarks/suite.py                              # all scenes, several minutes
    python benchmarks/suite.py sun-environment many         # some scenes
    python benchmarks/suite.py --quick                      # a quarter of the samples, references of 4 s
    python benchmarks/suite.py --figure suite.png           # and a figure of the pictures and ratios
    python benchmarks/suite.py --until-error .002           # does `--until-error` achieve the requested error?
    python benchmarks/suite.py --bias                       # 2^28 samples of five scenes: is any block biased?

Efficiency is 1 / (relMSE x time); relMSE = mean((x - r)^2 / (r^2 + floor)), where the floor is 1 % of the squared mean
of the picture. Time is that of a complete new render from the scene's dictionary to the picture, with cached kernels,
as a user experiences it. The rate excludes the start.

References are stored in the cache folder under a hash of the scenes. Without caustics, a reference is the mean of
pictures with many samples by Gonio's and Mitsuba's path tracers, which must agree within their noise in blocks of
10 x 10 pixels. With caustics (`--integrator caustics` against Mitsuba's `path`, and Gonio's `path`), it is Gonio's
picture with a smaller radius, compared with Mitsuba's `ptracer` in blocks that show no mirror or glass or, if there are
none, with Gonio's `path` by the mean of the picture. `ptracer` renders neither mirrors nor glass, so it has no error
for a whole picture; it is compared on the pixels that it reaches.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from gonio.bridge import engine
from gonio.transport import passes
from rich.console import Console
from rich.table import Table
from scipy import stats

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)
from gonio.render.request import MAX_SPP_UNTIL  # noqa: E402
from gonio.transport import photon_maps, until  # noqa: E402
from gonio.transport.integrators import Render, Settings  # noqa: E402

from scenes import SCENES, Scene  # noqa: E402

SAMPLERS = ("independent", "stratified", "multijitter", "ldsampler")
ROUNDS = 3  # least rounds of a comparison; it ends when the ratio is accurate to KNOWN, or after TIRED seconds
KNOWN, TIRED = 0.05, 180.0
EACH = 16  # samples per pixel of a part of the reference
ROUNDING = 1e-6  # relative error of a mean by Mitsuba's float32 sums, since blocks of a uniform sky have no noise
console = Console(width=None if os.isatty(1) else 130)


@dataclass
class Contender:
    name: str
    start: Callable[[], Callable[[int], np.ndarray]]  # loads the scene; returns a function that renders it with a seed
    first: list[float] = field(default_factory=list)  # seconds for a picture with one sample per pixel
    whole: list[float] = field(default_factory=list)
    steady: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)

    reached: list[float] = field(default_factory=list)  # errors on the pixels that show no mirror or glass

    @property
    def cost(self) -> float:
        return float(np.mean(self.errors)) * min(self.whole)

    @property
    def reached_cost(self) -> float:
        return float(np.mean(self.reached)) * min(self.whole)


def ours(scene: Scene, spp: int, integrator: str = "path") -> Callable[[], Callable[[int], np.ndarray]]:
    def start() -> Callable[[int], np.ndarray]:
        loaded = scene.load(mi)

        def draw(seed: int) -> np.ndarray:
            render = Render(loaded, Settings(integrator, scene.depth, seed=seed))
            render.advance(spp)
            return render.image()

        return draw

    return start


def theirs(scene: Scene, sampler: str, spp: int, integrator: str = "path") -> Callable[[], Callable[[int], np.ndarray]]:
    def start() -> Callable[[int], np.ndarray]:
        loaded = scene.load(mi, sampler, spp)
        method = mi.load_dict({"type": integrator, "max_depth": scene.depth})

        def draw(seed: int) -> np.ndarray:
            image = mi.render(loaded, integrator=method, spp=spp, seed=seed)
            dr.eval(image)
            dr.sync_thread()
            return np.array(image)

        return draw

    return start


def reference(scene: Scene, seconds: float) -> tuple[np.ndarray, float]:
    """A converged picture, and the difference between the two methods that made it, in sigma of the worst block."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "gonio"
    content = (Path(__file__).with_name("scenes") / "__init__.py").read_bytes()
    facts = f"{scene.name} {scene.size} {seconds:g} {mi.__version__}".encode()
    file = folder / f"suite-{scene.name}-{hashlib.sha256(content + facts).hexdigest()[:12]}.npz"
    if not file.exists():
        picture, apart = (of_caustics if scene.caustic else of_paths)(scene, seconds)
        folder.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part.npz")
        np.savez(part, picture=picture, apart=apart)
        part.replace(file)
    with np.load(file) as found:
        return found["picture"], float(found["apart"])


def many_of(draws: list[Callable[[int], np.ndarray]], seconds: float) -> list[np.ndarray]:
    """Alternating pictures of each for `seconds`, at least eight: (number, height, width, 3)."""
    parts: list[list[np.ndarray]] = [[] for _ in draws]
    begin, seed = time.perf_counter(), 1000
    while time.perf_counter() - begin < seconds or len(parts[0]) < 8:
        for found, draw in zip(parts, draws, strict=True):
            found.append(draw(seed))
        seed += 1
    return [np.stack(found) for found in parts]


def sigmas(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The difference between the means of two stacks of blocks: Student's t as a normal deviate."""
    squares = sum(np.var(x, 0, ddof=1) / len(x) for x in (a, b))
    t = np.abs(np.mean(a, 0) - np.mean(b, 0)) / np.sqrt(squares + (ROUNDING * np.mean(b, 0)) ** 2 + 1e-20)
    return np.asarray(stats.norm.isf(stats.t.sf(t, min(len(a), len(b)) - 1)))


def of_paths(scene: Scene, seconds: float) -> tuple[np.ndarray, float]:
    found = many_of([ours(scene, EACH)(), theirs(scene, "independent", EACH)()], seconds)
    apart = sigmas(*(blocks(pictures) for pictures in found))
    return np.mean(np.concatenate(found), axis=0), float(apart.max())


def of_caustics(scene: Scene, seconds: float) -> tuple[np.ndarray, float]:
    before = photon_maps.FOOTPRINT
    photon_maps.FOOTPRINT = 0.75 * before
    try:
        one = ours(scene, 8 * EACH, "caustics")()
        if (seen := reached(scene)).any() and (whole := blocks(seen[None, ..., None]) == 1)[0].any():
            found, other = many_of([one, theirs(scene, "independent", 8 * EACH, "ptracer")()], 3 * seconds)
            apart = sigmas(blocks(found), blocks(other))[whole[0]]
        else:
            found, other = many_of([one, ours(scene, 8 * EACH)()], 3 * seconds)
            apart = sigmas(found.mean((1, 2, 3)), other.mean((1, 2, 3)))
    finally:
        photon_maps.FOOTPRINT = before
    return found.mean(0), float(np.max(apart))


def reached(scene: Scene) -> np.ndarray:
    """Pixels that particle tracing reaches: those that show a surface which is neither mirror nor glass."""
    loaded = scene.load(mi)
    width, height = scene.size
    n = 4  # points along each side of a pixel
    index = dr.arange(mi.UInt32, width * height * n * n)
    x = (mi.Float(index % (width * n)) + 0.5) / (width * n)
    y = (mi.Float(index // (width * n)) + 0.5) / (height * n)
    ray, _ = loaded.sensors()[0].sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5))
    si = loaded.ray_intersect(mi.Ray3f(ray))
    plain = si.is_valid() & ~mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.Delta)
    seen = np.array(plain).reshape(height, n, width, n)
    return np.asarray(seen.all((1, 3)))


def blocks(pictures: np.ndarray) -> np.ndarray:
    """Means of gray values over blocks of 10 x 10 pixels."""
    height, width = (10 * (n // 10) for n in pictures.shape[1:3])
    grey = pictures[:, :height, :width].mean(-1)
    return grey.reshape(len(grey), height // 10, 10, width // 10, 10).mean((2, 4))


def relmse(x: np.ndarray, r: np.ndarray, where: np.ndarray | slice = slice(None)) -> float:
    return float(np.mean(((x - r) ** 2 / (r**2 + 0.01 * np.mean(r) ** 2))[where]))


def compete(scene: Scene, truth: np.ndarray, spp: int) -> list[Contender]:
    """Gonio, then Mitsuba's path tracer, then for caustics Gonio's path tracer and Mitsuba's `ptracer`. They alternate,
    so that a busy machine affects all alike.

    If a hundredth of the pixels has most of the error, it is not known accurately from a few pictures, and the best of
    four peers is the luckiest; such scenes therefore get more rounds.
    """
    starts = [("Gonio", lambda n: ours(scene, n, "caustics" if scene.caustic else "path"))]
    starts += [(s, lambda n, s=s: theirs(scene, s, n)) for s in SAMPLERS]
    if scene.caustic:
        starts += [("Gonio's path", lambda n: ours(scene, n))]
        starts += [("ptracer", lambda n: theirs(scene, "independent", n, "ptracer"))]
    field = [Contender(name, make(spp)) for name, make in starts]
    singles = [make(1) for _, make in starts]
    where = reached(scene) if scene.caustic else slice(None)
    begun = time.perf_counter()
    for round_number in itertools.count():  # the first round compiles
        if round_number > ROUNDS and (spread(field) < KNOWN or time.perf_counter() - begun > TIRED):
            return field
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
                contender.errors += [relmse(picture, truth), relmse(again, truth)]
                if scene.caustic and np.any(where):
                    contender.reached += [relmse(picture, truth, where), relmse(again, truth, where)]
    raise AssertionError("the rounds go on until they return")


def best_peer(field: list[Contender]) -> Contender:
    return min(field[1 : 1 + len(SAMPLERS)], key=lambda c: c.cost)


def spread(field: list[Contender]) -> float:
    """The relative standard error of the ratio between the errors of Gonio and its best peer."""
    errors = [np.array(c.errors) for c in (field[0], best_peer(field))]
    return float(np.sqrt(sum(np.var(e, ddof=1) / len(e) / np.mean(e) ** 2 for e in errors)))


SMALLER = 4  # factor by which each side of the pictures of `promises` is reduced
RUNS, MORE, LONGEST = 4, 24, 60
SHARPER = 0.5  # radius of the reference relative to the final radius of a picture, for caustics


def promises(names: list[str], error: float) -> None:
    """Render until an estimated error, and print the actual error, from pictures with MORE times as many samples."""
    titles = ("scene", "samples", "error over promised", "over estimated", "without shares, of as many samples")
    table = Table(*titles, title=f"relMSE after --until-error {error:g}: of {RUNS} seeds, the median (lowest, highest)")
    judged = kept = 0
    for name in names:
        scene, stopped = SCENES[name], ""
        scene = replace(scene, size=(max(scene.size[0] // SMALLER, 48), max(scene.size[1] // SMALLER, 48)))
        loaded = scene.load(mi)

        def settings(seed: int, radius: float = 1.0, scene: Scene = scene) -> Settings:
            return Settings("caustics" if scene.caustic else "path", scene.depth, seed=seed, radius=radius)

        def picture(seed: int, spp: int, radius: float = 1.0, loaded: Any = loaded, settings: Any = settings) -> Any:
            render = Render(loaded, settings(seed, radius))
            render.advance(spp)
            return render.image()

        runs = [until.Until(loaded, settings(seed), error, MAX_SPP_UNTIL) for seed in range(RUNS)]
        for run in runs:
            stopped = passes.run(run, lambda run=run: run.goal, scene.size[0] * scene.size[1], timeout=LONGEST)
            if stopped:
                break
        if stopped:
            console.print(f"{name} | left out: not reached in {LONGEST} s")
            continue
        judged += 1
        samples = [run.done for run in runs]
        truth = picture(1000, MORE * max(samples), SHARPER * min(run.radius for run in runs))
        true = [relmse(run.image(), truth) / error for run in runs]
        over = [x * error / run.estimate() for x, run in zip(true, runs, strict=True)]
        same = [relmse(picture(100 + i, n), truth) / error for i, n in enumerate(samples)]
        middle = float(np.median(true))
        kept += 1 / 1.3 <= middle <= 1.3
        row = [name + (" (c)" if scene.caustic else ""), f"{np.median(samples):.0f}"]
        row += [f"{middle:.2f} ({min(true):.2f}, {max(true):.2f})", f"{np.median(over):.2f}", f"{np.median(same):.2f}"]
        table.add_row(*row)
        console.print(" | ".join(row))
    console.print(table)
    console.print(f"within a factor 1.3 of what was promised: {kept} of {judged}")


BIASED = ("five-metals", "sun-environment", "textured", "rough-glass", "room")  # scenes with different kinds of light
SIDE, PARTS = 128, 64  # width and height of those pictures, and number of pictures that the samples are divided into


def bias(names: list[str], log2_samples: int) -> None:
    """Compare 2^log2_samples samples of Gonio's `path` and of Mitsuba's, by the means of blocks of 10 x 10 pixels.

    Both render the same Mitsuba scene, and share only its shapes, materials and lamps. The spread of PARTS pictures
    with different seeds gives the noise of a block's mean, and Student's t the significance of a difference. The
    p-value of the worst of n blocks is multiplied by n (Bonferroni).
    """
    spp = 2**log2_samples // (SIDE * SIDE * PARTS)
    if spp < 1:
        raise SystemExit(f"--bias {log2_samples}: {PARTS} pictures of {SIDE} x {SIDE} have more samples than that")
    titles = ("scene", "samples", "mean over peer's", "its sigma", "worst block", "corrected", "median block's sigma")
    table = Table(*titles, title="Gonio's path against Mitsuba's, blocks of 10 x 10 pixels")
    for name in names:
        scene = replace(SCENES[name], size=(SIDE, SIDE))
        begin = time.perf_counter()
        draws = [ours(scene, spp)(), theirs(scene, "independent", spp)()]
        mine, other = (np.stack([draw(seed) for seed in range(PARTS)]) for draw in draws)
        a, b = blocks(mine), blocks(other)
        apart = sigmas(a, b)
        lit = (a.mean(0) > 0) | (b.mean(0) > 0)  # the other blocks receive no light
        chance = min(2.0 * float(stats.norm.sf(apart[lit].max())) * int(lit.sum()), 1.0)
        means = [x.mean((1, 2)) for x in (a, b)]
        ratio = float(means[0].mean() / means[1].mean())
        sigma = float(np.sqrt(sum(np.var(x, ddof=1) / PARTS for x in means)) / means[1].mean())
        noise = np.sqrt(sum(np.var(x, 0, ddof=1) / PARTS for x in (a, b)))[lit] / b.mean(0)[lit]
        row = [name, f"2^{log2_samples} each", f"{ratio:.6f}", f"{sigma:.1e}", f"{apart[lit].max():.2f} sigma"]
        row += [f"{stats.norm.isf(chance / 2):.2f} sigma of {int(lit.sum())}", f"{np.median(noise):.1e}"]
        table.add_row(*row)
        console.print(" | ".join([*row, f"{time.perf_counter() - begin:.0f} s"]))
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=", ".join(SCENES))
    parser.add_argument("--seconds", type=float, default=20, help="for each reference, three times that for caustics")
    parser.add_argument("--quick", action="store_true", help="a quarter of the samples, references of 4 seconds")
    parser.add_argument("--figure", type=Path, help="where to draw pictures and ratios")
    parser.add_argument("--until-error", type=float, metavar="E", help="judge renders until that error, small ones")
    many = "against 2^N of Mitsuba's (N = 28), block by block, of the scenes given or of " + ", ".join(BIASED)
    parser.add_argument("--bias", type=int, nargs="?", const=28, metavar="N", help="2^N samples " + many)
    given = parser.parse_args()
    if unknown := set(given.scenes) - set(SCENES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    if given.bias is not None:
        bias(given.scenes or list(BIASED), given.bias)
        return
    if given.until_error:
        promises(given.scenes or list(SCENES), given.until_error)
        return
    table = Table(title="Gonio (path; c: caustics), and Mitsuba's path tracer with the sampler that is best")
    titles = ("scene", "best peer", "first [s]", "peer", "M samples/s", "peer", "relMSE x spp", "peer", "efficiency")
    for title in titles:
        table.add_column(title, justify="left" if title in ("scene", "best peer") else "right")
    shown: list[tuple[str, np.ndarray, str]] = []
    ratios: dict[bool, list[float]] = {False: [], True: []}
    for name in given.scenes or SCENES:
        scene = SCENES[name]
        spp = max(scene.spp // 4, 4) if given.quick else scene.spp
        truth, apart = reference(scene, 4 if given.quick else given.seconds)
        field = compete(scene, truth, spp)
        mine, best = field[0], best_peer(field)
        samples = scene.size[0] * scene.size[1] * spp / 1e6
        row = [name + (" (c)" if scene.caustic else ""), best.name]
        row += [f"{min(c.first):.2f}" for c in (mine, best)]
        row += [f"{samples / min(c.steady):.1f}" for c in (mine, best)]
        row += [f"{np.mean(c.errors) * spp:.3g}" for c in (mine, best)]
        ratio = best.cost / mine.cost
        ratios[scene.caustic].append(ratio)
        words = f"{ratio:.3g} ± {ratio * spread(field):.2g}" + (f" ({apart:.1f} sigma apart)" if apart > 5 else "")
        table.add_row(*row, words)
        console.print(" | ".join([*row, words]))
        if scene.caustic:
            path, particles = field[-2:]
            against = f"   against Gonio's path: {path.cost / mine.cost:.3g}"
            if mine.reached:
                against += f"; against ptracer, where that reaches: {particles.reached_cost / mine.reached_cost:.3g}"
            console.print(against)
        shown.append((name, truth, words))
    console.print(table)
    for caustic, found in ratios.items():
        if found:
            kind = "with" if caustic else "without"
            mean = np.exp(np.mean(np.log(found)))
            console.print(f"geometric mean of {len(found)} efficiencies, scenes {kind} caustics: {mean:.2f}")
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
    figure.suptitle("Efficiency of Gonio over Mitsuba's path tracer with its best sampler (above 1: Gonio is ahead)")
    figure.tight_layout()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main()
