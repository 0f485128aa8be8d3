"""`gonio plot fresnel`: reflectances as functions of the angle, from both sides, and the errors of approximations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, did_you_mean
from ..ops import backend
from ..optics import fresnel, indices
from . import figures
from .figures import Drawing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Reals: TypeAlias = NDArray[np.float64]

APPROXIMATIONS = {"schlick": "Schlick", "f82": "F82"}
ANGLES = np.concatenate([np.linspace(0.0, 80.0, 321), np.linspace(80.0, 90.0, 201)[1:]])  # degrees
LINES = {"schlick": (0, (5, 2)), "f82": (0, (1, 1.4))}
INDICES = (0.1, 4.0)  # range of the map
GLASS = (1.05, 3.0)  # range without absorption; at 1, there is no surface, but the curve still ends at 1


class Index(NamedTuple):
    """An index of refraction to plot: its label, its color, eta and k."""

    label: str
    color: str
    eta: float
    k: float


def draw(eta: float | None = None, k: float = 0.0, metal: str | None = None) -> Drawing:
    """The figure of one interface, given by an index eta + i k, or by the name of a metal at red, green and blue.

    Raises InputError for an impossible index or an unknown metal.
    """
    matplotlib = figures.load_matplotlib()

    if metal is not None:
        if eta is not None or k:
            raise InputError("both an index and a metal are given", "--metal", "keep one")
        lines, title = _of_metal(metal)
    else:
        eta = 1.5 if eta is None else eta
        fresnel.fresnel(0.0, eta, k)  # raises for an impossible index
        name = f"{eta:g}" + (f" + {k:g} i" if k else "")
        lines, title = [Index("", figures.PALETTE[0], eta, k)], f"Fresnel reflectance, n = {name}"
    with matplotlib.rc_context(figures.STYLE):
        figure = _figure(title, lines)
    return Drawing(figure, title)


def _of_metal(name: str) -> tuple[list[Index], str]:
    metals = indices.METALS
    known = {key.lower(): key for key in metals} | {metal.name: key for key, metal in metals.items()}
    key = known.get(name.lower())
    if key is None:
        raise InputError(f"unknown metal '{name}'", "--metal", did_you_mean(name, list(metals)))
    metal = metals[key]
    rows = zip(("650 nm", "550 nm", "450 nm"), figures.CHANNELS, metal.eta, metal.k, strict=True)
    return [Index(*row) for row in rows], f"Fresnel reflectance of {metal.name}"


def _figure(title: str, lines: Sequence[Index]) -> Figure:
    glass = all(line.k == 0.0 for line in lines)
    subtitle = "unpolarized light R = (Rs + Rp) / 2, and each polarization; below, the errors of approximations of R"
    figure = figures.blank(13.2, 7.2, title, subtitle)
    left, middle = (figure.add_axes((x, 0.47, 0.255, 0.37)) for x in (0.07, 0.39))
    below_left, below_middle = (figure.add_axes((x, 0.17, 0.255, 0.2)) for x in (0.07, 0.39))
    map_axes = figure.add_axes((0.71, 0.17, 0.205, 0.67))
    _reflectances(left, below_left, lines, "from outside")
    if glass:
        inside = [line._replace(eta=1.0 / line.eta) for line in lines]
        _reflectances(middle, below_middle, inside, "from inside")
    else:
        _phases(middle, lines)
        _differences(below_middle, lines)
    _map(figure, map_axes, lines)
    figures.legend_below(figure, _legend(lines))
    return figure


def _reflectances(axes: Axes, below: Axes, lines: Sequence[Index], side: str) -> None:
    """Draw both polarizations, their mean and the approximations, with the errors of the approximations below."""
    for line in lines:
        at = fresnel.fresnel(np.radians(ANGLES), line.eta, line.k)
        width = 1.0 if len(lines) > 1 else 1.4
        colors = (line.color,) * 2 if len(lines) > 1 else (figures.PALETTE[2], figures.PALETTE[1])
        axes.plot(ANGLES, at.R_s, color=colors[0], linewidth=width, alpha=0.55 if len(lines) > 1 else 1.0)
        axes.plot(ANGLES, at.R_p, color=colors[1], linewidth=width, alpha=0.55 if len(lines) > 1 else 1.0)
        axes.plot(ANGLES, at.R, color=line.color, linewidth=2.2)
        for name in APPROXIMATIONS:
            reflectance = approximation(name, ANGLES, line)
            axes.plot(ANGLES, reflectance, color=line.color, linewidth=1.2, linestyle=LINES[name])
            below.plot(ANGLES, reflectance - at.R, color=line.color, linewidth=1.4, linestyle=LINES[name])
        least, critical = float(np.degrees(at.brewster[0])), float(np.degrees(at.critical[0]))
        _mark(axes, least, "Brewster" if line.k == 0.0 else "minimum of Rp", line, len(lines))
        if np.isfinite(critical):
            _mark(axes, critical, "critical", line, len(lines))
    axes.set_title(side, fontsize=11, fontweight="bold")
    axes.set_ylim(0.0, 1.02)
    axes.set_ylabel("reflectance")
    _over_angle(axes)
    below.axhline(0.0, color=figures.SOFT, linewidth=0.8)
    below.set_ylabel("error of R")
    below.set_xlabel("angle of incidence")
    _over_angle(below)


def _mark(axes: Axes, angle: float, name: str, line: Index, count: int) -> None:
    """Draw a line at a named angle, with a label on the side where the curves are low."""
    axes.axvline(angle, color=line.color if count > 1 else figures.SOFT, linewidth=0.8, linestyle=":", zorder=0)
    if count == 1:
        near_left = angle < 25.0
        axes.annotate(
            f"{name} {angle:.1f}°",
            (angle, 0.93 if name == "critical" else 0.55),
            xytext=(4 if near_left or name == "critical" else -4, 0),
            textcoords="offset points",
            ha="left" if near_left or name == "critical" else "right",
            fontsize=8.5,
            color=figures.SOFT,
        )


def _phases(axes: Axes, lines: Sequence[Index]) -> None:
    for line in lines:
        at = fresnel.fresnel(np.radians(ANGLES), line.eta, line.k)
        colors = (line.color,) * 2 if len(lines) > 1 else (figures.PALETTE[2], figures.PALETTE[1])
        for phase, color in zip((at.phase_s, at.phase_p), colors, strict=True):
            axes.plot(ANGLES, np.degrees(np.unwrap(phase)), color=color, linewidth=1.4)
    axes.set_title("phase in reflection: p above, s below", fontsize=11, fontweight="bold")
    axes.set_ylabel("degrees")
    _over_angle(axes)


def _differences(axes: Axes, lines: Sequence[Index]) -> None:
    """Draw the phase difference of s and p, by which linearly polarized light becomes elliptically polarized, or
    circularly polarized at 90 degrees."""
    for line in lines:
        at = fresnel.fresnel(np.radians(ANGLES), line.eta, line.k)
        retardance = np.degrees(np.unwrap(np.angle(-at.r_p * np.conj(at.r_s))))
        axes.plot(ANGLES, retardance, color=line.color, linewidth=1.6)
    axes.set_ylabel("p behind s, degrees")
    axes.set_xlabel("angle of incidence")
    _over_angle(axes)


def _over_angle(axes: Axes) -> None:
    axes.set_xlim(0, 90)
    axes.set_xticks(range(0, 91, 15))
    axes.set_xticklabels([f"{angle}°" for angle in range(0, 91, 15)])
    axes.grid(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _map(figure: Figure, axes: Axes, lines: Sequence[Index]) -> None:
    """Draw Schlick's error as a function of index and angle, at the mean k of the lines."""
    k = float(np.mean([line.k for line in lines]))
    low, high = INDICES if k else GLASS
    etas, angles = np.linspace(low, max(high, *(line.eta * 1.1 for line in lines)), 160), np.linspace(0.0, 90.0, 181)
    errors = schlick_error(etas, angles, k)
    top = float(np.quantile(np.abs(errors), 0.995))  # a few corners are larger and would dominate the scale
    shown = axes.pcolormesh(
        angles, etas, errors, cmap="RdBu_r", vmin=-top, vmax=top, shading="gouraud", rasterized=True
    )
    levels = np.linspace(-top, top, 16)  # none at 0, where rounding errors would draw extra lines
    # The contours have no labels, which would overlap in the corners; the color bar shows the values.
    axes.contour(angles, etas, errors, levels=levels, colors=figures.INK, linewidths=0.5, alpha=0.5)
    for line in lines:
        axes.axhline(line.eta, color=line.color, linewidth=1.2, linestyle=figures.DASHES)
    axes.set_title("Schlick minus exact" + (f", k = {k:.3g}" if k else ""), fontsize=11, fontweight="bold")
    axes.set_xlabel("angle of incidence")
    axes.set_ylabel("index eta")
    axes.set_xticks(range(0, 91, 15))
    axes.set_xticklabels([f"{angle}°" for angle in range(0, 91, 15)])
    bar = figure.colorbar(shown, cax=figure.add_axes((0.925, 0.17, 0.012, 0.67)))
    bar.set_label("error of R", fontsize=9)
    bar.ax.tick_params(labelsize=8)


def _legend(lines: Sequence[Index]) -> list[Artist]:
    from matplotlib.lines import Line2D

    handles: list[Artist] = []
    if len(lines) > 1:
        handles += [Line2D([], [], color=line.color, linewidth=2.2, label=f"R, {line.label}") for line in lines]
        handles.append(Line2D([], [], color=figures.SOFT, linewidth=1.0, label="Rs above, Rp below"))
        color = figures.SOFT
    else:
        color = lines[0].color
        names = {"R": color, "Rs": figures.PALETTE[2], "Rp": figures.PALETTE[1]}
        handles += [Line2D([], [], color=c, linewidth=2.0, label=name) for name, c in names.items()]
    styles = APPROXIMATIONS.items()
    handles += [Line2D([], [], color=color, linewidth=1.4, linestyle=LINES[k], label=name) for k, name in styles]
    return handles


# ---------------------------------------------------------------------- the plotted numbers


def approximation(name: str, degrees: Reals, index: Index) -> Reals:
    """R of a Fresnel term at the given angles, from the side that eta implies."""
    types = backend.types("float64")
    kind = fresnel.kind(name)
    cos, eta = types.float(np.maximum(np.cos(np.radians(degrees)), 0.0)), types.float(index.eta)
    if index.k:
        return backend.to_numpy(kind.conductor(cos, eta, types.float(index.k)), len(degrees))
    eta = eta + 0.0 * cos
    return backend.to_numpy(kind.dielectric(cos, fresnel.cos_transmitted(cos, eta), eta), len(degrees))


def schlick_error(etas: Reals, degrees: Reals, k: float = 0.0) -> Reals:
    """Schlick's approximation minus the exact reflectance, as an array (index, angle)."""
    eta, angle = np.meshgrid(etas, np.radians(degrees), indexing="ij")
    c = np.maximum(1.0 - np.cos(angle), 0.0)
    at = fresnel.fresnel(angle, eta, k)
    r0 = fresnel.fresnel(0.0, etas, k).R[:, None]
    error: Reals = r0 + (1.0 - r0) * c**5 - at.R
    return error
