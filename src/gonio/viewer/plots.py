"""`gonio plot` and `go.plot`: plots of the scattering by materials, computed with their `eval`, `pdf` and `sample`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..catalog import operands
from ..catalog.material import MaterialLike, material, title_of
from ..catalog.operands import Kind
from ..errors import InputError, did_you_mean
from ..material import BSDF
from ..owner import public
from . import curves, energy_figures, figures, fresnel_figure, image_slices, lobes
from .curves import Curve
from .figures import Drawing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS = ("lobe", "slice", "albedo", "image")
Color = str | tuple[float, float, float, float]
VIEWS = (0.0, 30.0, 60.0, 80.0)
_LONGEST = 70  # characters of a title or a label


@public
def plot(
    *materials: MaterialLike,
    kind: str = "lobe",
    angles: Sequence[float] | None = None,
    eta: float | None = None,
    k: float = 0.0,
    metal: str | None = None,
    output: str | Path | None = None,
) -> Drawing:
    """Plot lobes, slices or albedos of materials on common axes, or their image slices side by side.

        go.plot(go.Conductor.preset("Au", alpha=0.2), "lambert", kind="slice", output="two.png")
        go.plot("fresnel", eta=1.5)

    materials  anything that `go.material` accepts; or one folder written by `go.bake`; or "fresnel", the reflectance of
               an interface as a function of angle, from both sides, with approximations and their errors
    kind       "lobe" (polar plot), "slice" (over the angle of wi), "albedo" (over the angle of wo) or "image" (over
               half angle and difference angle)
    angles     up to 8 angles of wo from the normal, in degrees, in [0, 90); not for "albedo" and "image"
    eta, k     for "fresnel": the real part of the relative index of refraction, inside / outside, 1.5 if None; and the
               imaginary part
    metal      for "fresnel", instead of an index: a metal, such as "Au", at red, green and blue
    output     file to write, .png, .pdf or .svg; None writes nothing
    Returns a Drawing, which a notebook displays; its `figure` is a Matplotlib figure.
    Raises InputError for an invalid material, kind, angle or file.
    """
    if output is not None:
        figures.check_output(Path(output))
    if materials == ("fresnel",):
        drawing = fresnel_figure.draw(eta, k, metal)
    elif eta is not None or k or metal is not None:
        raise InputError("an index is given without fresnel", "plot", "plot fresnel, or use -p eta=1.5")
    elif len(materials) == 1 and isinstance(materials[0], str | Path) and is_tables(materials[0]):
        drawing = energy_figures.draw_tables(materials[0])
    else:
        named = [_named(material) for material in materials]
        drawing = _drawn(named, kind, _views(angles, named))
    return drawing if output is None else drawing.save(output)


def is_tables(text: str | Path) -> bool:
    """Whether `text` denotes a folder of baked tables. Raises InputError if it denotes neither that nor a material."""
    return operands.kind_of(text, {Kind.TABLES, *operands.MATERIALS}, "MODEL") is Kind.TABLES


def _named(given: MaterialLike) -> tuple[str, BSDF]:
    """A material and its label."""
    if isinstance(given, str | Path):
        operands.kind_of(given, operands.MATERIALS, "MODEL")  # raises an error that states the kind
    return title_of(given), material(given)


def _views(angles: Sequence[float] | None, named: Sequence[tuple[str, BSDF]]) -> tuple[float, ...]:
    """The plotted viewing angles, in degrees; by default, angles at which values are known."""
    known = [bsdf.angular_range.view for _, bsdf in named]
    low, high = min((ends[0] for ends in known), default=0.0), max((ends[1] for ends in known), default=90.0)
    if angles is None:
        return tuple(dict.fromkeys(min(max(view, low), high) for view in VIEWS))
    for angle in angles:
        if isinstance(angle, bool) or not isinstance(angle, int | float) or not 0 <= angle < 90:
            raise InputError(f"'{angle}' is not an angle of view", "--angles", "give degrees from 0 to below 90")
        if not low <= angle <= high:
            what = f"{angle:g} degrees of view requested, but {named[0][0]} is known from {low:.3g} to {high:.3g}"
            raise InputError(what, "--angles", f"such as {low:.3g},{high:.3g}")
    if not 1 <= len(angles) <= 8:
        raise InputError(f"{len(angles)} angles given, 1 to 8 expected", "--angles", "such as 0,45")
    return tuple(map(float, angles))


def _drawn(materials: Sequence[tuple[str, BSDF]], kind: str, views: Sequence[float]) -> Drawing:
    matplotlib = figures.load_matplotlib()

    if kind not in KINDS:
        raise InputError(f"unknown kind of plot '{kind}'", "--kind", did_you_mean(kind, KINDS))
    if not 1 <= len(materials) <= len(figures.PALETTE):
        what = f"{len(materials)} materials given, 1 to {len(figures.PALETTE)} expected"
        raise InputError(what, "plot", "draw several plots")
    labels = [_shortened(label) for label, _ in materials]
    bsdfs = [bsdf for _, bsdf in materials]
    title = labels[0] if len(labels) == 1 else _shortened(", ".join(dict.fromkeys(bsdf.name for bsdf in bsdfs)))
    with matplotlib.rc_context(figures.STYLE):
        if kind == "albedo":
            figure = _albedo(title, labels, bsdfs)
        elif kind == "image":
            figure = image_slices.draw(title, labels, bsdfs)
        else:
            panels = [[curves.curve(bsdf, view) for bsdf in bsdfs] for view in views]
            figure = (lobes.draw if kind == "lobe" else _slice)(title, labels, panels, _known(labels, bsdfs))
    return Drawing(figure, f"{kind}: {', '.join(labels)}")


def _known(labels: Sequence[str], bsdfs: Sequence[BSDF]) -> str:
    """The angles at which values are known, as text for the end of a subtitle; "" if there is no restriction."""
    parts = [
        f"{label} is known at {bsdf.angular_range}" if len(bsdfs) > 1 else f"known at {bsdf.angular_range}"
        for label, bsdf in zip(labels, bsdfs, strict=True)
        if not bsdf.angular_range.everything
    ]
    return "".join(f"; {part}" for part in parts)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def _slice(title: str, labels: Sequence[str], panels: Sequence[Sequence[Curve]], known: str = "") -> Figure:
    """Draw all views of a single material in one frame, or one frame per view for several materials, with the same
    scale.

    The scale is logarithmic if the peaks differ by a factor of more than 30.
    """
    from matplotlib.lines import Line2D

    subtitle = f"value f |cos θi|, mean of the channels, over wi in the plane of incidence{known}"
    views = [panel[0].view for panel in panels]
    if len(labels) == 1:
        colors: list[Color] = [_color_of_view(index, len(views)) for index in range(len(views))]
        names = [f"θo = {view:g}°" for view in views]
    else:
        colors, names = list(figures.PALETTE), list(labels)
    handles = [
        *(Line2D([], [], color=c, linewidth=1.8, label=name) for c, name in zip(colors, names, strict=False)),
        Line2D([], [], color=figures.SOFT, linewidth=1.8, label="value"),
        Line2D([], [], color=figures.SOFT, linewidth=1, linestyle=figures.DASHES, label="sampling density"),
        Line2D([], [], color=figures.SOFT, linewidth=0.8, linestyle=":", label="mirror direction"),
    ]
    if len(labels) == 1:
        figure = figures.blank(9.2, 5.0, title, subtitle)
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.805, 0.85), fontsize=9, handlelength=1.8)
        frames = [figure.add_axes((0.085, 0.115, 0.71, 0.72))]
        panels = [[curve for panel in panels for curve in panel]]
    else:
        figure, frames = _frames(views, title, subtitle, handles)
    everything = [curve for panel in panels for curve in panel]
    reach = 180 if any(curve.full for curve in everything) else 90
    top, logarithmic = _scale(everything)
    for axes, panel in zip(frames, panels, strict=True):
        for index, (curve, color) in enumerate(zip(panel, colors, strict=False)):
            _line(axes, curve, color, index)
        _frame(axes, reach, 30 if reach == 90 else 45 if len(frames) == 1 else 90)
        axes.set_xlabel("angle θi of wi from the normal (positive: the mirror's side)")
        axes.set_ylabel("1/sr" + (", logarithmic" if logarithmic else ""))
        if logarithmic:
            axes.set_yscale("log")
        axes.set_ylim(top * 1e-5 if logarithmic else 0, top * (2 if logarithmic else 1.06))
    return figure


def _frames(views: Sequence[float], title: str, subtitle: str, handles: Sequence[Artist]) -> tuple[Figure, list[Axes]]:
    """A figure with one frame per view, two per row, above a legend."""
    columns, rows = min(len(views), 2), math.ceil(len(views) / 2)
    width = max(0.3 + 4.9 * columns, 7.4)
    bottom = figures.legend_size(handles, width)[1]
    height = 0.75 + 3.3 * rows + bottom
    figure = figures.blank(width, height, title, subtitle)
    figures.legend_below(figure, handles)
    frames = []
    for index, view in enumerate(views):
        row, column = divmod(index, columns)
        x, y = (0.85 + 4.9 * column) / width, (bottom + 3.3 * (rows - 1 - row) + 0.55) / height
        axes = figure.add_axes((x, y, (width - 0.2 - 0.9 * columns) / columns / width, 2.4 / height))
        axes.set_title(f"θo = {view:g}°", fontsize=11, fontweight="bold")
        frames.append(axes)
    return figure, frames


def _scale(shown: Sequence[Curve]) -> tuple[float, bool]:
    """The highest value, and whether the axis must be logarithmic."""
    positive = [curve.peak for curve in shown if curve.peak > 0] or [1.0]
    return max(positive), max(positive) > 30 * min(1.0, *positive)


def _line(axes: Axes, curve: Curve, color: Color, index: int) -> None:
    axes.plot(curve.angles, curve.mean, color=color, linewidth=1.8)
    axes.plot(curve.angles, curve.pdf, color=color, linewidth=1, linestyle=figures.DASHES)
    axes.axvline(curve.view, color=color, linewidth=0.8, linestyle=":", zorder=0)
    for angle, strength in curve.deltas:
        axes.axvline(angle, color=color, linewidth=2)
        left = not 90 < angle < 145  # labels of reflection and transmission on different sides
        axes.annotate(
            f"δ {strength:.2f}",
            (angle, 0.97 - 0.06 * index),
            xycoords=("data", "axes fraction"),
            fontsize=8.5,
            color=color,
            xytext=(-4 if left else 4, 0),
            textcoords="offset points",
            ha="right" if left else "left",
            va="top",
        )


def _frame(axes: Axes, reach: int, step: int, first: int | None = None) -> None:
    """Set an x axis of angles from -reach, or `first`, to reach, without a frame at the top and on the right."""
    start = -reach if first is None else first
    axes.set_xlim(start, reach)
    axes.set_xticks(range(start, reach + 1, step))
    axes.set_xticklabels([f"{angle}°".replace("-", "−") for angle in range(start, reach + 1, step)])  # noqa: RUF001
    axes.grid(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _color_of_view(index: int, count: int) -> Color:
    from matplotlib import colormaps

    # Viridis without the yellow end, which is too pale on white.
    return colormaps["viridis"](0.08 + 0.72 * index / max(count - 1, 1))


def _albedo(title: str, labels: Sequence[str], bsdfs: Sequence[BSDF]) -> Figure:
    """Draw the directional albedo as a function of the angle of wo, and the limit of energy conservation."""
    known = _known(labels, bsdfs)
    subtitle = "fraction of the power that leaves, over wo"
    subtitle += known or f"; {curves.SAMPLES**2} stratified samples per point"
    subtitle += "; mean of the channels" if len(bsdfs) > 1 else ""
    figure = figures.blank(7.4, 4.6 if len(bsdfs) == 1 else 5.0, title, subtitle)
    axes = figure.add_axes((0.1, 0.125, 0.86, 0.7) if len(bsdfs) == 1 else (0.1, 0.215, 0.86, 0.625))
    angles = np.concatenate([np.linspace(0, 80, 33), np.linspace(81, 89.5, 18)])
    highest = 0.0
    for label, bsdf, color in zip(labels, bsdfs, figures.PALETTE, strict=False):
        low, high = bsdf.angular_range.view
        outside = (angles < low) | (angles > high)
        values = np.where(outside[:, None], np.nan, curves.albedo(bsdf, angles))
        highest = max(highest, float(np.nan_to_num(values).max()))
        if len(bsdfs) > 1:
            axes.plot(angles, values.mean(axis=1), color=color, linewidth=2, label=label)
        elif np.ptp(np.nan_to_num(values), axis=1).max() <= 1e-3:
            axes.plot(angles, values.mean(axis=1), color=figures.CHANNELS[2], linewidth=2)
        else:
            for channel, of_channel, name in zip(values.T, figures.CHANNELS, ("red", "green", "blue"), strict=False):
                axes.plot(angles, channel, color=of_channel, linewidth=2, label=name)
            axes.legend(loc="best", fontsize=9)
    if len(bsdfs) > 1:
        figures.legend_below(figure, axes.get_lines())
    axes.axhline(1, color=figures.INK, linewidth=1, linestyle=figures.DASHES)
    axes.annotate(
        "all of the light", (1, 1), xytext=(0, 4), textcoords="offset points", fontsize=8.5, color=figures.SOFT
    )
    axes.set_ylim(0, max(1.1, highest * 1.08))
    _frame(axes, 90, 15, first=0)
    axes.set_xlabel("angle θo of wo from the normal")
    axes.set_ylabel("directional albedo")
    return figure
