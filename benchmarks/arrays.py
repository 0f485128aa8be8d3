"""Time of eval, pdf and sample on NumPy arrays, compared with Mitsuba's rough conductor on the same arrays.

    python benchmarks/arrays.py [--pairs 10000000]

Both take float32 NumPy arrays (N, 3) and return NumPy arrays. Times are the minimum of five calls; the calls alternate,
so that other programs affect both alike. `arrays` is Mitsuba's call on arrays that are already Dr.Jit's.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import gonio as go
import drjit as dr
import mitsuba as mi
import numpy as np

RUNS = 5


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    w = rng.normal(size=(count, 3)).astype(np.float32)
    w[:, 2] = np.abs(w[:, 2]) + 0.01
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def best(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """The shortest time of each call in seconds, excluding the first."""
    times = dict.fromkeys(calls, np.inf)
    for run in range(RUNS + 1):
        for name, call in calls.items():
            started = time.perf_counter()
            call()
            if run:
                times[name] = min(times[name], time.perf_counter() - started)
    return times


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", type=int, default=10_000_000)
    count = parser.parse_args().pairs
    mi.set_variant("llvm_ad_rgb")
    rng = np.random.default_rng(1)
    wo, wi, u = directions(rng, count), directions(rng, count), rng.random((count, 3), np.float32)
    metal = go.Conductor(alpha=0.3, eta=0.2, k=3.0)
    properties = {"eta": {"type": "rgb", "value": 0.2}, "k": {"type": "rgb", "value": 3.0}}
    plugin = mi.load_dict({"type": "roughconductor", "alpha": 0.3, "distribution": "ggx", **properties})
    context = mi.BSDFContext()

    def at(w: object) -> mi.SurfaceInteraction3f:
        si = mi.SurfaceInteraction3f()
        si.wi = w if isinstance(w, mi.Vector3f) else mi.Vector3f(np.ascontiguousarray(np.asarray(w).T))
        return si

    given, lit = mi.Vector3f(np.ascontiguousarray(wo.T)), mi.Vector3f(np.ascontiguousarray(wi.T))

    def sampled() -> None:
        numbers = np.ascontiguousarray(u.T)
        drawn, weight = plugin.sample(context, at(wo), mi.Float(numbers[0]), mi.Point2f(numbers[1:]))
        for value in (drawn.wo, weight, drawn.pdf):
            value.numpy()

    def on_arrays() -> None:
        dr.eval(plugin.eval(context, at(given), lit))
        dr.sync_thread()

    rows = {
        "eval": best({
            "Gonio": lambda: metal.eval(wo, wi),
            "Mitsuba": lambda: plugin.eval(context, at(wo), at(wi).wi).numpy().T.copy(),
            "arrays": on_arrays,
        }),
        "pdf": best({
            "Gonio": lambda: metal.pdf(wo, wi),
            "Mitsuba": lambda: plugin.pdf(context, at(wo), at(wi).wi).numpy(),
        }),
        "sample": best({"Gonio": lambda: metal.sample(wo, u), "Mitsuba": sampled}),
    }  # fmt: skip
    print(f"{count:,} pairs, s       Gonio  Mitsuba   ratio")
    for name, times in rows.items():
        print(f"{name:20} {times['Gonio']:8.3f} {times['Mitsuba']:8.3f} {times['Gonio'] / times['Mitsuba']:7.2f}")
    print(f"Mitsuba's eval on Dr.Jit's arrays {rows['eval']['arrays']:.3f} s, ratio "
          f"{rows['eval']['Gonio'] / rows['eval']['arrays']:.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
