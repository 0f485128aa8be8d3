"""Measure the speed of ray tracing, of a material and of two integrators on this machine, and compare it to Mitsuba's.

    gonio doctor --bench

Gonio and Mitsuba run alternately in the same process, so that other load affects both equally. The result is the best
of several rounds after compilation.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from types import ModuleType

from ..bridge import engine
from ..bridge.types import BSDFPlugin, PluginDict, Scene

LANES = {"llvm": 1 << 20, "cuda": 1 << 25}  # a GPU would finish a million lanes before Python launches the next kernel
SIZE, SPP = {"llvm": 256, "cuda": 1024}, 16
ROUNDS = 5
_ETA, _K = [0.15494, 0.11648, 0.13809], [4.81810, 3.11562, 2.14240]  # gold at three wavelengths, as in `benchmarks`


@dataclass(frozen=True)
class Row:
    """A row of the table: a task, and its speed in millions per second in Gonio and in Mitsuba.

    `gonio` is 0 if the task exists only in Mitsuba.
    """

    what: str
    gonio: float
    mitsuba: float

    def as_dict(self) -> dict[str, object]:
        return asdict(self)


def measure(device: str = "cpu") -> tuple[str, list[Row]]:
    """Measure the speed. Returns a description of the machine, and the table.

    device  "cpu", "cuda" or "auto"
    Raises MachineError if the device is missing.
    """
    mi = engine.load(device)
    lanes, size = (by_kind[mi.variant()[:4]] for by_kind in (LANES, SIZE))
    import drjit as dr

    from ..bridge import adapter
    from ..transport.integrators import Render, Settings
    from ..transport.lights import lights

    adapter.register(mi)
    lights.register(mi)
    ours, theirs = _scene(mi, "gonio_conductor", size), _scene(mi, "roughconductor", size)

    def rays() -> None:
        ray, _ = theirs.sensors()[0].sample_ray(0.0, 0.5, mi.Point2f(u, v), mi.Point2f(0.5))
        dr.eval(theirs.ray_intersect(ray).t)

    rng = mi.PCG32(lanes)
    u, v = mi.Float(rng.next_float32()), mi.Float(rng.next_float32())
    dr.eval(u, v)
    rows = [Row("rays", 0.0, _best(dr, lanes, rays)[0])]
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, v))
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(v, u))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    dr.eval(si, wo)
    both = [scene.shapes()[0].bsdf() for scene in (ours, theirs)]
    context = mi.BSDFContext()

    def evaluated(bsdf: BSDFPlugin) -> Callable[[], None]:
        return lambda: dr.eval(bsdf.eval(context, si, wo))

    def sampled(bsdf: BSDFPlugin) -> Callable[[], None]:
        return lambda: dr.eval(bsdf.sample(context, si, u, mi.Point2f(u, v))[1])

    rows.append(Row("eval", *_best(dr, lanes, *map(evaluated, both))))
    rows.append(Row("sample", *_best(dr, lanes, *map(sampled, both))))
    for name, depth, own in (("direct", 2, {"type": "direct"}), ("path", 5, {"type": "path", "max_depth": 5})):
        render = Render(ours, Settings(name, max_depth=depth))
        integrator = mi.load_dict(own)
        pair = (
            lambda render=render: render.advance(SPP),
            lambda integrator=integrator: dr.eval(mi.render(theirs, integrator=integrator, spp=SPP)),
        )
        rows.append(Row(name, *_best(dr, size * size * SPP, *pair)))
    return f"{mi.variant()}, {dr.thread_count()} threads", rows


def _best(dr: ModuleType, count: int, *tasks: Callable[[], None]) -> list[float]:
    """The speed of each task in millions per second; the tasks are timed alternately."""
    least = [float("inf")] * len(tasks)
    for task in tasks:  # compile
        task()
        dr.sync_thread()
    for _ in range(ROUNDS):
        for number, task in enumerate(tasks):
            began = time.perf_counter()
            task()
            dr.sync_thread()
            least[number] = min(least[number], time.perf_counter() - began)
    return [count / seconds / 1e6 for seconds in least]


def _scene(mi: ModuleType, bsdf: str, size: int) -> Scene:
    """A scene with a gold ball on a gray floor under a square lamp."""
    to = mi.ScalarTransform4f
    gold: PluginDict = {"type": bsdf, "alpha": 0.2}
    gold |= {name: {"type": "rgb", "value": value} for name, value in (("eta", _ETA), ("k", _K))}
    gold |= {"ndf": "ggx", "masking": "smith-separable"} if bsdf.startswith("gonio") else {"distribution": "ggx"}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "to_world": to().look_at([0, 2, 5], [0, 0.8, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
            },
            "ball": {"type": "sphere", "center": [0, 1, 0], "bsdf": gold},
            "floor": {"type": "rectangle", "to_world": to().rotate([1, 0, 0], -90) @ to().scale(6)},
            "lamp": {
                "type": "rectangle",
                "to_world": to().translate([0, 4, 0]) @ to().rotate([1, 0, 0], 90),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 8.0}},
            },
        }
    )
