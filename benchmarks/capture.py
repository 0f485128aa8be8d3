"""A material from photographs of a ball: accuracy, coverage of the intervals, calibration faults, and plans.

    python benchmarks/capture.py [--only accuracy,coverage,faults,plan] [--trials 50]
    python benchmarks/capture.py --only series [--cameras usual] [--seed-range 1:101] [--jobs 16] [-o capture.json]

accuracy  8 lights, 256 x 256, 1 % noise: errors of albedo and alpha after the fit, for several materials; seconds
coverage  the same with calibration errors of the stated size (lamps by 1 degree, ball by 1 % and a pixel, intensities
          by 1 % each and 0.5 % together): coverage of the 95 % intervals
series    the same from series of three 16-bit exposures of four cameras, with exposure times off by 0.5 % each, as
          stated in the calibration; the file has the format of that of `intervals.py`
faults    one fault at a time, and 8-bit photographs
plan      4 planned photographs against 8 random ones, in pairs: root mean square error of the parameters, actual and as
          stated by the fits. The actual error of a pair is almost a single random number, so some 80 pairs are needed
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from gonio.instruments.capture import rehearsal
from gonio.instruments.capture.fitting import across
from gonio.instruments.capture.run import Capture, capture, plan
from gonio.instruments.capture.series import Noise
from gonio.material import tree
from gonio.materials.combined.sum import Sum

from intervals import Outcome, add_options, report, run, seeds_of

MIDDLE, RADIUS, AWAY = np.array([0.0, 0.0, 500.0]), 50.0, 400.0
ANGLES = (15.0, 35.0, 55.0, 75.0, 25.0, 45.0, 65.0, 95.0)  # angles between lamp and camera of the eight photographs
PAINT = Sum(go.Lambert((0.3, 0.2, 0.1)), go.Conductor(eta=1.5, k=0.0, alpha=0.15, fresnel="schlick"))
CAMERAS = {  # read noise, photons at full scale, relative noise
    "deep wells": (0.5e-3, 60000, 0.0),
    "usual": (1.5e-3, 8000, 0.0),
    "small wells": (4e-3, 1000, 0.0),
    "a flickering lamp": (1.5e-3, 8000, 0.01),
}
TIMES = (0.02, 0.08, 0.32)  # exposure times of a series, seconds
STATED = {"light": 1.0, "radius": 0.01, "center": 1.0, "intensity": 0.01, "scale": 0.005}
SHUTTER = 0.005  # relative error of an exposure time


def rig(lamps: np.ndarray, bits: int | None = None) -> dict[str, Any]:
    """A calibration with lamps at these positions."""
    suffix = "npz" if bits is None else "png"
    seconds = 1.0 if bits is None else 1.6
    return {
        "camera": {"size": [256, 256], "focal": 1000.0},
        "response": "srgb" if bits else "linear",
        "ball": {"radius": RADIUS, "center": MIDDLE.tolist()},
        "lights": {f"l{n}": {"position": p.tolist(), "intensity": AWAY**2} for n, p in enumerate(lamps)},
        "photographs": [{"file": f"p{n}.{suffix}", "seconds": seconds, "light": f"l{n}"} for n in range(len(lamps))],
    }


def eight() -> np.ndarray:
    theta, phi = np.radians(ANGLES), np.arange(8) * 0.75 * np.pi
    toward = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)], -1)
    return MIDDLE + AWAY * toward


def off(true: dict[str, Any], stated: dict[str, float], rng: np.random.Generator) -> dict[str, Any]:
    """The calibration with errors drawn from the stated uncertainties."""
    lights = {}
    together = 1.0 + stated.get("scale", 0.0) * rng.normal()
    for name, lamp in true["lights"].items():
        away = np.array(lamp["position"]) - MIDDLE
        distance = np.linalg.norm(away)
        a, b = across(away)
        turned = away / distance + np.radians(stated.get("light", 0.0)) * (rng.normal() * a + rng.normal() * b)
        place = MIDDLE + distance * turned / np.linalg.norm(turned)
        bright = lamp["intensity"] * together * (1.0 + stated.get("intensity", 0.0) * rng.normal())
        lights[name] = {"position": place.tolist(), "intensity": float(bright)}
    pixel = 500.0 / 1000.0
    ball = {
        "radius": RADIUS * (1.0 + stated.get("radius", 0.0) * rng.normal()),
        "center": (MIDDLE + stated.get("center", 0.0) * pixel * rng.normal(size=3) * [1, 1, 0]).tolist(),
    }
    return {**true, "lights": lights, "ball": ball, "uncertainty": stated}


def truth(material: go.BSDF, names: tuple[str, ...]) -> np.ndarray:
    found = []
    for name in names:
        path, _, channel = name.rpartition(".")
        if channel in ("r", "g", "b"):
            found.append(np.broadcast_to(tree.value_at(material, path), 3)["rgb".index(channel)])
        else:
            found.append(tree.value_at(material, name))
    return np.array(found, float)


def in_series(true: dict[str, Any], times: np.ndarray) -> dict[str, Any]:
    """The calibration with a series of exposures for each view."""
    photographs = [
        {
            "light": shot["light"],
            "exposures": [{"file": f"{shot['light']}-{n}.png", "seconds": float(t)} for n, t in enumerate(times)],
        }
        for shot in true["photographs"]
    ]
    return {**true, "response": "linear", "photographs": photographs}


def measured(
    material: go.BSDF,
    model: str,
    lamps: np.ndarray,
    stated: dict[str, float],
    seed: int,
    bits: int | None = None,
    camera: str = "",
) -> tuple[Capture, np.ndarray, float]:
    """The capture, the true parameters, and the seconds that it took."""
    true = rig(lamps, bits)
    with tempfile.TemporaryDirectory() as folder:
        rng = np.random.default_rng([seed, 5, *camera.encode()])  # each camera has its own calibration
        told = off(true, stated, rng)
        noise: float | Noise = 0.01
        if camera:
            read, photons, relative = CAMERAS[camera]
            noise = Noise(np.full(3, read**2), np.full(3, 1.0 / photons), np.full(3, relative**2))
            bits, told = 16, in_series(told, np.array(TIMES))
            true = in_series(true, TIMES * np.exp(SHUTTER * rng.normal(size=len(TIMES))))
        at = rehearsal.take(true, material, Path(folder) / "p", noise=noise, bits=bits, seed=seed, stated=told)
        start = time.perf_counter()
        found = capture(at, model)
        return found, truth(material, found.fit.names), time.perf_counter() - start


def show(title: str, names: tuple[str, ...], errors: np.ndarray, inside: np.ndarray, seconds: float) -> None:
    print(title)
    for name, one, share in zip(names, errors.T, inside.mean(axis=0), strict=True):
        print(f"  {name:12} off by at most {one.max():8.4%}, inside its interval in {share:.0%} of {len(one)}")
    print(f"  {seconds:.1f} s at most", flush=True)


def trials(
    title: str,
    material: go.BSDF,
    model: str,
    stated: dict[str, float],
    count: int,
    bits: int | None = None,
) -> None:
    errors, inside, took = [], [], []
    for seed in range(1, count + 1):
        found, known, seconds = measured(material, model, eight(), stated, seed, bits)
        errors.append(np.abs(found.fit.values - known) / known)
        inside.append((found.fit.interval[:, 0] <= known) & (known <= found.fit.interval[:, 1]))
        took.append(seconds)
    show(title, found.fit.names, np.array(errors), np.array(inside), max(took))


def from_series(job: tuple[str, int]) -> list[Outcome]:
    """One capture from series of exposures with all faults at once."""
    camera, seed = job
    found, known, _ = measured(PAINT, "lambert+ggx", eight(), {**STATED, "seconds": SHUTTER}, seed, camera=camera)
    fit = found.fit
    held = (fit.interval[:, 0] <= known) & (known <= fit.interval[:, 1])
    rows = zip(fit.names, (fit.values - known) / fit.errors, held, np.abs(fit.values / known - 1.0), strict=True)
    return [Outcome(camera, name, seed, float(z), bool(h), float(off)) for name, z, h, off in rows]


def accuracy() -> None:
    for alpha in (0.05, 0.15, 0.4):
        paint = tree.replace(PAINT, {"b.alpha": alpha})
        trials(f"paint, alpha {alpha:g}, exact calibration", paint, "lambert+ggx", {}, 3)
    for alpha in (0.1, 0.3):
        gold = go.Conductor.preset("Au", alpha=alpha)
        trials(f"gold, alpha {alpha:g}, exact calibration", gold, "conductor", {}, 3)


def faults(count: int) -> None:
    for name, stated in (
        ("lamps off by 1 degree", {"light": 1.0}),
        ("ball off by 1 %, and by a pixel", {"radius": 0.01, "center": 1.0}),
        ("intensities off by 1 % each, .5 % together", {"intensity": 0.01, "scale": 0.005}),
    ):
        trials(name, PAINT, "lambert+ggx", stated, count)
    trials("8 bits", PAINT, "lambert+ggx", {}, count, bits=8)


def plans(count: int) -> None:
    """Two photographs planned from a guess and two more from their fit, against eight at random positions."""
    stated = {"light": 1.0, "intensity": 0.01}
    errors = {"planned": [], "random": []}
    stated_errors = {"planned": [], "random": []}
    for seed in range(1, count + 1):
        rng = np.random.default_rng([seed, 77])
        albedo, alpha = rng.uniform(0.05, 0.6, 3), float(np.exp(rng.uniform(np.log(0.06), np.log(0.5))))
        material = tree.replace(PAINT, {"a.albedo": tuple(map(float, albedo)), "b.alpha": alpha})
        with tempfile.TemporaryDirectory() as folder:
            first = rig(eight()[:1])
            first["uncertainty"] = stated
            path = Path(folder) / "calibration.json"
            path.write_text(json.dumps(first))
            guess = plan(path, "lambert+ggx", 2)
        lamps = np.array([one.position for one in guess])
        found, _, _ = measured(material, "lambert+ggx", lamps, stated, seed)
        lamps = np.concatenate([lamps, [one.position for one in found.next(2)]])
        directions = rng.normal(size=(200, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        angle = np.degrees(np.arccos(-directions[:, 2]))
        anywhere = MIDDLE + AWAY * directions[(angle > 8.0) & (angle < 125.0)][:8]
        for name, places in (("planned", lamps), ("random", anywhere)):
            got, known, _ = measured(material, "lambert+ggx", places, stated, seed)
            errors[name].append(float(np.sqrt(np.mean(((got.fit.values - known) / known) ** 2))))
            stated_errors[name].append(float(np.sqrt(np.mean((got.fit.errors / known) ** 2))))
        print(f"  {seed}: 4 planned {errors['planned'][-1]:.4%}, 8 random {errors['random'][-1]:.4%}", flush=True)
    medians = {name: float(np.median(one)) for name, one in errors.items()}
    print(f"median of {count}: 4 planned {medians['planned']:.4%}, 8 random {medians['random']:.4%}")
    ratio = float(np.median(np.divide(stated_errors["planned"], stated_errors["random"])))
    print(f"standard errors that the fits state: planned over random {ratio:.2f} in the median of the pairs")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="accuracy,coverage,series,faults,plan")
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--cameras", default="", help="cameras of the series, by name")
    add_options(parser, "1:13")
    options = parser.parse_args()
    if "accuracy" in options.only:
        accuracy()
    if "coverage" in options.only:
        trials("paint, every fault at once", PAINT, "lambert+ggx", STATED, options.trials)
    if "series" in options.only:
        cameras = [name for name in CAMERAS if not options.cameras or name in options.cameras.split(",")]
        jobs = [(camera, seed) for seed in seeds_of(options.seed_range) for camera in cameras]
        start = time.perf_counter()
        outcomes = run(from_series, jobs, options.jobs)
        report(outcomes, time.perf_counter() - start, options.output)
    if "faults" in options.only:
        faults(max(options.trials // 5, 2))
    if "plan" in options.only:
        plans(max(2 * options.trials, 2))


if __name__ == "__main__":
    main()
