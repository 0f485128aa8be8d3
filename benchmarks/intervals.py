"""Coverage of the 95 % intervals of fits: nine models at random parameters, with 1, 2 and 5 % noise.

    python benchmarks/intervals.py [--seed-range 1:16] [--jobs 4] [--only conductor,ward] [--kind list] [-o fits.json]

Each fit has its own data with random true values and independent noise proportional to each value: a half-difference
table of 24 x 24 x 36 cells, a list of 1,500 random pairs of directions, or a table over 5 x 16 x 19 angles. The file
holds, per model, noise level and parameter: the number of intervals, the number of those that contain the true
value, the number of parameters without a finite interval, and the mean and root mean square of the error divided by its
standard error, which are 0 and 1 for unbiased values with correct intervals. Rows of several files are combined by
adding the counts.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import gonio as go
import numpy as np
from gonio.fitting.fit import fit
from gonio.materials.combined.sum import Sum
from gonio.measure.tables import angles, samples
from gonio.measure.tables.angles import Angles
from gonio.measure.tables.samples import Samples

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from measure.test_fitting import table, truth

NOISES = (0.01, 0.02, 0.05)
METALS = ("Ag", "Al", "Au", "Cu")
Random = np.random.Generator


class Outcome(NamedTuple):
    """One parameter of one fit.

    z     error divided by its standard error; nan for an infinite standard error
    held  whether the interval contains the true value
    off   relative error
    """

    case: str
    name: str
    seed: int
    z: float
    held: bool
    off: float


def _color(rng: Random, low: float = 0.02, high: float = 0.9) -> tuple[float, ...]:
    return tuple(map(float, rng.uniform(low, high, 3)))


def _width(rng: Random) -> float:
    return float(np.exp(rng.uniform(np.log(0.05), np.log(0.5))))


def _gloss(rng: Random, ndf: str) -> go.BSDF:
    eta = _color(rng, 1.3, 2.0)
    return Sum(go.Lambert(_color(rng)), go.Conductor(eta=eta, k=0.0, alpha=_width(rng), ndf=ndf, fresnel="schlick"))


def _colors(rng: Random, diffuse: str = "diffuse", specular: str = "specular", low: float = 0.05, high: float = 0.5):
    return {diffuse: _color(rng, 0.02, 0.5), specular: _color(rng, low, high)}


MODELS: dict[str, Callable[[Random], go.BSDF]] = {
    "lambert": lambda rng: go.Lambert(_color(rng)),
    "oren-nayar": lambda rng: go.OrenNayar(_color(rng), sigma=float(rng.uniform(0.05, 0.7))),
    "conductor": lambda rng: go.Conductor.preset(METALS[rng.integers(4)], alpha=_width(rng)),
    "lambert+ggx": lambda rng: _gloss(rng, "ggx"),
    "lambert+beckmann": lambda rng: _gloss(rng, "beckmann"),
    "ward": lambda rng: go.Ward(**_colors(rng), alpha=_width(rng)),
    "cook-torrance": lambda rng: go.CookTorrance(**_colors(rng), alpha=_width(rng), eta=float(rng.uniform(1.3, 2.5))),
    "ashikhmin-shirley": lambda rng: go.AshikhminShirley(
        **_colors(rng), exponent=float(np.exp(rng.uniform(2.0, 7.0))), eta=float(rng.uniform(1.3, 2.5))
    ),
    "modified-phong": lambda rng: go.ModifiedPhong(**_colors(rng, "kd", "ks"), p=float(np.exp(rng.uniform(1.0, 6.0)))),
}


def listed(material: go.BSDF, noise: float, seed: int) -> Samples:
    """Values at 1,500 pairs of directions that are distributed by the cosine."""
    rng = np.random.default_rng(seed)
    theta, phi = np.arccos(np.sqrt(rng.random((2, 1500)))), rng.uniform(-np.pi, np.pi, (2, 1500))
    directions = np.stack([theta[0], phi[0], theta[1], phi[1]], -1)
    exact = samples.sampled(lambda wo, wi: np.asarray(material.eval(wo, wi)), directions)
    return Samples(directions, exact.values * (1.0 + noise * rng.standard_normal(exact.values.shape)))


def over_angles(material: go.BSDF, noise: float, seed: int) -> Angles:
    """A table over angles as coarse as those that goniometers write, with the mirror direction of each light."""
    nodes = (
        np.radians(np.arange(10.0, 71.0, 15.0)),
        np.radians(np.arange(0.0, 76.0, 5.0)),
        np.radians(np.arange(0.0, 181.0, 10.0)),
    )
    wo, wi = angles.pairs(*nodes)
    f = np.asarray(material.eval(wo, wi)) / wi[:, 2:]
    f *= 1.0 + noise * np.random.default_rng(seed).standard_normal(f.shape)
    return Angles(nodes, f.reshape(*map(len, nodes), 3))


KINDS = {"table": table, "list": listed, "angles": over_angles}


def one(job: tuple[str, float, int, str]) -> list[Outcome]:
    """The fit of one model to one set of data."""
    model, noise, seed, kind = job
    rng = np.random.default_rng([seed, sorted(MODELS).index(model), int(1e3 * noise)])
    material = MODELS[model](rng)
    found = fit(KINDS[kind](material, noise=noise, seed=int(rng.integers(1 << 62))), model)
    known = truth(material, found.names)
    with np.errstate(invalid="ignore"):
        z = np.where(np.isfinite(found.errors), (found.values - known) / found.errors, np.nan)
    held = (found.interval[:, 0] <= known) & (known <= found.interval[:, 1])
    rows = zip(found.names, z, held, np.abs(found.values / known - 1.0), strict=True)
    return [Outcome(f"{model}, {noise:.0%}", name, seed, float(a), bool(b), float(c)) for name, a, b, c in rows]


def summed(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """One row per case and parameter."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault((outcome.case, outcome.name), []).append(outcome)
    rows = []
    for (case, name), members in groups.items():
        told = [m for m in members if np.isfinite(m.z)]
        z = np.array([m.z for m in told]) if told else np.full(1, np.nan)
        rows.append(
            {
                "case": case,
                "parameter": name,
                "intervals": len(told),
                "held": sum(m.held for m in told),
                "undetermined": len(members) - len(told),
                "mean_z": round(float(z.mean()), 3),
                "rms_z": round(float(np.sqrt(np.mean(z**2))), 3),
                "worst_error": round(max(m.off for m in members), 6),
                "missed": [m.seed for m in told if not m.held],
            }
        )
    return rows


def run(work: Callable[[Any], list[Outcome]], jobs: list[Any], processes: int) -> list[Outcome]:
    """The outcomes of all jobs, computed by processes of one thread each."""
    if processes < 2:
        return [outcome for job in jobs for outcome in _told(work(job))]
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_alone) as pool:
        return [outcome for found in pool.map(work, jobs) for outcome in _told(found)]


def _told(found: list[Outcome]) -> list[Outcome]:
    print(f"{found[0].case}, seed {found[0].seed}: {sum(o.held for o in found)} of {len(found)}", flush=True)
    return found


def _alone() -> None:
    """Restrict this process to one thread, to leave the other cores to the other processes."""
    import drjit

    drjit.set_thread_count(1)


def report(outcomes: list[Outcome], seconds: float, path: Path | None) -> None:
    """Print a table and write it as JSON."""
    rows = summed(outcomes)
    for row in rows:
        share = row["held"] / max(row["intervals"], 1)
        print(
            f"{row['case']:24} {row['parameter']:14} {share:6.1%} of {row['intervals']:3}"
            f"   z {row['mean_z']:+.2f}, rms {row['rms_z']:.2f}   off by at most {row['worst_error']:.3%}"
        )
    cases: dict[str, list[int]] = {}
    for row in rows:
        held, total = cases.setdefault(row["case"], [0, 0])
        cases[row["case"]] = [held + row["held"], total + row["intervals"]]
    for case, (held, total) in cases.items():
        print(f"{case:24} {held / max(total, 1):6.1%} of {total}")
    held, total = sum(row["held"] for row in rows), sum(row["intervals"] for row in rows)
    print(f"all: {held} of {total} intervals hold the truth, {held / max(total, 1):.1%}; {seconds:.0f} s")
    if path is not None:
        text = json.dumps({"held": held, "intervals": total, "seconds": round(seconds), "rows": rows}, indent=1)
        path.write_text(text + "\n")


def add_options(parser: argparse.ArgumentParser, seeds: str) -> None:
    """Add the options of benchmarks that count intervals."""
    parser.add_argument("--seed-range", default=seeds, help="first seed and the one after the last")
    parser.add_argument("--jobs", type=int, default=1, help="processes of one thread each")
    parser.add_argument("-o", "--output", type=Path)


def seeds_of(text: str) -> range:
    first, _, end = text.partition(":")
    return range(int(first), int(end))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="models, by name")
    parser.add_argument("--kind", choices=KINDS, default="table", help="kind of data")
    add_options(parser, "1:16")
    options = parser.parse_args()
    models = [model for model in MODELS if not options.only or model in options.only.split(",")]
    jobs = [
        (model, noise, seed, options.kind)
        for seed in seeds_of(options.seed_range)
        for model in models
        for noise in NOISES
    ]
    start = time.perf_counter()
    outcomes = run(one, jobs, options.jobs)
    report(outcomes, time.perf_counter() - start, options.output)


if __name__ == "__main__":
    main()
