"""`gonio plot`: what a material does with light, drawn from its own `eval`, `pdf` and `sample`.

Everything lies in the plane of incidence. `wo`, toward the viewer, leans to the left by theta_o; angles to the
right of the normal, where a mirror would send the light, count positive.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from ..models import BSDF, notation
from . import figures

KINDS = ("lobe", "slice", "albedo")
ANGLES = {"lobe": (0.0, 30.0, 60.0, 80.0), "slice": (0.0, 30.0, 60.0, 80.0), "albedo": ()}

STEP = 0.05  # degrees between directions: a GGX lobe of alpha 0.01 is 0.6 degrees wide at half its height
_DASHES = (0, (4, 2))
_DELTA = "#b5651d"
_HALO = {"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
SAMPLES = 64  # per axis and point of an albedo curve: 4096 stratified samples, about 0.2 % of noise


def plot(
    name: str,
    parameters: list[str],
    preset: str = "",
    kind: str = "lobe",
    angles: str = "",
    output: Path | None = None,
) -> Path:
    """Draw a material by name, with parameters as typed ("alpha=.3"); the file's path.

    kind    "lobe" (polar), "slice" (over the angle of wi) or "albedo" (over the angle of wo)
    angles  of wo, degrees, such as "0,45"; not for "albedo"
    Raises InputError for a material, parameter or angle that cannot be.
    """
    if kind not in KINDS:
        raise InputError(f"unknown kind of plot '{kind}'", "--kind", did_you_mean(kind, KINDS))
    bsdf, values = notation.named(name, parameters, preset)
    path = figures.check_output(output or Path(f"{bsdf.name}-{kind}.png"))
    views = parse_angles(angles) if angles else ANGLES[kind]
    shown = ", ".join(f"{key} = {notation.written(value)}" for key, value in values.items())
    draw(bsdf, bsdf.name + (f": {shown}" if shown else ""), kind, views, path)
    return path


def parse_angles(text: str) -> tuple[float, ...]:
    """Degrees from the normal, 0 to below 90, at most 8."""
    angles = figures.split_values(text)
    for angle in angles:
        if isinstance(angle, bool) or not isinstance(angle, int | float) or not 0 <= angle < 90:
            raise InputError(f"'{angle}' is no angle of view", "--angles", "give degrees from 0 to below 90")
    if len(angles) > 8:
        raise InputError(f"{len(angles)} angles are too many to tell apart", "--angles", "give up to 8")
    return tuple(float(angle) for angle in angles)


# --- numbers -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Curve:
    """One view: values and density over the angle of wi (degrees), and what delta lobes reflect where."""

    view: float
    angles: np.ndarray
    values: np.ndarray  # eval, (N, channels), 1/sr
    pdf: np.ndarray  # (N,), 1/sr
    deltas: tuple[tuple[float, float], ...]  # (angle of wi in degrees, weight)

    @property
    def mean(self) -> np.ndarray:
        return self.values.mean(axis=1)

    @property
    def grey(self) -> bool:
        spread = np.ptp(self.values, axis=1).max()
        return bool(spread <= 1e-4 * self.values.max())


def curve(bsdf: BSDF, view: float) -> Curve:
    """Evaluate a material in the plane of incidence, for wo at `view` degrees from the normal."""
    reach = 180 if bsdf.transmits else 90
    angles = np.linspace(-reach, reach, round(2 * reach / STEP) + 1)
    theta = np.radians(angles)
    wi = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    wo = np.broadcast_to(_toward(view), wi.shape)
    values, pdf = np.asarray(bsdf.eval(wo, wi)), np.asarray(bsdf.pdf(wo, wi))
    return Curve(view, angles, values, pdf, _deltas(bsdf, view))


def _toward(view: float) -> np.ndarray:
    theta = math.radians(view)
    return np.array([-math.sin(theta), 0.0, math.cos(theta)])


def _deltas(bsdf: BSDF, view: float) -> tuple[tuple[float, float], ...]:
    u = (np.arange(64) + 0.5) / 64
    drawn = bsdf.sample(np.broadcast_to(_toward(view), (64, 3)), np.stack([u, np.full(64, 0.5), np.full(64, 0.5)], 1))
    found: dict[float, float] = {}
    for index in np.flatnonzero(np.asarray(drawn.delta) & (np.asarray(drawn.pdf) > 0)):
        x, _, z = np.asarray(drawn.wi)[index]
        # A delta lobe's share of the power: its weight times the probability with which it is chosen, without
        # the (eta_o/eta_i)^2 of transmitted radiance.
        probability, eta = float(np.asarray(drawn.pdf)[index]), float(np.asarray(drawn.eta)[index])
        strength = float(np.mean(np.asarray(drawn.weight)[index])) * probability * eta**2
        found[round(math.degrees(math.atan2(x, z)), 2)] = strength
    return tuple(found.items())


def albedo(bsdf: BSDF, views: np.ndarray) -> np.ndarray:
    """Share of the power that leaves, (views, channels): the mean weight of stratified samples.

    Transmitted radiance carries (eta_o/eta_i)^2; power does not, hence the factor sample.eta^2.
    """
    rng = np.random.default_rng(1)
    count = SAMPLES * SAMPLES
    x, y = np.meshgrid(np.arange(SAMPLES), np.arange(SAMPLES))
    cells = np.stack([x.ravel(), y.ravel()], axis=1)
    # The lobe's number is stratified too, in an order of its own.
    u = np.concatenate([rng.permutation(count)[:, None] / count, cells / SAMPLES], axis=1)
    u = u + rng.random(u.shape) * [1 / count, 1 / SAMPLES, 1 / SAMPLES]
    rows = []
    for view in views:
        drawn = bsdf.sample(np.broadcast_to(_toward(view), (count, 3)), np.minimum(u, 1 - 2**-24))
        rows.append((np.asarray(drawn.weight) * np.asarray(drawn.eta)[:, None] ** 2).mean(axis=0))
    return np.array(rows)


# --- the drawing ---------------------------------------------------------------------------------------


def draw(bsdf: BSDF, title: str, kind: str, views: tuple[float, ...], path: Path) -> Path:
    """Draw one kind of plot into a file."""
    import matplotlib

    matplotlib.use("Agg")
    drawings: dict[str, Callable[[BSDF, str, tuple[float, ...]], Any]] = {
        "lobe": _lobes,
        "slice": _slice,
        "albedo": _albedo,
    }
    with matplotlib.rc_context(figures.STYLE):
        return figures.save(drawings[kind](bsdf, title, views), path, 150, title)


def _figure(width: float, height: float, title: str, subtitle: str) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    left = 0.3 / width
    figure.text(left, 1 - 0.38 / height, title, fontsize=14, fontweight="bold", va="baseline")
    figure.text(left, 1 - 0.62 / height, subtitle, fontsize=9.5, color=figures.SOFT, va="baseline")
    return figure


def _colour_of_view(index: int, count: int) -> Any:
    from matplotlib import colormaps

    # Viridis without its yellow end, which is too pale on white.
    return colormaps["viridis"](0.08 + 0.72 * index / max(count - 1, 1))


def _lobes(bsdf: BSDF, title: str, views: tuple[float, ...]) -> Any:
    """One polar panel a view, each with a scale of its own: peaks differ by orders of magnitude."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    curves = [curve(bsdf, view) for view in views]
    columns = len(views) if len(views) <= 3 else math.ceil(len(views) / 2)
    rows = math.ceil(len(views) / columns)
    full = bsdf.transmits
    panel_width, panel_height = 3.9, (3.75 if full else 2.45)
    top, bottom, side = 0.85, 0.5, 0.25
    width = max(2 * side + columns * panel_width, 7.2)
    height = top + rows * panel_height + bottom
    subtitle = "value f |cos θi| and sampling density over wi, in 1/sr"
    subtitle += "; reflection and transmission have a scale each" if full else "; each panel has its own scale"
    figure = _figure(width, height, title, subtitle)
    indent = (width - columns * panel_width) / 2
    for index, one in enumerate(curves):
        row, column = divmod(index, columns)
        x, y = indent + column * panel_width, bottom + (rows - 1 - row) * panel_height
        axes = figure.add_axes((x / width, y / height, panel_width / width, panel_height / height))
        _lobe(axes, one, full)
        # Equal units on both axes: as many as the panel's inches allow for a disc of radius 1.45 inches.
        axes.set_xlim(-panel_width / 2 / 1.45, panel_width / 2 / 1.45)
        low = -1.17 if full else -0.32
        axes.set_ylim(low, low + panel_height / 1.45)
    grey = all(one.grey for one in curves)
    handles: list[Any] = []
    if grey:
        face = (*_rgb(figures.CHANNELS[2]), 0.2)
        handles.append(Patch(facecolor=face, edgecolor=figures.CHANNELS[2], linewidth=1.4, label="value"))
    else:
        names = zip(figures.CHANNELS, ("red", "green", "blue"), strict=True)
        handles += [Line2D([], [], color=colour, label=f"value, {name}") for colour, name in names]
    handles.append(Line2D([], [], color=figures.INK, linestyle=_DASHES, linewidth=1, label="sampling density"))
    if any(one.deltas for one in curves):
        label = "delta lobe, its share"
        handles.append(Line2D([], [], color=_DELTA, linewidth=2, marker="^", markersize=6, label=label))
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), fontsize=9.5, bbox_to_anchor=(0.5, 0.01))
    return figure


def _rgb(colour: str) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    return to_rgb(colour)


def _lobe(axes: Any, one: Curve, full: bool) -> None:
    """A polar diagram in plain axes: the disc has radius 1, the normal points up, wi is at (sin, cos)."""
    axes.set_axis_off()
    axes.text(0, 1.24, f"θo = {one.view:g}°", fontsize=12, fontweight="bold", ha="center", va="baseline")
    theta = np.radians(one.angles)
    above = np.abs(one.angles) <= 90
    for side, inside in ((1, above), (-1, ~above)) if full else ((1, above),):
        peak = max(float(x[inside].max(initial=0)) for x in (one.values, one.pdf))
        _grid(axes, side, peak, full)
        if not peak > 0:
            continue
        radius = 1 / (1.06 * peak)

        def place(
            values: np.ndarray, inside: np.ndarray = inside, radius: float = radius
        ) -> tuple[np.ndarray, np.ndarray]:
            # The other side is zero, which puts it at the origin: the outline closes there.
            r = np.where(inside, values, 0) * radius
            return r * np.sin(theta), r * np.cos(theta)

        channels = [one.mean] if one.grey else list(one.values.T)
        colours = figures.CHANNELS[2:] if one.grey else figures.CHANNELS
        for channel, colour in zip(channels, colours, strict=False):
            axes.fill(*place(channel), color=colour, alpha=0.2 if one.grey else 0.07, linewidth=0)
            axes.plot(*place(channel), color=colour, linewidth=1.6)
        axes.plot(*place(one.pdf), color=figures.INK, linewidth=1, linestyle=_DASHES)
    view = -math.radians(one.view)
    x, y = math.sin(view), math.cos(view)
    arrow = {"arrowstyle": "-|>", "color": figures.SOFT, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (x, y), (0, 0), arrowprops=arrow)
    # Labels stand beside their arrows, on the upper side; where the arrow is steep, on the left.
    aside = (y, -x) if one.view > 20 else (-1, 0)
    x, y = 0.8 * x + 0.08 * aside[0], 0.8 * y + 0.08 * aside[1]
    axes.text(x, y, "wo", fontsize=9.5, color=figures.SOFT, ha="center", va="center")
    for angle, strength in one.deltas:
        x, y = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        axes.annotate("", (x, y), (0, 0), arrowprops=arrow | {"color": _DELTA, "linewidth": 2})
        x, y = 0.55 * x - 0.12 * y, 0.55 * y + 0.12 * x
        axes.text(x, y, f"{strength:.2f}", fontsize=9.5, color=_DELTA, ha="center", va="center")


def _grid(axes: Any, side: int, peak: float, full: bool) -> None:
    """Half a polar grid; `side` 1 is above the surface, -1 below.

    Rings carry their value: of a half disc below the surface line, where nothing is drawn; of a full disc in
    their own half, on the left, where least is.
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


def _slice(bsdf: BSDF, title: str, views: tuple[float, ...]) -> Any:
    """All views in one frame over the angle of wi; logarithmic where the peaks differ by more than 30."""
    from matplotlib.lines import Line2D

    figure = _figure(9.2, 5.0, title, "value f |cos θi|, mean of the channels, over wi in the plane of incidence")
    axes = figure.add_axes((0.085, 0.115, 0.71, 0.72))
    curves = [curve(bsdf, view) for view in views]
    peaks = [max(float(one.mean.max()), float(one.pdf.max())) for one in curves]
    positive = [peak for peak in peaks if peak > 0]
    logarithmic = (bool(positive) and max(positive) > 30 * min(positive)) or max(peaks, default=0) > 30
    for index, one in enumerate(curves):
        colour = _colour_of_view(index, len(curves))
        axes.plot(one.angles, one.mean, color=colour, linewidth=1.8)
        axes.plot(one.angles, one.pdf, color=colour, linewidth=1, linestyle=_DASHES)
        axes.axvline(one.view, color=colour, linewidth=0.8, linestyle=":", zorder=0)
        for angle, strength in one.deltas:
            axes.axvline(angle, color=colour, linewidth=2)
            axes.annotate(
                f"δ {strength:.2f}",
                (angle, 0.97 - 0.06 * index),
                xycoords=("data", "axes fraction"),
                fontsize=8.5,
                color=colour,
                xytext=(4, 0),
                textcoords="offset points",
                va="top",
            )
    reach = 180 if bsdf.transmits else 90
    axes.set_xlim(-reach, reach)
    step = 45 if reach == 180 else 30
    axes.set_xticks(range(-reach, reach + 1, step))
    axes.set_xticklabels([f"{angle}°".replace("-", "−") for angle in range(-reach, reach + 1, step)])  # noqa: RUF001
    axes.set_xlabel("angle θi of wi from the normal (positive: the mirror's side)")
    axes.set_ylabel("1/sr" + (", logarithmic" if logarithmic else ""))
    top = max(peaks, default=1) or 1
    if logarithmic:
        axes.set_yscale("log")
        axes.set_ylim(top * 1e-5, top * 2)
    else:
        axes.set_ylim(0, top * 1.06)
    axes.grid(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    handles = [
        Line2D([], [], color=_colour_of_view(i, len(views)), linewidth=1.8, label=f"θo = {view:g}°")
        for i, view in enumerate(views)
    ]
    handles += [
        Line2D([], [], color=figures.SOFT, linewidth=1.8, label="value"),
        Line2D([], [], color=figures.SOFT, linewidth=1, linestyle=_DASHES, label="sampling density"),
        Line2D([], [], color=figures.SOFT, linewidth=0.8, linestyle=":", label="mirror direction"),
    ]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.805, 0.85), fontsize=9, handlelength=1.8)
    return figure


def _albedo(bsdf: BSDF, title: str, views: tuple[float, ...]) -> Any:
    """Directional albedo over the angle of wo, and the line of energy conservation."""
    subtitle = f"share of the power that leaves, over wo; each point {SAMPLES**2} stratified samples"
    figure = _figure(7.4, 4.6, title, subtitle)
    axes = figure.add_axes((0.1, 0.125, 0.86, 0.7))
    angles = np.concatenate([np.linspace(0, 80, 33), np.linspace(81, 89.5, 18)])
    values = albedo(bsdf, angles)
    if np.ptp(values, axis=1).max() <= 1e-3:
        axes.plot(angles, values.mean(axis=1), color=figures.CHANNELS[2], linewidth=2)
    else:
        for channel, colour, name in zip(values.T, figures.CHANNELS, ("red", "green", "blue"), strict=False):
            axes.plot(angles, channel, color=colour, linewidth=2, label=name)
        axes.legend(loc="best", fontsize=9)
    axes.axhline(1, color=figures.INK, linewidth=1, linestyle=_DASHES)
    axes.annotate(
        "all of the light", (1, 1), xytext=(0, 4), textcoords="offset points", fontsize=8.5, color=figures.SOFT
    )
    axes.set_xlim(0, 90)
    axes.set_ylim(0, max(1.1, float(values.max()) * 1.08))
    axes.set_xticks(range(0, 91, 15))
    axes.set_xticklabels([f"{angle}°" for angle in range(0, 91, 15)])
    axes.set_xlabel("angle θo of wo from the normal")
    axes.set_ylabel("directional albedo")
    axes.grid(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure
