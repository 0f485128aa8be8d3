"""Time to equal error: Gonio's integrators against Mitsuba's own, in one process, on five GGX conductors.

    python benchmarks/render.py                      # Gonio's integrators with Mitsuba's roughconductor
    python benchmarks/render.py --bsdf gonio         # ... with gonio_conductor, and the plugin inside Mitsuba
    python benchmarks/render.py --denoise            # ... and a path at 16 samples with Open Image Denoise

Efficiency is 1 / (relMSE x time), relMSE = mean((x - r)^2 / (r^2 + 0.01)) against a converged picture r. All
contenders in a table alternate, so that a busy machine affects all alike; times are the minimum over the rounds. On a
machine with other work, use `--clock cpu`: CPU time of this process, divided by its number of threads.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from gonio.bridge import engine
from rich.console import Console
from rich.table import Table

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)
from gonio.transport.integrators import LightTransport, Render, Settings  # noqa: E402

WIDTH, HEIGHT, SPP = 1000, 300, 64
ETA, K = [0.15494, 0.11648, 0.13809], [4.81810, 3.11562, 2.14240]
ALPHAS = [0.05, 0.25, 0.5, 0.75, 0.99]
# Not `orthogonal`: it makes 121 samples of 64 and takes 3 times as long; its efficiency is below multijitter's.
NATIVE_SAMPLERS = ("independent", "stratified", "multijitter", "ldsampler")
console = Console(width=None if os.isatty(1) else 120)


def rgb(value: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": value}


def native(alpha: float) -> dict[str, Any]:
    return {"type": "roughconductor", "distribution": "ggx", "alpha": alpha, "eta": rgb(ETA), "k": rgb(K)}


def plugin(alpha: float) -> dict[str, Any]:
    choices = {"ndf": "ggx", "masking": "smith-separable", "fresnel": "exact"}
    return {"type": "gonio_conductor", "alpha": alpha, "eta": rgb(ETA), "k": rgb(K), **choices}


def scene(bsdf: Callable[[float], dict[str, Any]], sampler: str = "independent") -> Any:
    """Five balls of increasing roughness on a gray floor under a square lamp."""
    to = mi.ScalarTransform4f
    description: dict[str, Any] = {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 22,
            "fov_axis": "y",
            "to_world": to().look_at([0, 1, 4], [0, 0, 0], [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": WIDTH,
                "height": HEIGHT,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": sampler, "sample_count": SPP},
        },
        "floor": {
            "type": "rectangle",
            "to_world": to().translate([0, -0.45, 0]).rotate([1, 0, 0], -90).scale(10),
            "bsdf": {"type": "diffuse", "reflectance": rgb([0.7, 0.7, 0.7])},
        },
        "light": {
            "type": "rectangle",
            "to_world": to().translate([2, 3, 6]).rotate([1, 0, 0], 90).scale(2),
            "emitter": {"type": "area", "radiance": rgb(50.0)},
        },
    }
    for i, alpha in enumerate(ALPHAS):
        description[f"ball{i}"] = {"type": "sphere", "center": [i - 2, 0, 0], "radius": 0.45, "bsdf": bsdf(alpha)}
    return mi.load_dict(description)


@dataclass
class Contender:
    name: str
    draw: Callable[[int], np.ndarray]  # seed -> picture
    times: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    means: list[float] = field(default_factory=list)

    @property
    def time(self) -> float:
        return min(self.times)

    @property
    def error(self) -> float:
        return float(np.mean(self.errors))

    @property
    def cost(self) -> float:
        return self.error * self.time


def mitsuba(bsdf: Callable[[float], dict[str, Any]], sampler: str, integrator: str) -> Callable[[int], np.ndarray]:
    drawn = scene(bsdf, sampler)
    method = mi.load_dict({"type": "path", "max_depth": 5} if integrator == "path" else {"type": integrator})

    def draw(seed: int) -> np.ndarray:
        image = mi.render(drawn, integrator=method, spp=SPP, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return np.array(image)

    return draw


def gonio(bsdf: Callable[[float], dict[str, Any]], spp: int = SPP, finish: Any = None, **settings: Any) -> Any:
    drawn = scene(bsdf)

    def draw(seed: int) -> np.ndarray:
        render = Render(drawn, Settings(seed=seed, **settings), aovs=finish is not None)
        render.advance(spp)
        return render.image() if finish is None else finish(render.image(), **render.aov())

    return draw


def relmse(x: np.ndarray, r: np.ndarray) -> float:
    return float(np.mean((x - r) ** 2 / (r**2 + 0.01)))


def compete(contenders: list[Contender], rounds: int, clock: Callable[[], float], best: np.ndarray | None) -> None:
    for contender in contenders:
        contender.draw(1000)  # compiles
    for seed in range(rounds):
        for contender in contenders:
            start = clock()
            image = contender.draw(seed)
            contender.times.append(clock() - start)
            contender.means.append(float(image.mean()))
            if best is not None:
                contender.errors.append(relmse(image, best))


def converged(integrator: str, spp: int) -> np.ndarray:
    """The reference picture, stored in the cache folder for the next run."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "gonio"
    file = folder / f"benchmark-{integrator}-{spp}.npy"
    if file.exists():
        return np.asarray(np.load(file))
    console.print(f"converging {integrator}: {spp} samples a pixel ...")
    render = Render(scene(native), Settings(integrator, seed=123456789))
    while render.done < spp:
        render.advance(min(256, spp - render.done))
    folder.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part.npy")
    np.save(part, render.image())
    part.replace(file)
    return render.image()


def versus(integrator: str, bsdf: Any, name: str, args: argparse.Namespace, clock: Callable[[], float]) -> None:
    best = converged(integrator, args.reference_spp)
    field = [Contender(f"Mitsuba, {s}", mitsuba(native, s, integrator)) for s in NATIVE_SAMPLERS]
    field.append(Contender(f"Gonio over {name}", gonio(bsdf, integrator=integrator)))
    if args.denoise and integrator == "path":
        from gonio.pictures.denoise import denoise

        field.append(Contender("Gonio, 16 spp, denoised", gonio(bsdf, 16, denoise, integrator="path")))
    compete(field, args.rounds, clock, best)
    baseline, strongest = field[0], min(field[: len(NATIVE_SAMPLERS)], key=lambda c: c.cost)
    table = Table(title=f"{integrator}, {WIDTH} x {HEIGHT}, {SPP} spp: efficiency = 1 / (relMSE x time)")
    for column in (
        "contender",
        "time s",
        "median s",
        "relMSE x spp",
        "vs independent",
        f"vs {strongest.name[9:]}",
        "mean",
    ):
        table.add_column(column, justify="left" if column == "contender" else "right")
    for c in field:
        error = np.std(c.means, ddof=1) / np.sqrt(len(c.means)) / np.mean(c.means)
        table.add_row(
            c.name,
            f"{c.time:.3f}",
            f"{np.median(c.times):.3f}",
            f"{c.error * (16 if '16 spp' in c.name else SPP):.4f}",
            f"{baseline.cost / c.cost:.2f} x",
            f"{strongest.cost / c.cost:.2f} x",
            f"{np.mean(c.means) / best.mean():.4f} +- {error:.4f}",
        )
    console.print(table)
    bars = {"direct": (12, 1.1), "path": (1.5, 1.1)}[integrator]
    ours = field[len(NATIVE_SAMPLERS)]
    verdict(f"{integrator}: vs independent", baseline.cost / ours.cost, bars[0])
    verdict(f"{integrator}: vs its best sampler", strongest.cost / ours.cost, bars[1])
    if args.denoise and integrator == "path":
        verdict("path at 16 spp, denoised: vs independent", baseline.cost / field[-1].cost, 25)


def verdict(what: str, ratio: float, bar: float, at_most: bool = False) -> None:
    met = ratio <= bar if at_most else ratio >= bar
    console.print(f"{'met ' if met else 'MISSED'} {what}: {ratio:.2f} x (bar: {'<=' if at_most else '>='} {bar} x)")


BY_EMBREE = "rays, by Embree"  # as Mitsuba traces them, and as Gonio did before kernels intersected simple shapes


class _Stage(LightTransport):
    """directSampleLight ended early, to see where its time goes. Later stages trace the same rays and add work."""

    stage = "rays"

    def sample(self, pixel: Any, key: Any, index: Any) -> Any:
        ray, _, hit = self.first_hit(pixel, key, index)
        if self.stage == "camera rays":
            return [dr.select(hit.is_valid(), hit.t, 0), mi.Float(0), mi.Float(0)]
        u = mi.Point2f(*self.pair(key, index, 3))
        if self.stage == "rays":  # shadow rays to uniform points on the lamp, from the bare hit point
            lamp = self.lights.lamps.rectangle
            point = lamp.corner + lamp.axis0 * (u.x * lamp.length0) + lamp.axis1 * (u.y * lamp.length1)
            origin = ray(hit.t * (1 - 1e-4))
            away = point - origin
            shadow = mi.Ray3f(origin, away, 0.999, ray.time, ray.wavelengths)
            shadowed = self.surfaces.blocked(shadow, hit.is_valid())
            return [dr.select(shadowed, 0, mi.Float(1)), mi.Float(0), mi.Float(0)]
        si = self.surfaces.interaction(hit, ray)
        light = self.lights.sample(si, u, si.is_valid())
        lit = si.is_valid() & (mi.Frame3f.cos_theta(si.to_local(light.ds.d)) > 0)
        lit &= ~self.surfaces.blocked(si.spawn_ray_to(light.target), lit)
        return list(dr.select(lit, light.weight, 0))


def stages(bsdf: Any, rounds: int, clock: Callable[[], float]) -> None:
    def cut(name: str) -> Callable[[int], np.ndarray]:
        drawn = scene(bsdf)

        def draw(seed: int) -> np.ndarray:
            render = Render(drawn, Settings("directSampleLight", seed=seed))
            stage = "rays" if name == BY_EMBREE else name
            render._integrator = type("Cut", (_Stage,), {"stage": stage})(render._integrator.data, render.settings)
            if name == BY_EMBREE:
                render._integrator.surfaces.inline = None
            render.advance(SPP)
            return render.image()

        return draw

    field = [Contender(name, cut(name)) for name in ("camera rays", "rays", BY_EMBREE, "+ surface, light")]
    field += [Contender(n, gonio(bsdf, integrator=n)) for n in ("directSampleLight", "direct", "path")]
    compete(field, rounds, clock, None)
    table = Table(title=f"where the time goes, {SPP} spp")
    for column in ("stage", "time s", "M samples/s", "over rays only"):
        table.add_column(column, justify="left" if column == "stage" else "right")
    rays = field[1].time
    for c in field:
        table.add_row(c.name, f"{c.time:.3f}", f"{WIDTH * HEIGHT * SPP / c.time / 1e6:.0f}", f"{c.time / rays:.2f} x")
    console.print(table)
    verdict("directSampleLight over rays only, by Embree", field[4].time / field[2].time, 1.6, at_most=True)
    verdict("directSampleLight over rays only, in the kernel", field[4].time / rays, 1.6, at_most=True)


def inside_mitsuba(rounds: int, clock: Callable[[], float]) -> None:
    for integrator in ("direct", "path"):
        pair = [Contender(n, mitsuba(b, "independent", integrator)) for n, b in (("native", native), ("Gonio", plugin))]
        compete(pair, rounds, clock, None)
        ratio = np.mean(pair[1].means) / np.mean(pair[0].means)
        verdict(f"Gonio's plugin in Mitsuba's own {integrator}, time", pair[1].time / pair[0].time, 1.1, at_most=True)
        console.print(f"     same picture: ratio of means {ratio:.5f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bsdf", choices=("native", "gonio"), default="native")
    parser.add_argument("--denoise", action="store_true", help="also path at 16 spp with Open Image Denoise")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--clock", choices=("wall", "cpu"), default="wall")
    args = parser.parse_args()

    def clock() -> float:
        return time.perf_counter() if args.clock == "wall" else time.process_time() / dr.thread_count()

    cpu = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), cpu)
    console.print(
        f"{cpu}, {dr.thread_count()} threads, {mi.variant()}, Mitsuba {mi.__version__}, Dr.Jit {dr.__version__}"
    )
    import gonio.mitsuba  # noqa: F401  (registers the plugins)

    bsdf, name = (native, "roughconductor") if args.bsdf == "native" else (plugin, "gonio_conductor")
    for integrator in ("direct", "path"):
        versus(integrator, bsdf, name, args, clock)
    stages(bsdf, args.rounds, clock)
    if args.bsdf == "gonio":
        inside_mitsuba(args.rounds, clock)


if __name__ == "__main__":
    main()
