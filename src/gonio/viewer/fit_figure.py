"""The figure of a fit: the measured values, the fitted values, and their difference."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..fitting.fit import Fit
from ..measure import read
from ..measure.tables.base import Measurement
from ..measure.tables.half_difference import pair_at
from ..measure.tables.samples import Samples
from . import figures
from .figures import Drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Values = Callable[[Floats, Floats], Floats]
SIZE = 160  # size in pixels of a sphere, and of an image over theta_h and theta_d
LIGHT = np.array([-0.5, 0.6, 0.62])  # direction toward the light of the spheres
SLICES = (20.0, 60.0)  # angles of view, degrees


def draw(fit: Fit, table: str | Path | Measurement) -> Drawing:
    """Draw spheres under one light, slices in the plane of incidence, and images over theta_h and theta_d (Burley2012)
    of the data, the fit, and their difference relative to the larger value, on a scale that ends at 50 %."""
    matplotlib = figures.load_matplotlib()
    from matplotlib.figure import Figure

    source = table if isinstance(table, Measurement) else read(table)
    name = "measured, interpolated" if isinstance(source, Samples) else "measured"

    def measured(wo: Floats, wi: Floats) -> Floats:
        known = source.angular_range.holds(wo, wi)
        return np.where(known[:, None], source.rgb(wo, wi), np.nan)

    def fitted(wo: Floats, wi: Floats) -> Floats:
        return np.asarray(fit.material.eval(wo, wi), np.float64)

    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(10.0, 8.2), layout="constrained")
        axes = figure.subplots(3, 3)
        _spheres(axes[0], source.rgb, fitted, name)  # beyond the measured angles, as in renders
        _slices(axes[1], measured, fitted)
        _images(axes[2], measured, fitted, name)
        figure.suptitle("\n".join(textwrap.wrap(fit.text, 120)[:3]), fontsize=9)
        figure.supxlabel(f"mean error of {fit.count} values: {100.0 * fit.relative:.3g} %", fontsize=9)
    return Drawing(figure, str(fit))


def _spheres(axes: list[Axes], measured: Values, fitted: Values, name: str) -> None:
    y, x = np.mgrid[1.0 : -1.0 : SIZE * 1j, -1.0 : 1.0 : SIZE * 1j]
    inside = x * x + y * y < 0.995
    normal = np.stack([x[inside], y[inside], np.sqrt(1.0 - x[inside] ** 2 - y[inside] ** 2)], -1)
    tangent = np.stack([normal[:, 2], 0.0 * normal[:, 0], -normal[:, 0]], -1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    bitangent = np.cross(normal, tangent)

    def local(w: Floats) -> Floats:
        return np.stack([tangent @ w, bitangent @ w, normal @ w], -1)

    wo, wi = local(np.array([0.0, 0.0, 1.0])), local(LIGHT / np.linalg.norm(LIGHT))
    lit = wi[:, 2] > 1e-3
    pictures = []
    for values in (measured, fitted):
        radiance = np.zeros((len(wo), 3))
        radiance[lit] = values(_unit(wo[lit]), _unit(wi[lit]))
        picture = np.full((SIZE, SIZE, 3), np.nan)
        picture[inside] = radiance
        pictures.append(picture)
    white = max(float(np.nanpercentile(pictures[0], 98.0)), 1e-6)
    for axis, picture, title in zip(axes, pictures, (name, "fitted"), strict=False):
        shown = np.clip(np.nan_to_num(picture / white, nan=1.0), 0.0, 1.0) ** (1.0 / 2.2)
        axis.imshow(np.where(np.isnan(picture), 1.0, shown), interpolation="nearest")
        axis.set_title(f"{title}, one light", fontsize=10)
        axis.set_axis_off()
    _difference(axes[2], pictures[0], pictures[1])


def _slices(axes: list[Axes], measured: Values, fitted: Values) -> None:
    angles = np.radians(np.linspace(-85.0, 85.0, 341))
    wi = np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], -1)
    for axis, view in zip(axes, SLICES, strict=False):
        wo = np.tile([-np.sin(np.radians(view)), 0.0, np.cos(np.radians(view))], (len(wi), 1))
        a, b = (np.maximum(values(wo, wi), 1e-8) for values in (measured, fitted))
        for channel, color in enumerate(figures.CHANNELS):
            axis.semilogy(np.degrees(angles), a[:, channel], color=color, linewidth=1.6, alpha=0.45)
            axis.semilogy(np.degrees(angles), b[:, channel], color=color, linewidth=1.0, linestyle=figures.DASHES)
        top, least = (float(extreme([a, b])) for extreme in (np.nanmax, np.nanmin))
        axis.set_ylim(max(top * 1e-5, least * 0.5), top * 2.0)
        axis.set_title(f"viewed at {view:g} degrees", fontsize=10)
        axis.set_xlabel("angle of the light, degrees")
        axis.grid(True)
    axes[0].set_ylabel("f cos, 1/sr")
    axes[2].set_axis_off()
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=figures.INK, linewidth=1.6, alpha=0.45, label="measured"),
        Line2D([], [], color=figures.INK, linewidth=1.0, linestyle=figures.DASHES, label="fitted"),
        *(Line2D([], [], color=c, label=n) for c, n in zip(figures.CHANNELS, ("red", "green", "blue"), strict=True)),
    ]
    axes[2].legend(handles=lines, loc="center left")


def _images(axes: list[Axes], measured: Values, fitted: Values, name: str) -> None:
    """Draw images over the square root of theta_h (to the right) and theta_d (upward), at phi_d = 90 degrees."""
    x, y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
    theta_h, theta_d = x * x * (0.5 * np.pi), y * (0.5 * np.pi)
    wo, wi = pair_at(theta_h.ravel(), theta_d.ravel(), np.full(x.size, 0.5 * np.pi))
    above = (wo[:, 2] > 0.02) & (wi[:, 2] > 0.02)
    pictures = []
    for values in (measured, fitted):
        radiance = np.full((x.size, 3), np.nan)
        radiance[above] = values(_unit(wo[above]), _unit(wi[above])) / wi[above, 2:]
        pictures.append(radiance.reshape(SIZE, SIZE, 3))
    # values span decades: the cube root approximates perceived lightness
    white = max(float(np.nanpercentile(np.cbrt(np.abs(pictures[0])), 97.0)), 1e-6)
    for axis, image, title in zip(axes, pictures, (name, "fitted"), strict=False):
        shown = np.where(np.isnan(image), 1.0, np.clip(np.cbrt(np.maximum(image, 0.0)) / white, 0.0, 1.0))
        axis.imshow(shown, origin="lower", extent=(0.0, 1.0, 0.0, 90.0), aspect="auto", interpolation="nearest")
        axis.set_title(f"{title}, f by its cube root", fontsize=10)
        _half_difference_axes(axis)
    _difference(axes[2], pictures[0], pictures[1], over_angles=True)
    _half_difference_axes(axes[2])


def _half_difference_axes(axis: Axes) -> None:
    degrees = (0.0, 2.0, 10.0, 30.0, 60.0, 90.0)
    axis.set_xticks([float(np.sqrt(d / 90.0)) for d in degrees], [f"{d:g}" for d in degrees])
    axis.set_yticks([0.0, 30.0, 60.0, 90.0])
    axis.set_xlabel("theta_h, degrees")
    axis.set_ylabel("theta_d, degrees")


def _difference(axis: Axes, a: Floats, b: Floats, over_angles: bool = False) -> None:
    """Draw (b - a) / max(a, b) for the means over the channels, from -50 to 50 %."""
    one, other = a.mean(-1), b.mean(-1)
    largest = np.maximum(np.maximum(np.abs(one), np.abs(other)), 1e-3 * np.nanmax(np.abs(one)))
    image = axis.imshow(
        100.0 * (other - one) / largest,
        cmap="RdBu_r",
        vmin=-50.0,
        vmax=50.0,
        interpolation="nearest",
        origin="lower" if over_angles else "upper",
        extent=(0.0, 1.0, 0.0, 90.0) if over_angles else None,
        aspect="auto" if over_angles else "equal",
    )
    assert axis.figure is not None
    bar = axis.figure.colorbar(image, ax=axis, shrink=0.85)
    bar.set_label("%, red: fitted is brighter", fontsize=8)
    axis.set_title("difference", fontsize=10)
    if not over_angles:
        axis.set_axis_off()


def _unit(w: Floats) -> Floats:
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))
