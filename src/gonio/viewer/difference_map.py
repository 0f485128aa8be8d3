"""The difference between two materials: a map over the angles of view and light, and both albedos."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..energy.difference import Difference
from ..material import BSDF
from . import figures
from .figures import Drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEPS = 180  # cells along each axis: half a degree of view, one degree of light
_LONGEST = 44  # characters of a name


def relative(a: BSDF, b: BSDF, compared: Difference, steps: int = STEPS) -> NDArray[np.float64]:
    """(f_A - f_B) / max(f_A, f_B) in the plane of incidence, over theta_o (rows, 0 first) and theta_i from -90 to 90
    degrees (columns, positive on the side of the mirror direction); NaN where f_A or f_B is unknown, or both are 0.

    compared  the comparison of the two materials
    steps     number of values of theta_o
    """
    view = (np.arange(steps) + 0.5) / steps * 90.0
    light = (np.arange(steps) + 0.5) / steps * 180.0 - 90.0
    theta_o, theta_i = (np.radians(angles.ravel()) for angles in np.meshgrid(view, light, indexing="ij"))
    wo = np.stack([-np.sin(theta_o), 0.0 * theta_o, np.cos(theta_o)], axis=1)
    wi = np.stack([np.sin(theta_i), 0.0 * theta_i, np.cos(theta_i)], axis=1)
    of_a, of_b = (np.asarray(one.eval(wo, wi), float).mean(axis=1) for one in (a, b))
    larger = np.maximum(np.abs(of_a), np.abs(of_b))
    usable = compared.known.holds(wo, wi) & (larger > 0.0)
    values = np.where(usable, (of_a - of_b) / np.where(larger > 0.0, larger, 1.0), np.nan)
    return values.reshape(steps, steps)


def draw(name_a: str, name_b: str, a: BSDF, b: BSDF, compared: Difference) -> Drawing:
    """Draw the map in the plane of incidence, red where A is brighter, and the albedos as functions of the viewing
    angle."""
    matplotlib = figures.load_matplotlib()

    title = f"{_short(name_a)} (A) and {_short(name_b)} (B)"
    subtitle = f"mean difference {100.0 * compared.mean:.3g} % of B, largest {100.0 * compared.largest:.3g} %"
    with matplotlib.rc_context(figures.STYLE):
        figure = figures.blank(9.6, 4.6, title, subtitle)
        axes = figure.add_axes((0.07, 0.12, 0.36, 0.68))
        values, extent = relative(a, b, compared), (-90.0, 90.0, 0.0, 90.0)
        shown = axes.imshow(values, cmap="RdBu_r", vmin=-1, vmax=1, origin="lower", extent=extent, aspect="auto")
        axes.set_facecolor("#b8bcc2")  # where values are not known
        axes.set_xticks(range(-90, 91, 30))
        axes.set_yticks(range(0, 91, 15))
        axes.set_xlabel("angle θi of wi, degrees (positive: the mirror's side)")
        axes.set_ylabel("angle θo of wo, degrees")
        bar = figure.colorbar(shown, cax=figure.add_axes((0.445, 0.12, 0.014, 0.68)))
        bar.set_label("(A - B) / max(A, B)")
        _albedos(figure.add_axes((0.62, 0.12, 0.35, 0.68)), compared)
    return Drawing(figure, f"{title}: {subtitle}")


def _albedos(axes: Axes, compared: Difference) -> None:
    angles = [view.theta for view in compared.views]
    for index, (name, line) in enumerate((("A", "-"), ("B", "--"))):
        values = np.array([view.albedo[index] for view in compared.views])
        for channel, color in zip(values.T, figures.CHANNELS, strict=True):
            axes.plot(angles, channel, line, color=color, linewidth=1.6, marker="o", markersize=3)
        axes.plot([], [], line, color=figures.INK, label=name)
    axes.set_xlim(0, 90)
    axes.set_xticks(range(0, 91, 15))
    axes.set_ylim(0, max(1.05, 1.05 * max(float(view.albedo.max()) for view in compared.views)))
    axes.set_xlabel("angle θo of wo, degrees")
    axes.set_ylabel("directional albedo")
    axes.grid(True)
    axes.legend(loc="best", fontsize=9)


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
