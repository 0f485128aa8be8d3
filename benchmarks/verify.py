"""The cost and the reliability of the verifier, in one table per question.

    python benchmarks/verify.py [--only time,speed,controls,alarms,uniform] [--seeds 20] [--uniform-seeds 100]

time      `gonio verify conductor` as a whole process, default and --quick, after one run that fills the kernel cache
speed     samples per second of the chi-square test (sampling, binning, counting) for a GGX conductor
controls  each deliberately wrong BSDF in tests/broken, and the law that caught it
alarms    failed verdicts of all laws with --quick, for every correct model and many seeds
uniform   p-values of the chi-square test of a correct model over many seeds, by a Kolmogorov-Smirnov test
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.verify import cells, directions, expectation, histogram, subject, verify
from scipy import stats

ROOT = Path(__file__).parents[1]


def correct() -> dict[str, go.BSDF]:
    """Every model, and variants with choices that matter to the laws."""
    found = {
        "lambert": go.Lambert((0.2, 0.5, 0.9)),
        "oren-nayar": go.OrenNayar(0.8, 0.4),
        "phong": go.Phong((0.3, 0.4, 0.5), 0.3, 20.0),
        "blinn-phong": go.BlinnPhong(0.2, (0.4, 0.5, 0.6), 60.0),
        "mirror": go.Mirror(0.9),
        "conductor": go.Conductor.preset("Au", alpha=0.2),
        "conductor rough, bounded": go.Conductor.preset("Cu", alpha=0.8, sampling="bounded"),
        "conductor beckmann": go.Conductor.preset("Ag", alpha=0.1, ndf="beckmann"),
        "conductor student-t": go.Conductor.preset("Fe", alpha=0.3, ndf="student-t", masking="smith-separable"),
        "conductor brushed": go.Conductor.preset("Al", alpha=(0.1, 0.5), rotation=0.4),
        "dielectric": go.Dielectric(1.5, 0.2),
        "dielectric smooth": go.Dielectric(1.5, 0.0),
        "dielectric bubble": go.Dielectric(0.7, 0.3, ndf="beckmann"),
        "metal": go.Metal((1.0, 0.8, 0.4), (0.9, 1.0, 0.7), alpha=0.3),
        "film-conductor": go.FilmConductor.preset("Au", alpha=0.2, thickness=400.0),
        "film-dielectric": go.FilmDielectric(1.5, 0.2, form="belcour-barla"),
        "thin-dielectric": go.ThinDielectric(),
        "mix": go.mix(go.Lambert(0.5), go.Conductor.preset("Au", alpha=0.3), 0.3),
        "mix with mirror": go.mix(go.Mirror(), go.OrenNayar(0.7, 0.2), 0.6),
        "two-sided": go.two_sided(go.Conductor.preset("Fe", alpha=0.3)),
    }
    for name in ("disney", "eon", "modified-phong", "sheen", "sheen-charlie"):
        found[name] = go.model(name)()
    found["measured"] = go.model("measured")()
    found["sum"] = go.model("sum")(go.Lambert(0.4), go.Conductor.preset("Au", alpha=0.3))
    for name in ("ashikhmin-shirley", "cook-torrance", "he-torrance", "lafortune", "low-microfacet", "low-smooth"):
        found[name] = go.model(name)()
    for name in ("shifted-gamma", "ward", "ward-duer"):
        found[name] = go.model(name)()
    found["opacity"] = go.model("opacity")(go.Dielectric(1.5, 0.2), 0.3)
    found["normal-map"] = go.model("normal-map")(go.Conductor.preset("Au", alpha=0.3), 0.4, -0.2)
    found["bump"] = go.model("bump")(go.Lambert((0.8, 0.5, 0.2)), 0.5, 0.3)
    found["coat"] = go.model("coat")(go.Lambert((0.8, 0.5, 0.2)), absorption=(0.1, 0.3, 0.5))
    found["openpbr"] = go.OpenPBR(base_color=(0.7, 0.4, 0.2), coat_weight=0.5, fuzz_weight=0.2, specular_roughness=0.4)
    found["disney2015"] = go.model("disney2015")((0.7, 0.4, 0.2), roughness=0.4, clearcoat=0.5, sheen=0.3)
    if "kulla-conty" in go.models():
        found["kulla-conty"] = go.model("kulla-conty")(go.Conductor.preset("Au", alpha=0.6))
    return found


def times() -> None:
    for options in ([], ["--quick"]):
        command = [sys.executable, "-m", "gonio.cli", "verify", "conductor", *options]
        seconds = []
        for _ in range(4):
            start = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            seconds.append(time.perf_counter() - start)
        median = statistics.median(seconds[1:])
        print(f"gonio verify conductor {' '.join(options):8} {median:6.2f} s, first {seconds[0]:.2f} s")


def speed() -> None:
    wo = directions.single(directions.at(np.array([0, 15, 30, 45, 60, 75, 85, 89.5]), 20.0))
    for alpha in (0.005, 0.1, 1.0):
        one = subject.of(go.Conductor.preset("Au", alpha=alpha))
        grid = cells.place(one, wo, 1)
        seconds = []
        for seed in range(6):
            start = time.perf_counter()
            histogram.count(one, grid, 21, seed)
            seconds.append(time.perf_counter() - start)
        rate = (len(wo) << 21) / statistics.median(seconds[1:]) / 1e6
        print(
            f"chi-square, GGX conductor, alpha {alpha:<5} {rate:6.1f} M samples/s, binning included, 20 000 cells each"
        )


def controls() -> None:
    sys.path.insert(0, str(ROOT / "tests"))
    from broken.facets import FACETS
    from broken.glass import GLASS
    from broken.surfaces import SURFACES

    broken = [cls for cls in (*FACETS, *SURFACES, *GLASS) if cls.caught_by]
    caught = 0
    for cls in broken:
        report = verify(cls(), quick=True, law=[cls.caught_by])
        caught += not report.passed
        word = "MISSED" if report.passed else "caught"
        print(f"{cls.__name__:24} {cls.caught_by:12} {word} {report[cls.caught_by].shown}")
    print(f"negative controls caught by the intended law: {caught} of {len(broken)}")


def alarms(seeds: int) -> None:
    failed = 0
    models = correct()
    for name, model in models.items():
        start = time.perf_counter()
        bad = []
        for seed in range(1, seeds + 1):
            report = verify(model, quick=True, seed=seed)
            bad += [f"seed {seed}: {v.law}: {'; '.join(v.why)}" for v in report.failures]
        failed += len(bad)
        print(f"{name:28} {seeds} seeds, {len(bad)} failed verdicts, {time.perf_counter() - start:.1f} s", flush=True)
        for line in bad[:4]:
            print("    " + line, flush=True)
    print(f"false alarms: {failed} in {seeds} seeds x {len(models)} correct models")


def uniform(seeds: int) -> None:
    wo = directions.single(directions.at(np.array([30.0, 75.0]), 20.0))
    one = subject.of(go.Conductor.preset("Au", alpha=0.2))
    found: dict[str, list[float]] = {"fine": [], "coarse": [], "others": []}
    for seed in range(seeds):
        grid = cells.place(one, wo, seed)
        expected = expectation.expect(one, grid, 0.1 * 2.0**-9)
        counts = histogram.count(one, grid, 18, seed)
        for row in range(len(wo)):
            for kind, p in histogram.compare(expected, counts, row)._asdict().items():
                found[kind].append(p)
    for kind in ("fine", "coarse"):
        p = stats.kstest(found[kind], "uniform").pvalue
        print(f"p-values of {kind} cells, {len(found[kind])} tests: Kolmogorov-Smirnov p = {p:.3f}")
    values = np.array(found["others"])
    # this test allows for the error of its integral, so its p-values lie above a uniform distribution's, never below
    print(f"p-values of the share outside, {len(values)} tests: below .05 in {np.mean(values < 0.05):.1%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="time,speed,controls,uniform,alarms")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--uniform-seeds", type=int, default=100)
    options = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    parts = {
        "time": times,
        "speed": speed,
        "controls": controls,
        "uniform": lambda: uniform(options.uniform_seeds),
        "alarms": lambda: alarms(options.seeds),
    }
    for name in options.only.split(","):
        parts[name]()


if __name__ == "__main__":
    main()
