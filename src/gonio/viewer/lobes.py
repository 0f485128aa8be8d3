"""Lobes as polar diagrams, with one panel per view direction that shows all materials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from . import figures
from .curves import Curve, Floats

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DELTA = "#b5651d"
_HALO = {"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
_RADIUS = 1.45  # radius of a panel's disk, inches


def draw(title: str, labels: Sequence[str], panels: Sequence[Sequence[Curve]], known: str = "") -> Figure:
    """Draw the figure. Each panel has its own scale, because peaks differ by orders of magnitude.

    labels  names of the materials
    panels  one list per view, with the curve of each material in the order of the labels
    known   statement of the angles at which values are known
    """
    columns = len(panels) if len(panels) <= 3 else math.ceil(len(panels) / 2)
    rows = math.ceil(len(panels) / columns)
    full = any(curve.full for curve in panels[0])
    panel_width, panel_height = 3.9, (3.75 if full else 2.45)
    side = 0.25
    width = max(2 * side + columns * panel_width, 7.2)
    handles = _handles(labels, [curve for panel in panels for curve in panel])
    top, bottom = 0.85, figures.legend_size(handles, width)[1]
    height = top + rows * panel_height + bottom
    mean = " (mean of the channels)" if len(labels) > 1 else ""
    subtitle = f"value f |cos θi|{mean} and sampling density over wi, in 1/sr"
    subtitle += "; reflection and transmission have separate scales" if full else "; each panel has its own scale"
    figure = figures.blank(width, height, title, subtitle + known)
    indent = (width - columns * panel_width) / 2
    for index, curves in enumerate(panels):
        row, column = divmod(index, columns)
        x, y = indent + column * panel_width, bottom + (rows - 1 - row) * panel_height
        axes = figure.add_axes((x / width, y / height, panel_width / width, panel_height / height))
        _panel(axes, curves, full)
        # Both axes have the same scale; the panel's size determines their ranges.
        axes.set_xlim(-panel_width / 2 / _RADIUS, panel_width / 2 / _RADIUS)
        low = -1.17 if full else -0.32
        axes.set_ylim(low, low + panel_height / _RADIUS)
    figures.legend_below(figure, handles)
    return figure


def _handles(labels: Sequence[str], curves: Sequence[Curve]) -> list[Artist]:
    from matplotlib.colors import to_rgba
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Artist] = []
    if len(labels) > 1:
        for label, color in zip(labels, figures.PALETTE, strict=False):
            face = to_rgba(color, 0.12)
            handles.append(Patch(facecolor=face, edgecolor=color, linewidth=1.4, label=label))
    elif all(curve.gray for curve in curves):
        color = figures.CHANNELS[2]
        handles.append(Patch(facecolor=to_rgba(color, 0.2), edgecolor=color, linewidth=1.4, label="value"))
    else:
        names = zip(figures.CHANNELS, ("red", "green", "blue"), strict=True)
        handles += [Line2D([], [], color=color, label=f"value, {name}") for color, name in names]
    ink = figures.INK if len(labels) == 1 else figures.SOFT
    handles.append(Line2D([], [], color=ink, linestyle=figures.DASHES, linewidth=1, label="sampling density"))
    if any(curve.deltas for curve in curves):
        color = _DELTA if len(labels) == 1 else figures.SOFT
        label = "delta lobe, its albedo"
        handles.append(Line2D([], [], color=color, linewidth=2, marker="^", markersize=6, label=label))
    return handles


def _panel(axes: Axes, curves: Sequence[Curve], full: bool) -> None:
    """Draw a polar diagram in Cartesian axes: the disk has radius 1, the normal points up, and wi is at (sin, cos)."""
    axes.set_axis_off()
    view = curves[0].view
    axes.text(0, 1.24, f"θo = {view:g}°", fontsize=12, fontweight="bold", ha="center", va="baseline")
    for side in (1, -1) if full else (1,):
        peak = max(_peak(curve, side) for curve in curves)
        _grid(axes, side, peak, full)
        for index, curve in enumerate(curves):
            if peak > 0:
                _lobe(axes, curve, side, 1 / (1.06 * peak), figures.PALETTE[index] if len(curves) > 1 else "")
    x, y = math.sin(-math.radians(view)), math.cos(math.radians(view))
    _arrow(axes, x, y, figures.SOFT, 1)
    # Labels are next to their arrows: on the upper side, or on the left of steep arrows.
    aside = (y, -x) if view > 20 else (-1, 0)
    x, y = 0.8 * x + 0.08 * aside[0], 0.8 * y + 0.08 * aside[1]
    axes.text(x, y, "wo", fontsize=9.5, color=figures.SOFT, ha="center", va="center")
    for index, curve in enumerate(curves):
        color = _DELTA if len(curves) == 1 else figures.PALETTE[index]
        for angle, strength in curve.deltas:
            x, y = math.sin(math.radians(angle)), math.cos(math.radians(angle))
            _arrow(axes, x, y, color, 2)
            # Labels of coincident arrows are placed below each other.
            along = 0.55 + 0.16 * index
            x, y = along * x - 0.12 * y, along * y + 0.12 * x
            axes.text(x, y, f"{strength:.2f}", fontsize=9.5, color=color, ha="center", va="center")


def _peak(curve: Curve, side: int) -> float:
    inside = curve.side(side)
    return max(float(np.nan_to_num(values[inside]).max(initial=0)) for values in (curve.values, curve.pdf))


def _lobe(axes: Axes, curve: Curve, side: int, radius: float, color: str) -> None:
    """Draw values and density on one side of the surface, multiplied by `radius`. `color` is "" for a single
    material."""
    theta = np.radians(curve.angles)

    def place(values: Floats) -> tuple[Floats, Floats]:
        # The other side and unknown values are set to 0 (the origin), where the outline closes.
        r = np.nan_to_num(np.where(curve.side(side), values, 0)) * radius
        return r * np.sin(theta), r * np.cos(theta)

    if color or curve.gray:
        channels, colors, fill = [curve.mean], [color or figures.CHANNELS[2]], 0.12 if color else 0.2
    else:
        channels, colors, fill = list(curve.values.T), list(figures.CHANNELS), 0.07
    for channel, of_channel in zip(channels, colors, strict=False):
        axes.fill(*place(channel), color=of_channel, alpha=fill, linewidth=0)
        axes.plot(*place(channel), color=of_channel, linewidth=1.6)
    axes.plot(*place(curve.pdf), color=color or figures.INK, linewidth=1, linestyle=figures.DASHES)


def _arrow(axes: Axes, x: float, y: float, color: str, width: float) -> None:
    arrow = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0, "linewidth": width}
    axes.annotate("", (x, y), (0, 0), arrowprops=arrow)


def _grid(axes: Axes, side: int, peak: float, full: bool) -> None:
    """Draw one half of a polar grid; `side` is 1 above the surface and -1 below.

    Rings are labeled with their values: in a half disk, below the surface line, where the plot is empty; in a full
    disk, on the left of the same half.
    """
    ticks = _round_ticks(peak)
    arc = np.linspace(-math.pi / 2, math.pi / 2, 181)
    for tick in ticks:
        r = tick / (1.06 * peak)
        axes.plot(r * np.sin(arc), side * r * np.cos(arc), color=figures.FAINT, linewidth=0.7, zorder=0)
        x, y = (-r, side * 0.07) if full else (r, -0.07)
        axes.text(x, y, f"{tick:g}", fontsize=7.5, color=figures.SOFT, ha="center", va="center", bbox=_HALO)
    if ticks:
        x, y = (-1.12, side * 0.13) if full else (1.12, -0.12)
        axes.text(x, y, "1/sr", fontsize=7.5, color=figures.SOFT, ha="center", va="center")
    axes.plot(np.sin(arc), side * np.cos(arc), color=figures.SOFT, linewidth=0.8, zorder=0)
    for angle in range(-90, 91, 30):
        x, y = math.sin(math.radians(angle)), side * math.cos(math.radians(angle))
        if abs(angle) < 90:
            axes.plot([0, x], [0, y], color=figures.FAINT, linewidth=0.7, zorder=0)
        if abs(angle) == 90 and side < 0:
            continue  # written by the upper half
        shown = angle if side > 0 else (180 if angle == 0 else math.copysign(180 - abs(angle), angle))
        text = f"{shown:g}°".replace("-", "−")  # noqa: RUF001
        horizontal = "center" if abs(angle) < 20 else ("right" if angle < 0 else "left")
        axes.text(1.05 * x, 1.05 * y, text, fontsize=8, color=figures.SOFT, ha=horizontal, va="center")
    axes.plot([-1, 1], [0, 0], color=figures.INK, linewidth=1.1, zorder=1)


def _round_ticks(peak: float) -> list[float]:
    """Two to four round numbers up to the peak."""
    if not peak > 0:
        return []
    step = 10.0 ** math.floor(math.log10(peak))
    step = next(step * factor for factor in (0.2, 0.5, 1, 2, 5) if peak / (step * factor) < 4.5)
    return [float(f"{step * n:.6g}") for n in range(1, int(peak / step) + 1)]
