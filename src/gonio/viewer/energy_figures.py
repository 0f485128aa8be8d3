"""Figures of baked albedo tables, and of a comparison of compensation methods."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import files
from ..energy.tables.baked import Baked, load
from ..pictures import images
from . import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLICES = 4  # largest number of slices of a table with three axes


class _Panel(NamedTuple):
    """One panel of a figure: a table over roughness and mu, or a curve."""

    title: str
    values: np.ndarray
    curve: str = ""  # the axis of a curve


def draw_tables(folder: str | Path) -> figures.Drawing:
    """Plot a folder of baked tables over n.v and roughness, with low roughness at the bottom, as in the homework.

    Slices along a third axis are placed side by side. E_avg, and any table that depends only on the cosine, is drawn as
    a curve.
    """
    mpl = figures.load_matplotlib()
    from matplotlib.figure import Figure

    baked = load(folder)
    if "levels" in baked.manifest:
        return figures.Drawing(_levels(baked), f"gonio plot {folder}")
    rows = [row for name in baked.manifest["dims"] for row in _rows(baked, name)]
    curves = [panel for row in rows for panel in row if panel.curve]
    rows = [row for row in rows if not row[0].curve] or [[]]
    rows[0] = rows[0] + curves
    columns = max(map(len, rows))
    with mpl.rc_context(figures.STYLE):
        figure = Figure(figsize=(3.4 * columns + 0.8, 3.7 * len(rows) + 0.4), layout="constrained")
        figure.suptitle(_title(baked.manifest), fontsize=11)
        grid = figure.subplots(len(rows), columns, squeeze=False)
        for line, row in zip(grid, rows, strict=True):
            for axes, panel in zip(line, row, strict=False):
                _draw(axes, panel, baked)
            for axes in line[len(row) :]:
                axes.set_axis_off()
        if any(not panel.curve for row in rows for panel in row):
            scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, 1), "gray")
            figure.colorbar(scale, ax=grid, shrink=0.8 / len(rows), pad=0.01)
    return figures.Drawing(figure, f"gonio plot {folder}")


def _levels(baked: Baked) -> Figure:
    """Draw the levels of an environment, encoded as sRGB, with an exposure at which a twentieth of the map is white."""
    mpl = figures.load_matplotlib()
    from matplotlib.figure import Figure

    names = list(baked.manifest["dims"])
    white = float(np.quantile(baked.arrays[names[0]].max(-1), 0.95)) or 1.0
    with mpl.rc_context(figures.STYLE):
        figure = Figure(figsize=(9.0, 2.6 * ((len(names) + 1) // 2) + 0.4), layout="constrained")
        title = f"{baked.manifest['target']} blurred by {baked.manifest['ndf']}; errors are rms"
        figure.suptitle(title, fontsize=11)
        grid = figure.subplots((len(names) + 1) // 2, 2, squeeze=False).ravel()
        for axes in grid:
            axes.set_axis_off()
        for axes, name, level in zip(grid, names, baked.manifest["levels"], strict=False):
            error = baked.manifest["error"][name]
            split = error.get("split sum")
            errors = "the map" if split is None else f"blur {error['rms']:.0e}, split sum {split:.1%}"
            picture = images.to_screen((baked.arrays[name] / white).astype(np.float32))
            axes.imshow(picture, extent=(0.0, 2.0, 0.0, 1.0), interpolation="bilinear")
            axes.set_title(f"roughness {level['roughness']:.2g}: {errors}", fontsize=9)
    return figure


def _title(manifest: dict[str, Any]) -> str:
    target = manifest["target"] if isinstance(manifest["target"], str) else manifest["target"]["model"]
    parts = [
        target,
        *([manifest["ndf"]] if manifest["ndf"] not in target else []),
        manifest["masking"],
        manifest["method"],
    ]
    if "aspect" in manifest:
        parts.append(f"alpha_y / alpha_x = {manifest['aspect']:g}")
    return ", ".join(filter(None, parts))


def _rows(baked: Baked, name: str) -> list[list[_Panel]]:
    """The panels of one table: a row per distinct channel, with slices of a third axis side by side."""
    values, dims = baked.arrays[name], baked.manifest["dims"][name]
    if not dims:
        return []
    if len(dims) == 1:
        return [[_Panel(name, values, dims[0])]]
    if name == "dfg":
        parts = {"A": values[..., 0], "B": values[..., 1]}
    elif name.startswith("E_glass"):
        parts = {f"from the {name.removeprefix('E_glass_')} side": values.sum(-1)}
    else:
        parts = {name: values.mean(-1) if values.ndim > len(dims) else values}
    if len(dims) == 2:
        return [[_Panel(title, part) for title, part in parts.items()]]
    along = baked.arrays[dims[0]]
    chosen = np.unique(np.linspace(0, len(along) - 1, SLICES).round().astype(int))
    return [
        [_Panel(f"{title}, {_place(dims[0], along[index])}", part[index]) for index in chosen]
        for title, part in parts.items()
    ]


def _place(axis: str, value: float) -> str:
    """A value on a third axis as text."""
    if axis == "phi":
        return f"phi = {np.degrees(value):.0f}°"
    return f"eta = {(1.0 + value) / (1.0 - value):.2f}"


def _draw(axes: Any, panel: _Panel, baked: Baked) -> None:
    if not panel.curve:
        stretched = baked.manifest["layout"] == "stretched"
        axes.imshow(panel.values, origin="lower", extent=(0, 1, 0, 1), cmap="gray", vmin=0, vmax=1)
        axes.set(xlabel="s(n.v) / s(1)" if stretched else "n.v", ylabel="roughness", title=panel.title)
        return
    colors = figures.CHANNELS if panel.values.ndim == 2 else (figures.INK,)
    for column, color in zip(np.atleast_2d(panel.values.T), colors, strict=True):
        axes.plot(baked.arrays[panel.curve], column, color=color)
    top = max(1.02, 1.02 * float(panel.values.max()))
    axes.set(xlabel="n.v" if panel.curve == "mu" else panel.curve, xlim=(0, 1), ylim=(0, top), title=panel.title)
    axes.set_box_aspect(1)
    axes.grid()


def plot_comparison(comparison: dict[str, Any], folder: Path) -> None:
    """Write compensation.png and compensation.json to a folder, with the albedo as a function of roughness, and its
    error against the random walk."""
    mpl = figures.load_matplotlib()
    from matplotlib.figure import Figure

    with mpl.rc_context(figures.STYLE):
        figure = Figure(figsize=(10.7, 7.2), layout="constrained")
        axes = figure.subplots(2, len(comparison["albedo"]), sharey="row", squeeze=False)
        _compare(comparison, axes)
        entries: dict[str, Any] = {}
        for one in axes[0]:  # some methods apply to some materials only
            entries |= dict(zip(*reversed(one.get_legend_handles_labels()), strict=True))
        figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=4, fontsize=12)
        picture = io.BytesIO()
        figure.savefig(picture, dpi=120, format="png", facecolor="white")
    numbers = json.dumps(comparison).encode()
    files.write_all(folder, {"compensation.png": picture.getvalue(), "compensation.json": numbers})


def _compare(comparison: dict[str, Any], axes: Any) -> None:
    """Draw one column per material: above, the albedo by every method; below, its error against the random walk."""
    roughness = comparison["roughness"]
    middle = len(comparison["mu"]) // 2
    colors = {m: f"C{index}" for index, m in enumerate(comparison["cost"])}
    walk = {"color": "black", "marker": "o", "linestyle": "none", "fillstyle": "none"}
    for column, name in enumerate(comparison["albedo"]):
        by_method = {m: np.asarray(v) for m, v in comparison["albedo"][name].items()}
        reference = by_method["random walk"]
        for method, value in by_method.items():
            order = list(colors).index(method)  # if curves coincide, the first is the widest and dashed ones lie on top
            line = {
                "color": colors[method],
                "linestyle": ("-", (0, (6, 3)), (0, (3, 3)), (0, (1, 2)))[max(order - 1, 0) % 4],
                "linewidth": (1.8, 4.5, 3.4, 2.4, 2.6)[min(order, 4)],
            }
            style = walk if method == "random walk" else line
            axes[0, column].plot(roughness, value[:, middle].mean(-1), label=method, **style)
            if method not in ("random walk", "plain"):
                distance = np.sqrt(np.mean((value - reference) ** 2, axis=(1, 2)))
                axes[1, column].plot(roughness, distance, label=method, **line)
        axes[0, column].set(title=name, xlabel="roughness", ylim=(0, 1.05))
        axes[1, column].set(xlabel="roughness", yscale="log")
        axes[1, column].grid(True)
    axes[0, 0].set_ylabel(f"albedo at mu = {comparison['mu'][middle]:g}, mean of channels")
    axes[1, 0].set_ylabel("RMS error of the albedo")
