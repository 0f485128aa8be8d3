"""Draw docs/images/samplers.png and print the table of docs/samplers.md: the variance of every choice of `sampling`.

python docs/make_sampler_figure.py [--points 16]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gonio as go
import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib import pyplot as plt

IMAGE = Path(__file__).parent / "images" / "samplers.png"
WIDTHS = (0.05, 0.2, 0.5, 1.0)
ANGLES = np.array([0.0, 15.0, 30.0, 45.0, 55.0, 65.0, 72.0, 78.0, 82.0, 85.0, 87.0, 89.0])
CHOICES = {"normals": "tab:red", "visible": "tab:blue", "bounded": "tab:green"}
LEAST = 1e-7  # lower limit of the axis; smaller values are drawn there


def variance(material: go.BSDF, degrees: float, points: int) -> tuple[float, float]:
    """(variance of the weight divided by its squared mean, fraction of failed samples) at an angle."""
    count = 1 << points
    u = np.arange(1, count + 1)[:, None] * 1.2207440846057596 ** -np.arange(1.0, 4.0) % 1.0
    t = np.radians(degrees)
    wo = np.tile([np.sin(t), 0.0, np.cos(t)], (count, 1))
    drawn = material.sample(wo, u, precision="float64")
    weight = np.where(drawn.pdf > 0.0, drawn.weight[:, 0], 0.0)
    return float(weight.var() / max(weight.mean() ** 2, 1e-30)), float(np.mean(drawn.pdf <= 0.0))


def metal(ndf: str, alpha: float, sampling: str) -> go.BSDF:
    return go.Conductor(alpha=alpha, ndf=ndf, sampling=sampling, fresnel="one")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=16)
    points = parser.parse_args().points
    figure, axes = plt.subplots(2, len(WIDTHS), figsize=(13.0, 6.2), sharex=True, sharey=True)
    for row, ndf in enumerate(("ggx", "beckmann")):
        for column, alpha in enumerate(WIDTHS):
            panel = axes[row, column]
            for sampling, colour in CHOICES.items():
                if ndf != "ggx" and sampling == "bounded":
                    continue  # there it is identical to `visible`
                found = [variance(metal(ndf, alpha, sampling), max(a, 0.1), points)[0] for a in ANGLES]
                panel.plot(ANGLES, np.maximum(found, LEAST), color=colour, label=sampling, marker=".", ms=4)
            panel.set_yscale("log")
            panel.set_ylim(1e-5, 1e3)
            panel.grid(alpha=0.3)
            panel.set_title(f"{ndf}, alpha = {alpha:g}", fontsize=10)
            if row == 1:
                panel.set_xlabel("angle of wo, degrees")
            if column == 0:
                panel.set_ylabel("variance of the weight / mean²")
    axes[0, 0].legend(title="sampling", fontsize=9)
    figure.tight_layout()
    figure.savefig(IMAGE, dpi=110)

    print(
        "| GGX, variance (lost samples) | "
        + " | ".join(f"alpha {a:g}, {d} deg" for a in WIDTHS[1:] for d in (30, 80))
        + " |"
    )
    print("|---" * 7 + "|")
    for sampling in CHOICES:
        cells = []
        for alpha in WIDTHS[1:]:
            for degrees in (30.0, 80.0):
                v, lost = variance(metal("ggx", alpha, sampling), degrees, points)
                cells.append(f"{v:.2g} ({100.0 * lost:.2g} %)")
        print(f"| `{sampling}` | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
