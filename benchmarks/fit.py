"""The time of a fit to a table of MERL's size, compared with SciPy on NumPy.

    python benchmarks/fit.py

1.46 million cells of gold with 2 % noise, in one process: `go.fit`, warm, and scipy.optimize.least_squares on the same
cells and metric, with the model in NumPy float64 and derivatives by finite differences. `intervals.py` measures the
coverage of the intervals.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.fitting import data
from gonio.fitting.fit import Fit, fit
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from measure.test_fitting import METAL, table, truth

MERL = (90, 90, 180)


def straightforward(cells: data.Data, start: np.ndarray) -> np.ndarray:
    """eta and k in three channels and alpha of a GGX conductor with height-correlated masking, fitted with SciPy."""
    wo, wi = cells.wo, cells.wi
    half = wo + wi
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    cos_h, cos_d = half[:, 2], np.sum(wo * half, axis=1)

    def eval_(x: np.ndarray) -> np.ndarray:
        alpha = x[6]
        tan2 = 1.0 / cos_h**2 - 1.0
        density = alpha**2 / (np.pi * cos_h**4 * (alpha**2 + tan2) ** 2)
        lambdas = [0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / w[:, 2] ** 2 - 1.0)) - 1.0) for w in (wo, wi)]
        shape = density / (1.0 + lambdas[0] + lambdas[1]) / (4.0 * wo[:, 2])
        sin2 = 1.0 - cos_d**2
        channels = []
        for eta, k in zip(x[:3], x[3:6], strict=True):
            t = eta**2 - k**2 - sin2
            a2b2 = np.sqrt(t**2 + 4.0 * eta**2 * k**2)
            a = np.sqrt(np.maximum(0.5 * (a2b2 + t), 0.0))
            r_s = (a2b2 + cos_d**2 - 2.0 * a * cos_d) / (a2b2 + cos_d**2 + 2.0 * a * cos_d)
            p, q = cos_d**2 * a2b2 + sin2**2, 2.0 * a * cos_d * sin2
            channels.append(0.5 * r_s * (1.0 + (p - q) / (p + q)))
        return shape[:, None] * np.stack(channels, axis=1)

    floor = 1e-3 * np.percentile(np.abs(cells.value), 99.0)
    wanted = np.log1p(cells.value / floor)

    def residuals(x: np.ndarray) -> np.ndarray:
        return (np.log1p(eval_(x) / floor) - wanted).ravel()

    return least_squares(residuals, start, bounds=([0.0] * 6 + [1e-3], [50.0] * 6 + [1.0]), x_scale="jac").x


def speed() -> None:
    """Print the seconds and the errors of the parameters."""
    measured = table(METAL, shape=MERL)
    fit(measured, "conductor")
    start = time.perf_counter()
    found = fit(measured, "conductor")
    ours = time.perf_counter() - start
    print(f"go.fit: {ours:.2f} s, {found.count} values; off by at most {_off(found, METAL):.2%}", flush=True)
    cells = data.data_of(measured)
    begin = np.array([0.5] * 3 + [2.0] * 3 + [0.3])
    start = time.perf_counter()
    numbers = straightforward(cells, begin)
    theirs = time.perf_counter() - start
    known = truth(METAL, ("eta.r", "eta.g", "eta.b", "k.r", "k.g", "k.b", "alpha"))
    off = float(np.max(np.abs(numbers - known) / known))
    print(f"SciPy:  {theirs:.2f} s from one start; off by at most {off:.2%};  {theirs / ours:.1f} x the time")


def _off(found: Fit, material: go.BSDF) -> float:
    known = truth(material, found.names)
    return float(np.max(np.abs(found.values - known) / known))


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    speed()


if __name__ == "__main__":
    main()
