"""Figures of energy: the tables E and E_avg with axes, and the compensations side by side."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..energy import comparison
from ..energy.bake import load
from . import figures


def plot_tables(folder: str | Path, output: Path | None = None) -> Path:
    """Draw a baked folder: E over n.v and roughness, low roughness at the bottom as in the homework, and E_avg."""
    from matplotlib.figure import Figure

    baked = load(folder)
    path = figures.check_output(output or Path(f"{Path(folder).resolve().stem}-tables.png"))
    names = [n for n in ("E", "E_avg") if n in baked.arrays]
    figure = Figure(figsize=(4.6 * len(names), 4.0), layout="constrained")
    m = baked.manifest
    figure.suptitle(f"{m['ndf']}, {m['masking']}, {m['method']}", fontsize=10)
    for axes, name in zip(np.atleast_1d(figure.subplots(1, len(names))), names, strict=True):
        value = baked.arrays[name]
        if name == "E_avg":
            axes.plot(baked.arrays["roughness"], value, color="0.2")
            axes.set(xlabel="roughness", ylabel="E_avg", xlim=(0, 1), ylim=(0, 1.02))
            axes.grid(alpha=0.3)
            continue
        value = value.mean(-1) if value.ndim == 3 else value
        image = axes.imshow(value, origin="lower", extent=(0, 1, 0, 1), cmap="gray", vmin=0, vmax=1)
        stretched = m["layout"] == "stretched"
        axes.set(xlabel="s(n.v) / s(1)" if stretched else "n.v", ylabel="roughness")
        figure.colorbar(image, ax=axes, label="E")
    figure.savefig(path, dpi=150)
    return path


def plot_comparison(found: dict[str, Any], folder: Path) -> Path:
    """Write compensation.png and compensation.json to a folder: albedo against roughness, and distance to the walk."""
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=(13, 6.4), layout="constrained")
    axes = figure.subplots(2, len(comparison.MATERIALS))
    roughness = found["roughness"]
    middle = len(found["mu"]) // 2
    colours = {m: f"C{index}" for index, m in enumerate(comparison.METHODS)}
    walk = {"color": "black", "marker": "o", "linestyle": "none", "fillstyle": "none"}
    for column, name in enumerate(comparison.MATERIALS):
        by_method = {m: np.asarray(v) for m, v in found["albedo"][name].items()}
        referee = by_method["random walk"]
        for method, value in by_method.items():
            line = {"color": colours[method], "linestyle": "--" if method in ("plain", "fdez-aguera") else "-"}
            style = walk if method == "random walk" else line
            axes[0, column].plot(roughness, value[:, middle].mean(-1), label=method, **style)
            if method not in ("random walk", "plain"):
                distance = np.sqrt(np.mean((value - referee) ** 2, axis=(1, 2)))
                axes[1, column].plot(roughness, distance, label=method, **line)
        axes[0, column].set(title=name, xlabel="roughness", ylim=(0, 1.05))
        axes[1, column].set(xlabel="roughness")
    axes[0, 0].set_ylabel(f"albedo at mu = {found['mu'][middle]:g}, mean of channels")
    axes[1, 0].set_ylabel("RMS distance to the walk")
    axes[0, 0].legend(fontsize=7)
    axes[1, 1].legend(fontsize=7)
    path = folder / "compensation.png"
    figure.savefig(path, dpi=120)
    (folder / "compensation.json").write_text(json.dumps(found))
    return path
