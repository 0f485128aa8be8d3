"""The data that laws collect as evidence, and the figures that Matplotlib draws from them, as SVG."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .._html import numbered_ids
from . import cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT = "#1d2530", "#5c6876"
CHANNELS = ("#b3403a", "#3f7d4f", "#2b5d8a")


def _canvas(width: float, height: float, columns: int) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.patch.set_alpha(0.0)
    axes = list(figure.subplots(1, columns, squeeze=False)[0])
    for axis in axes:
        axis.patch.set_alpha(0.0)
        axis.tick_params(colors=SOFT, labelsize=8)
        for name, spine in axis.spines.items():
            spine.set_color(SOFT)
            spine.set_linewidth(0.6)
            spine.set_visible(name in ("left", "bottom"))
    return figure, axes


def _svg(figure: Figure) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg", dpi=110, metadata={"Date": None})
    text = out.getvalue()
    return numbered_ids(text[text.index("<svg") :])


def _label(axis: Axes, x: str, y: str, title: str = "") -> None:
    axis.set_xlabel(x, color=INK, fontsize=9)
    axis.set_ylabel(y, color=INK, fontsize=9)
    if title:
        axis.set_title(title, color=INK, fontsize=10, loc="left")


@dataclass
class SampleCells:
    """The cells of the chi-square test for one wo.

    expected, observed  expected and observed number of samples in each cell, (sides, rows, columns)
    rows, columns       edges of the cells, as in `gonio.verify.cells`
    drawn               total number of samples
    wo, sides           the tested direction, and the sides of the surface with cells
    """

    expected: np.ndarray
    observed: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    drawn: int
    wo: np.ndarray | None = None
    sides: tuple[int, ...] = (1,)

    def draw(self) -> tuple[str, str]:
        """Draw the observed and the expected number of samples near the main lobe, and the difference in standard
        deviations."""
        observed, expected = self.observed, self.expected
        side = int(np.argmax(observed.sum((1, 2))))
        o, e = observed[side].astype(float), expected[side]
        a, b, c, d = cells.boxes(self.rows[side], self.columns[side])
        area = np.maximum((b - a) * (d - c), 1e-30)
        x, y, _ = np.moveaxis(cells.direction(0.5 * (a + b), 0.5 * (c + d), 1.0), -1, 0)
        # the square window that holds 95 % of the samples
        order = np.argsort(-(e / area).ravel())
        inside = order[: max(int(np.searchsorted(np.cumsum(e.ravel()[order]), 0.95 * e.sum())), 8)]
        span = [(np.min(v.ravel()[inside]), np.max(v.ravel()[inside])) for v in (x, y)]
        half = min(0.6 * max(hi - lo for lo, hi in span) + 1e-6, 1.02)
        cx, cy = (0.5 * (lo + hi) for lo, hi in span)
        bins = 56
        grids = []
        for count in (o, e):
            grid, xe, ye = np.histogram2d(
                x.ravel(), y.ravel(), bins, [[cx - half, cx + half], [cy - half, cy + half]], weights=count.ravel()
            )
            grids.append(grid.T)
        figure, axes = _canvas(10.0, 3.3, 3)
        top = max(float(np.percentile(grids[1], 99.8)), 1e-9)
        extent = (xe[0], xe[-1], ye[0], ye[-1])
        for axis, grid, title in zip(axes[:2], grids, ("sample", "pdf"), strict=True):
            image = axis.imshow(
                grid, origin="lower", extent=extent, cmap="cividis", vmin=0.0, vmax=top, interpolation="nearest"
            )
            _label(axis, "x of wi", "y of wi", title)
        figure.colorbar(image, ax=axes[1], shrink=0.85, label="samples").outline.set_visible(False)
        sigma = (grids[0] - grids[1]) / np.sqrt(np.maximum(grids[1], 4.0))
        limit = max(5.0, min(float(np.max(np.abs(sigma))), 50.0))
        shown = axes[2].imshow(
            sigma, origin="lower", extent=extent, cmap="RdBu_r", vmin=-limit, vmax=limit, interpolation="nearest"
        )
        _label(axes[2], "x of wi", "y of wi", "difference")
        figure.colorbar(shown, ax=axes[2], shrink=0.85, label="standard deviations").outline.set_visible(False)
        caption = (
            f"{self.drawn:,} samples near the lobe for the wo with the lowest p-value, projected along the normal. "
            "If the law holds, the difference is only noise."
        )
        return _svg(figure), caption


@dataclass
class AlbedoCurves:
    """Directional albedo for wo (N, 3), by two estimators.

    quadrature, error  integral of `eval` and its error, (N, channels)
    sampling, noise    mean weight and its standard error, (N, channels)
    furnace, loss      albedo of the lossless variant, if there is one, and the average loss in a furnace
    """

    wo: np.ndarray
    quadrature: np.ndarray
    error: np.ndarray
    sampling: np.ndarray
    noise: np.ndarray
    furnace: np.ndarray | None = None
    loss: float = 0.0

    def draw(self) -> tuple[str, str]:
        """Draw the albedo by both estimators as a function of the angle, and the loss in the white furnace."""
        wo = self.wo
        theta = np.degrees(np.arctan2(np.hypot(wo[:, 0], wo[:, 1]), wo[:, 2]))
        order = np.argsort(theta)
        furnace = self.furnace
        figure, axes = _canvas(10.0, 3.2, 2 if furnace is not None else 1)
        value, mean, noise = self.quadrature, self.sampling, self.noise
        channels = range(value.shape[1]) if np.ptp(value, axis=1).max() > 1e-6 else range(1)
        for c in channels:
            color = CHANNELS[c % 3] if len(channels) > 1 else INK
            axes[0].plot(theta[order], value[order, c], color=color, lw=1.4)
            axes[0].errorbar(
                theta[order], mean[order, c], 3.0 * noise[order, c], fmt="o", ms=2.6, lw=0.8, color=color, alpha=0.65
            )
        axes[0].axhline(1.0, color=SOFT, lw=0.8, ls=":")
        low, high = (float(min(value.min(), mean.min())), float(max(value.max(), mean.max(), 1.0)))
        axes[0].set_ylim(max(low - 0.08 * (high - low) - 0.01, 0.0), high + 0.05 * (high - low) + 0.01)
        _label(axes[0], "angle of wo, degrees", "directional albedo", "quadrature (line), sampling (points)")
        if furnace is not None:
            axes[1].plot(theta[order], 1.0 - furnace[order].mean(1), color="#8a5a2b", lw=1.5)
            axes[1].fill_between(theta[order], 0.0, 1.0 - furnace[order].mean(1), color="#8a5a2b", alpha=0.15)
            axes[1].axhline(0.0, color=SOFT, lw=0.8, ls=":")
            _label(
                axes[1],
                "angle of wo, degrees",
                "fraction of light lost",
                f"white furnace: {'gains' if self.loss < 0.0 else 'loses'} {abs(self.loss):.4f} on average",
            )
        return (
            _svg(figure),
            "Above the dotted line at 1, more light is reflected than arrives. Error bars show three standard errors.",
        )


@dataclass
class ReciprocityMap:
    """The largest relative difference between f(wo, wi) and f(wi, wo) over azimuths, by (theta_o, theta_i).

    below  whether the angles extend to 180 degrees
    """

    difference: np.ndarray
    below: bool

    def draw(self) -> tuple[str, str]:
        """Draw the differences as a map over theta_o and theta_i."""
        figure, axes = _canvas(4.9, 3.7, 1)
        end = 180.0 if self.below else 90.0
        image = axes[0].imshow(
            np.log10(np.maximum(self.difference, 1e-17)),
            origin="lower",
            extent=(0, end, 0, end),
            cmap="magma",
            vmin=-16,
            vmax=0,
            interpolation="nearest",
        )
        _label(axes[0], "angle of wi, degrees", "angle of wo, degrees")
        bar = figure.colorbar(image, ax=axes[0], ticks=[-16, -12, -8, -4, 0])
        bar.ax.set_yticklabels(["1e-16", "1e-12", "1e-8", "1e-4", "1"], fontsize=8)
        bar.outline.set_visible(False)
        return (
            _svg(figure),
            "Relative difference between f(wo, wi) and f(wi, wo), the largest over eight azimuths.",
        )


@dataclass
class RoundingErrors:
    """The relative error of float32 for each pair, and the cosines of wo and wi, (N,) each."""

    error: np.ndarray
    cos_o: np.ndarray
    cos_i: np.ndarray

    def draw(self) -> tuple[str, str]:
        """Draw the error of float32 as a function of the smaller of the two cosines."""
        cos = np.minimum(self.cos_o, self.cos_i)
        error = np.maximum(self.error, 1e-10)
        pick = np.argsort(-error)[:400]
        rest = np.random.default_rng(1).choice(len(error), min(3000, len(error)), replace=False)
        figure, axes = _canvas(6.4, 3.0, 1)
        for rows, alpha, color in ((rest, 0.25, "#2b5d8a"), (pick, 0.8, "#b3403a")):
            points = axes[0].scatter(np.maximum(cos[rows], 1e-5), error[rows], s=4, alpha=alpha, color=color, lw=0)
            points.set_rasterized(True)
        axes[0].set_xscale("log")
        axes[0].set_yscale("log")
        _label(axes[0], "smaller of the two cosines", "relative error of float32")
        return _svg(figure), "Relative error of float32 for each pair of directions; the 400 largest errors are red."
