"""E(mu) from 64 directions per texel, and exact: python examples/noisy-energy/noisy_energy.py writes energy.jpg."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1]))
import sheets

PICTURE = "energy.jpg"  # in the current folder
RESOLUTION = 96


def table(resolution: int = RESOLUTION, **options: Any) -> np.ndarray:
    """E of GGX at F = 1, (roughness, mu), with the masking term of the homework's figures."""
    return np.asarray(go.bake("ggx", masking="schlick-ibl", resolution=resolution, lut=["E"], **options).arrays["E"])


Panel = tuple[str, np.ndarray, float, float, str]  # title, values, the colors' range, the colors


def panels(resolution: int) -> list[Panel]:
    """The panels of three tables and their errors."""
    exact = table(resolution)
    cosine = table(resolution, method="cosine", sampler="independent", samples=64)
    normals = table(resolution, method="ggx", sampler="independent", samples=64)
    many = table(resolution, method="ggx", sampler="independent", samples=1024)
    found: list[Panel] = [
        ("64 directions", cosine, 0.0, 1.2, "inferno"),
        ("64 GGX normals", normals, 0.0, 1.2, "inferno"),
        ("exact", exact, 0.0, 1.2, "inferno"),
    ]
    for title, values in (("64 directions", cosine), ("64 normals", normals), ("1,024 normals", many)):
        rms = float(np.sqrt(np.mean((values - exact) ** 2)))
        found.append((f"{title}: {rms:.2g} rms", values - exact, -0.3, 0.3, "RdBu_r"))
    return found


def main(resolution: int = RESOLUTION) -> None:
    width, side, left, right = sheets.WIDTH / sheets.DPI, 3.35, 0.95, 1.45  # inches
    above, below, head = 0.0, 0.72, 1.6 * sheets.LINE
    height = above + 2 * (side + head) + below
    figure = Figure(figsize=(width, height), facecolor=sheets.BACKGROUND, dpi=sheets.DPI)
    gap = (width - left - right - 3 * side) / 2.0
    text = {"color": sheets.TEXT, "fontsize": sheets.POINTS}
    for number, (title, values, low, high, colors) in enumerate(panels(resolution)):
        row, column = divmod(number, 3)
        x, y = left + column * (side + gap), height - above - (row + 1) * (side + head)
        axes = figure.add_axes((x / width, y / height, side / width, side / height))
        style = {"cmap": colors, "vmin": low, "vmax": high, "extent": (0, 1, 0, 1), "interpolation": "nearest"}
        drawn = axes.imshow(values, origin="lower", **style)
        axes.set_title(title, pad=9.0, **text)
        axes.tick_params(colors=sheets.TEXT, labelsize=sheets.POINTS, length=6, width=1.5)
        axes.set_xticks([0, 1] if row else [], ["0", "1"] if row else [])
        for label, side_of_tick in zip(axes.get_xticklabels(), ("left", "right"), strict=False):
            label.set_horizontalalignment(side_of_tick)  # within the panel, so that neighbors do not touch
        axes.set_yticks([0, 1] if column == 0 else [], ["0", "1"] if column == 0 else [])
        if row:
            axes.set_xlabel("cos θ", labelpad=-20.0, **text)
        if column == 0:
            axes.set_ylabel("roughness", labelpad=-8.0, **text)
        if column == 2:
            place = (x + side + 0.12) / width, y / height, 0.22 / width, side / height
            bar = figure.colorbar(drawn, cax=figure.add_axes(place), extend="max" if row == 0 else "both")
            bar.set_ticks([0.0, 0.6, 1.2] if row == 0 else [-0.3, 0.0, 0.3])
            bar.ax.tick_params(colors=sheets.TEXT, labelsize=sheets.POINTS, length=6, width=1.5)
            bar.set_label("E" if row == 0 else "error", labelpad=14.0 if row == 0 else -8.0, **text)
    print(sheets.save(figure, PICTURE))


if __name__ == "__main__":
    main()
