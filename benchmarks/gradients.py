"""Derivatives of a picture with respect to material parameters: Gonio's `Gradients` against Mitsuba's `prb`.

    python benchmarks/gradients.py

A gold ball on a colored floor under a small lamp and a sky, 160 x 120. `prb` uses Mitsuba's own materials
(roughconductor, diffuse) and its best sampler. Two comparisons:

forward   the derivative picture with respect to one value: variance (mean over pixels) x time; `prb` in forward mode
reverse   the derivative of a loss, sum(adjoint x picture), with respect to seven numbers at once: `prb` in reverse mode
          computes them by tracing paths forward and back once; Gonio sums its derivative pictures

Time is that of the render only, with cached kernels; variances are among runs with different seeds. The two means must
agree within their errors (for `prb` with independent samples, since runs of ldsampler are not independent).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from gonio.bridge import engine
from rich.console import Console
from rich.table import Table

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)
from gonio.bridge import adapter  # noqa: E402
from gonio.transport.gradients import Along, Gradients  # noqa: E402
from gonio.transport.integrators import Settings  # noqa: E402

SIZE, SPP, DEPTH, RUNS = (160, 120), 64, 5, 16
SAMPLERS = ("independent", "stratified", "multijitter", "ldsampler")
ETA, K, ALPHA, ALBEDO = [0.2, 0.9, 1.1], [3.9, 2.4, 2.2], 0.3, [0.6, 0.5, 0.2]
VALUES = ("alpha", "eta", "albedo")


def rgb(value: object) -> dict[str, object]:
    return {"type": "rgb", "value": value}


def scene(metal: dict[str, object], matt: dict[str, object], sampler: str) -> mi.Scene:
    T = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    lamp = T().look_at([-2, 4, 2], [0, 0.5, 0], [0, 1, 0]).scale(0.5)
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": 35,
                "to_world": T().look_at([0, 1.5, 5], [0, 0.8, 0], [0, 1, 0]),
                "film": film,
                "sampler": {"type": sampler, "sample_count": SPP},
            },
            "ball": {"type": "sphere", "center": [0, 1, 0], "radius": 1, "bsdf": metal},
            "floor": {
                "type": "rectangle",
                "to_world": T().rotate([1, 0, 0], -90).scale(4),
                "bsdf": matt,
            },
            "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": rgb([20, 20, 20])}},
            "sky": {"type": "constant", "radiance": rgb([0.3, 0.35, 0.4])},
        }
    )


KEYS = {"alpha": "ball.bsdf.alpha.value", "eta": "ball.bsdf.eta.value", "albedo": "floor.bsdf.reflectance.value"}


def theirs(sampler: str) -> tuple[mi.Scene, mi.SceneParameters]:
    metal = {"type": "roughconductor", "eta": rgb(ETA), "k": rgb(K), "alpha": ALPHA, "distribution": "ggx"}
    loaded = scene(metal, {"type": "diffuse", "reflectance": rgb(ALBEDO)}, sampler)
    return loaded, mi.traverse(loaded)


def forward_of_theirs(sampler: str, name: str) -> Callable[[int], np.ndarray]:
    loaded, found = theirs(sampler)
    method = mi.load_dict({"type": "prb", "max_depth": DEPTH, "rr_depth": 5})

    def draw(seed: int) -> np.ndarray:
        value = type(found[KEYS[name]])(dr.detach(found[KEYS[name]]))
        dr.enable_grad(value)
        found[KEYS[name]] = value
        found.update()
        image = mi.render(loaded, found, integrator=method, spp=SPP, seed=seed)
        dr.set_grad(value, 1)
        slope = np.array(dr.forward_to(image))
        dr.disable_grad(value)
        return slope

    return draw


def reverse_of_theirs(sampler: str, adjoint: np.ndarray) -> Callable[[int], np.ndarray]:
    loaded, found = theirs(sampler)
    method = mi.load_dict({"type": "prb", "max_depth": DEPTH, "rr_depth": 5})

    def draw(seed: int) -> np.ndarray:
        values = []
        for name in VALUES:
            value = type(found[KEYS[name]])(dr.detach(found[KEYS[name]]))
            dr.enable_grad(value)
            found[KEYS[name]] = value
            values.append(value)
        found.update()
        image = mi.render(loaded, found, integrator=method, spp=SPP, seed=seed)
        dr.backward(dr.sum(image * mi.TensorXf(adjoint), axis=None))
        grown = np.concatenate([np.array(dr.grad(value), float).ravel() for value in values])
        dr.disable_grad(values)
        return grown

    return draw


def ours(names: Sequence[str], channels: bool = False) -> Callable[[int], np.ndarray]:
    adapter.register(mi)
    metal = {"type": "gonio_conductor", "eta": rgb(ETA), "k": rgb(K), "alpha": ALPHA, "masking": "smith-separable"}
    loaded = scene(metal, {"type": "gonio_lambert", "albedo": rgb(ALBEDO)}, "independent")
    plugins = {shape.id(): shape.bsdf() for shape in loaded.shapes()}
    metal_at, matt_at = plugins["ball"], plugins["floor"]
    along = []
    for name in names:
        plugin = matt_at if name == "albedo" else metal_at
        split = channels and name != "alpha"
        along += [Along(plugin, name, channel) for channel in range(3)] if split else [Along(plugin, name)]

    def draw(seed: int) -> np.ndarray:
        render = Gradients(loaded, Settings("path", DEPTH, seed=seed), along)
        render.advance(SPP)
        return np.array(render.slopes())

    return draw


def measured(draw: Callable[[int], np.ndarray]) -> tuple[np.ndarray, float]:
    """Runs with different seeds, and the shortest time of one."""
    draw(999)
    found, times = [], []
    for seed in range(RUNS):
        begin = time.perf_counter()
        found.append(draw(seed))
        times.append(time.perf_counter() - begin)
    return np.array(found, float), min(times)


def sigmas(a: np.ndarray, b: np.ndarray) -> float:
    """The difference between the means of whole pictures, or of sums, in standard errors."""
    a, b = (x.reshape(RUNS, -1, 3).mean(1) if x.ndim > 2 else x for x in (a, b))
    error = np.sqrt(a.var(0, ddof=1) / RUNS + b.var(0, ddof=1) / RUNS)
    return float(np.abs((a.mean(0) - b.mean(0)) / error).max())


def main() -> None:
    console = Console()
    table = Table(title=f"{SIZE[0]} x {SIZE[1]}, {SPP} samples: variance x time, Gonio's over prb's (less is better)")
    for column in ("derivative", "Gonio [s]", "prb [s]", "variance", "prb's best", "sampler", "ratio", "sigma apart"):
        table.add_column(column, justify="right")

    def row(name: str, mine: Callable[[int], np.ndarray], others: dict[str, Callable[[int], np.ndarray]]) -> None:
        found, seconds = measured(mine)
        cost = found.var(0, ddof=1).mean() * seconds
        rivals = {sampler: measured(draw) for sampler, draw in others.items()}
        best = min(rivals, key=lambda s: rivals[s][0].var(0, ddof=1).mean() * rivals[s][1])
        their, their_seconds = rivals[best]
        variance = their.var(0, ddof=1).mean()
        cells = [
            name,
            f"{seconds:.3f}",
            f"{their_seconds:.3f}",
            f"{found.var(0, ddof=1).mean():.3g}",
            f"{variance:.3g}",
        ]
        cells += [best, f"{cost / (variance * their_seconds):.3f}", f"{sigmas(found, rivals['independent'][0]):.1f}"]
        table.add_row(*cells)
        console.print(" | ".join(cells))

    for name in VALUES:
        draw = ours([name])
        row(name, lambda seed, draw=draw: draw(seed)[0], {s: forward_of_theirs(s, name) for s in SAMPLERS})
    rng = np.random.default_rng(4)
    waves = rng.normal(size=(4, 3))
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]] / 40.0
    adjoint = np.stack([np.cos(waves[0, c] * x + waves[1, c] * y + waves[2, c]) for c in range(3)], -1).astype(
        np.float32
    )
    all_of = ours(VALUES, channels=True)

    def summed(seed: int) -> np.ndarray:
        return np.asarray(np.sum(all_of(seed).astype(float) * adjoint, (1, 2, 3)))

    row("7 of a loss", summed, {s: reverse_of_theirs(s, adjoint) for s in SAMPLERS})
    console.print(table)


if __name__ == "__main__":
    main()
