"""Throughput of eval, pdf and sample: Gonio's plugins against Mitsuba's own, side by side in one process.

    python benchmarks/bsdf.py [--pairs 16] [--rounds 7] [--check-samples 0]

Both read the same directions from memory and write their results to memory. The two alternate, and the ratio is the
median over the rounds. `--check-samples N` also draws N million samples of every material and counts values that are
not finite.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time

import gonio.mitsuba  # noqa: F401  registers the plugins
import drjit as dr
import mitsuba as mi

ETA = {"type": "rgb", "value": [0.15494, 0.11648, 0.13809]}
K = {"type": "rgb", "value": [4.81810, 3.11562, 2.14240]}

PAIRS = {
    "conductor ggx": (
        {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3, "eta": ETA, "k": K},
        {"type": "gonio_conductor", "ndf": "ggx", "masking": "smith-separable", "alpha": 0.3, "eta": ETA, "k": K},
    ),
    "conductor beckmann": (
        {"type": "roughconductor", "distribution": "beckmann", "alpha": 0.3, "eta": ETA, "k": K},
        {"type": "gonio_conductor", "ndf": "beckmann", "masking": "smith-separable", "alpha": 0.3, "eta": ETA, "k": K},
    ),
    "dielectric ggx": (
        {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.3, "int_ior": 1.5, "ext_ior": 1.0},
        {"type": "gonio_dielectric", "ndf": "ggx", "masking": "smith-separable", "alpha": 0.3, "eta": 1.5},
    ),
    "diffuse": (
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.4, 0.3]}},
        {"type": "gonio_lambert", "albedo": {"type": "rgb", "value": [0.5, 0.4, 0.3]}},
    ),
}


def directions(count: int, seed: int, both_sides: bool):
    """Uniform unit vectors, evaluated."""
    rng = mi.PCG32(size=count, initstate=seed)
    w = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    if not both_sides:
        w.z = dr.abs(w.z)
    dr.eval(w)
    return w


def timed(run) -> float:
    dr.sync_thread()
    start = time.perf_counter()
    dr.eval(run())
    dr.sync_thread()
    return time.perf_counter() - start


def compare(name: str, count: int, rounds: int) -> list[tuple[str, float, float, float]]:
    """(what, native M/s, Gonio M/s, median ratio) for eval, pdf and sample."""
    native, ours = (mi.load_dict(d) for d in PAIRS[name])
    both = "dielectric" in name
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = directions(count, 1, both)
    wo = directions(count, 2, both)
    rng = mi.PCG32(size=count, initstate=3)
    u1, u2 = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    dr.eval(si, u1, u2)
    ctx = mi.BSDFContext()

    def sample(bsdf):
        bs, weight = bsdf.sample(ctx, si, u1, u2)
        return bs.wo, bs.pdf, weight

    jobs = {
        "eval": lambda bsdf: bsdf.eval(ctx, si, wo),
        "pdf": lambda bsdf: bsdf.pdf(ctx, si, wo),
        "sample": sample,
    }
    rows = []
    for what, job in jobs.items():
        times: dict[str, list[float]] = {"native": [], "gonio": []}
        for turn in range(rounds + 1):
            for label, bsdf in (("native", native), ("gonio", ours)):
                elapsed = timed(lambda bsdf=bsdf, job=job: job(bsdf))
                if turn:
                    times[label].append(elapsed)
        ratio = statistics.median(n / g for n, g in zip(times["native"], times["gonio"], strict=True))
        best = {label: count / min(t) / 1e6 for label, t in times.items()}
        rows.append((what, best["native"], best["gonio"], ratio))
    return rows


def count_non_finite(millions: int) -> None:
    """Draw samples of every material with difficult alphas and indices, and count values that are not finite."""
    metal = {"type": "gonio_conductor", "preset": "Au"}
    glass = {"type": "gonio_dielectric"}
    cases = [{**metal, "alpha": a, "ndf": n} for n in ("ggx", "beckmann", "student-t") for a in (0.001, 0.1, 1.0)]
    cases += [
        {**glass, "alpha": a, "eta": e, "ndf": n}
        for n in ("ggx", "beckmann")
        for a in (0.001, 0.3)
        for e in (1.01, 1.5)
    ]
    cases += [{"type": f"gonio_{name}"} for name in ("phong", "blinn_phong", "oren_nayar")]
    chunk, total, bad = 1 << 22, 0, 0
    for number in range(max(1, round(millions * 1e6 / chunk / len(cases)))):
        for case in cases:
            bsdf = mi.load_dict(case)
            si = dr.zeros(mi.SurfaceInteraction3f, chunk)
            rng = mi.PCG32(size=chunk, initstate=number * 977 + 5)
            si.wi = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
            u = [rng.next_float32() for _ in range(3)]
            bs, weight = bsdf.sample(mi.BSDFContext(), si, u[0], mi.Point2f(u[1], u[2]))
            value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, bs.wo)
            fine = dr.isfinite(bs.pdf) & dr.all(dr.isfinite(weight)) & dr.all(dr.isfinite(bs.wo))
            fine &= dr.isfinite(pdf) & dr.all(dr.isfinite(value)) & dr.all(value >= 0)
            here = int(dr.count(~fine)[0])
            if here:
                print(f"  {here} not finite: {case}")
            bad += here
            total += chunk
    print(f"non-finite or negative values in {total / 1e6:.0f} M samples: {bad}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=float, default=16, help="millions of direction pairs")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--check-samples", type=int, default=0, metavar="MILLIONS")
    options = parser.parse_args()
    machine = f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores"
    print(f"{machine}, Mitsuba {mi.__version__}, {mi.variant()}")
    print(f"{options.pairs:g} M pairs, {options.rounds} turns; rates in M/s, ratio = Gonio's rate over Mitsuba's")
    print(f"{'material':20} {'what':8} {'Mitsuba':>9} {'Gonio':>9} {'ratio':>7}")
    for name in PAIRS:
        for what, native, ours, ratio in compare(name, int(options.pairs * 1e6), options.rounds):
            print(f"{name:20} {what:8} {native:9.1f} {ours:9.1f} {ratio:7.2f}")
    if options.check_samples:
        count_non_finite(options.check_samples)


if __name__ == "__main__":
    main()
