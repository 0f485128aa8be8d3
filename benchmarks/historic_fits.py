"""Gonio's fits of the historic models compared with published parameters, on tables rebuilt from Bagher's fits.

    python benchmarks/historic_fits.py               # all materials, all fits printed by Ngan and Low: half an hour
    python benchmarks/historic_fits.py --every 10    # every tenth material

The table of each material is its fit of 2012 by Bagher, the public one that is closest to the measurement. Both sets of
parameters are judged by the paper's own metric: the root mean square difference of f cos (Ngan2005) or log(1 + f cos)
(Low2012), over directions up to 80 degrees. Fits also start from the printed parameters, so that they cannot be worse.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict

import gonio as go
import numpy as np
from gonio.fitting.data import Data, data_of
from gonio.measure.tables.half_difference import sampled
from rich.console import Console
from rich.table import Table

CELLS = (60, 45, 36)
METRICS = {"ngan2005": "linear", "low2012": "log1p"}
console = Console()


def error(material: go.BSDF, data: Data, metric: str) -> float:
    value = np.asarray(material.eval(data.wo, data.wi, precision="float64"))
    if metric == "linear":
        return float(np.sqrt(np.mean((value - data.value) ** 2)))
    return float(np.sqrt(np.mean((np.log1p(np.maximum(value, 0)) - np.log1p(data.value)) ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, help="take one material of so many")
    parser.add_argument("--paper", choices=METRICS, action="append", help="take this paper's alone")
    given = parser.parse_args()
    ratios: dict[str, list[float]] = defaultdict(list)
    times = []
    for name in go.materials()[:: given.every]:
        bagher = go.material(name)
        data = data_of(sampled(lambda wo, wi, m=bagher: np.asarray(m.eval(wo, wi)), CELLS))
        for fit in go.fits(name):
            paper = fit.partition("/")[0]
            if paper not in (given.paper or METRICS):
                continue
            printed, metric = go.material(name, fit=fit), METRICS[paper]
            started = time.perf_counter()
            found = go.fit(data, printed, loss=metric).material
            times.append(time.perf_counter() - started)
            ratios[fit].append(error(found, data, metric) / error(printed, data, metric))
    table = Table(title="error of Gonio's fit over that of the printed numbers")
    for title in ("fit", "materials", "median", "worst", "best", "worse"):
        table.add_column(title, justify="left" if title == "fit" else "right")
    for fit, found in sorted(ratios.items()):
        values = np.array(found)
        worse = int(np.sum(values > 1.0 + 1e-6))
        table.add_row(
            fit, *(f"{x:.3g}" for x in (len(values), np.median(values), values.max(), values.min())), str(worse)
        )
    console.print(table)
    console.print(f"{np.median(times):.2f} s a fit in the median, {np.sum(times):.0f} s together")


if __name__ == "__main__":
    main()
