"""The figures of docs/energy.md: tables, furnaces, the walk, and the cost of compensation.

    python benchmarks/energy.py [--pairs 16] [--walks 10]

Prints one line a bar with what was measured. Times are the best of several.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time

import gonio as go
import numpy as np
from gonio.energy import bake, monte_carlo, quadrature, walk
from gonio.ops import backend

CENTRES = (np.arange(128) + 0.5) / 128
MU, ROUGHNESS = np.meshgrid(CENTRES, CENTRES)
MASKINGS = ("smith-correlated", "smith-separable", "schlick-direct", "schlick-ibl")


def best(job, rounds: int = 5) -> float:
    """Seconds of the fastest of several runs, after one to compile."""
    job()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return min(times)


def tables() -> None:
    print("E, 128 x 128, roughness >= .05: error against (110, 90) nodes; E_avg; time with its own error estimate")
    rough = ROUGHNESS >= 0.05
    for ndf in ("ggx", "beckmann", "student-t"):
        for masking in MASKINGS:
            fine = quadrature.moments(ndf, masking, MU, ROUGHNESS**2, nodes=(110, 90)).whole
            baked = bake.bake(ndf, ["E"], masking=masking)
            error = np.abs(baked.arrays["E"] - fine)[rough].max()
            seconds = best(lambda ndf=ndf, masking=masking: bake.bake(ndf, ["E"], masking=masking), 3)
            exact = quadrature.average(ndf, masking, CENTRES**2, nodes=(90, 70), count=96)
            average = np.abs(quadrature.average(ndf, masking, CENTRES**2) - exact).max()
            figures = baked.manifest["error"]["E"]
            stretched = bake.bake(ndf, ["E"], masking=masking, layout="stretched").manifest["error"]["E"]
            print(
                f"  {ndf:10} {masking:17} max {error:.1e} (manifest {figures['max']:.1e})  E_avg {average:.1e}  "
                f"{seconds:.2f} s  between nodes {figures['interpolation']:.1e} linear, "
                f"{stretched['interpolation']:.1e} stretched"
            )


def fresh_process() -> None:
    code = "from gonio.energy.bake import bake; bake('ggx', ['E'])"
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    print(f"the first table in a fresh process, imports included: {time.perf_counter() - start:.2f} s")


def against_sampling() -> None:
    exact = quadrature.moments("ggx", "smith-correlated", MU, ROUGHNESS**2, nodes=(110, 90)).whole
    ways = {
        "quadrature": lambda: quadrature.moments("ggx", "smith-correlated", MU, ROUGHNESS**2).whole,
        "ggx, 1024 independent": lambda: (
            monte_carlo.estimate("ggx", "smith-correlated", MU, ROUGHNESS**2, "ggx", 1024, "independent").value
        ),
    }
    product = {}
    for name, way in ways.items():
        rms = np.sqrt(np.mean((way() - exact)[ROUGHNESS >= 0.05] ** 2))
        seconds = best(way)
        product[name] = rms**2 * seconds
        print(f"  {name:22} rms {rms:.1e}, {seconds:.3f} s, rms^2 x time {product[name]:.1e}")
    first, second = product.values()
    print(f"  ratio {second / first:.1e}")
    for masking in MASKINGS:
        found = monte_carlo.estimate("ggx", masking, MU, ROUGHNESS**2, "ggx", 1024).value
        truth = quadrature.moments("ggx", masking, MU, ROUGHNESS**2).whole
        rms = np.sqrt(np.mean((found - truth)[ROUGHNESS >= 0.1] ** 2))
        print(f"  Hammersley, 1024 samples, {masking:17} rms {rms:.4f} (roughness >= .1)")


def furnaces() -> None:
    mu = np.array([0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0])
    for masking in ("smith-correlated", "smith-separable"):
        for ndf in ("ggx", "beckmann"):
            values = [
                go.albedo(go.KullaConty(go.Conductor(alpha=r * r, ndf=ndf, masking=masking, fresnel="one")), mu).value
                for r in np.linspace(0.05, 1.0, 20)
            ]
            print(f"  metal {ndf:9} {masking:17} {np.min(values):.5f} .. {np.max(values):.5f}")
    for eta in (1.5, 1.33, 2.4, 1.1):
        for masking in ("smith-correlated", "smith-separable"):
            values = [
                go.albedo(go.KullaConty(go.Dielectric(eta, a, masking=masking)), np.concatenate([mu, -mu])).value
                for a in np.linspace(0.05, 1.0, 12)
            ]
            print(f"  glass eta {eta:4} {masking:17} {np.min(values):.5f} .. {np.max(values):.5f}")


def random_walk(millions: float) -> None:
    gold = go.Conductor.preset("Au", alpha=0.8)
    count = int(millions * 1e6)
    for mu in (0.2, 0.6, 1.0):
        mean, error = walk.albedo(gold, mu, count // 3)
        ways = {c: go.albedo(go.KullaConty(gold, color=c), mu).value[0] for c in ("sheet", "bounce")}
        text = ", ".join(f"{name} {np.round(value, 4)}" for name, value in ways.items())
        print(f"  gold alpha .8, mu {mu}: walk {np.round(mean, 4)} +- {error.max():.0e}, {text}")
    for base in (go.Conductor(alpha=0.8, fresnel="one"), go.Dielectric(1.5, 0.5)):
        drawn = go.albedo(go.RandomWalk(base), 0.6, method="sampling", samples=count)
        away = abs(drawn.value[0, 0] - 1.0) / drawn.error[0, 0]
        print(f"  furnace of {base.name}, {count:.0e} walks by eval: {drawn.value[0, 0]:.5f}, {away:.1f} sigma from 1")


def costs(millions: float) -> None:
    dr = backend.drjit()
    kind = backend.types("float32")
    count = int(millions * (1 << 20))
    rng = np.random.default_rng(0)

    def directions():
        z, phi = kind.float(rng.random(count, np.float32)), kind.float(6.2831853 * rng.random(count, np.float32))
        r = dr.sqrt(1.0 - z * z)
        w = kind.vec3(r * dr.cos(phi), r * dr.sin(phi), z)
        dr.eval(w)
        return w

    wo, wi = directions(), directions()
    plain = go.Conductor.preset("Au", alpha=0.3)
    ways = {"plain": plain, "kulla-conty": go.KullaConty(plain), "turquin": go.Turquin(plain)}
    times: dict[str, list[float]] = {name: [] for name in ways}
    for turn in range(25):
        for name, model in ways.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(model.eval(wo, wi))
            dr.sync_thread()
            if turn > 1:
                times[name].append(time.perf_counter() - start)
    for name, found in times.items():
        ratios = np.array(found) / np.array(times["plain"])
        print(
            f"  {name:12} {count / min(found) / 1e6:6.1f} M/s, time over plain: "
            f"best {min(found) / min(times['plain']):.2f}, median of pairs {np.median(ratios):.2f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=float, default=16, help="millions of direction pairs")
    parser.add_argument("--walks", type=float, default=10, help="millions of random walks")
    options = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    fresh_process()
    tables()
    print("Quadrature against sampling, GGX, smith-correlated")
    against_sampling()
    print("White furnace, roughness .05 to 1 (glass: alpha .05 to 1, both sides), mu .05 to 1")
    furnaces()
    print("The random walk")
    random_walk(options.walks)
    print(f"eval of {options.pairs:g} M pairs")
    costs(options.pairs)


if __name__ == "__main__":
    main()
