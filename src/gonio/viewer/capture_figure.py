"""The figure of a capture: a photograph, the classification of its pixels, the fit, and the uncertainty."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..instruments.capture.photographs import Photograph
from ..instruments.capture.pixels import FATES
from ..instruments.capture.run import Capture
from . import figures
from .figures import Drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
COLORS = ("#d9dee4", "#4d9a6a", "#c8354a", "#39465a", "#e0a030")  # outside the sample, then one per class of pixels
MAX_PERCENT = 50.0  # upper limit of the scales of differences and of errors


def draw(capture: Capture) -> Drawing:
    """Draw the first photograph of a sample, the fit to it, the difference between the two, and the classification of
    the pixels; also the values and standard errors of the samples as functions of theta_h and theta_d, gray where there
    are no samples."""
    matplotlib = figures.load_matplotlib()
    from matplotlib.figure import Figure

    shot = next(one for one in capture.photographs if one.shot.sample != "reference")
    with matplotlib.rc_context(figures.STYLE):
        rows = 2 if capture.fitted is not None else 1
        figure = Figure(figsize=(11.0, 3.6 * rows + 0.8), layout="constrained")
        axes = figure.subplots(rows, 3, squeeze=False)
        last = axes[-1]
        if capture.fitted is not None:
            _compare(axes[0], capture, shot)
            _fates(last[0], capture, shot)
        else:
            _photograph(last[0], shot, "photograph")
        _values(last[1], capture)
        _errors(last[2], capture)
        title = _rounded(capture.fit.text) if capture.fitted is not None else f"{len(capture.samples.count)} samples"
        figure.suptitle("\n".join(textwrap.wrap(title, 90)[:3]), fontsize=11)
        counts = ", ".join(f"{capture.counts[fate]} {fate}" for fate in FATES)
        figure.supxlabel(f"pixels of {len(capture.chosen.maps)} photographs: {counts}", fontsize=11)
    return Drawing(figure, str(capture))


def _rounded(text: str) -> str:
    """A material as text, with three digits of each number and a space after each parameter."""
    short = re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.3g}", text)
    return re.sub(r",(?=[a-z])", ", ", short)


def _compare(axes: list[Axes], capture: Capture, shot: Photograph) -> None:
    """Draw the photograph, the fit to it, and their difference."""
    fitted = capture.fitted
    assert fitted is not None, "the caller has checked it"
    lamp = capture.scene.names.index(shot.shot.light)
    part = next(one for one in fitted.problem.parts if one.kind == shot.shot.sample)
    chosen = part.at(np.flatnonzero(part.lamp == lamp))
    predicted, _ = fitted.problem.predicted(chosen, fitted.numbers, False)
    column, row = np.floor(chosen.place).astype(int).T
    picture = np.full(shot.radiance.shape, np.nan)
    picture[row, column] = predicted
    white = max(float(np.nanpercentile(shot.radiance, 99.5)), 1e-12)
    used = np.where(np.isfinite(picture), shot.radiance, np.nan)
    _picture(axes[0], used, white, f"photograph: {shot.name.rpartition('/')[2]}")
    _picture(axes[1], picture, white, "the fit to it")
    off = np.full(shot.radiance.shape[:2], np.nan)
    level = np.maximum(chosen.value.mean(axis=1), 1e-3 * white)
    off[row, column] = 100.0 * (predicted - chosen.value).mean(axis=1) / level
    end = min(max(float(np.nanpercentile(np.abs(off), 98.0)), 1.0), MAX_PERCENT)
    image = axes[2].imshow(off, cmap="RdBu_r", vmin=-end, vmax=end, interpolation="nearest")
    axes[2].set_title("difference", fontsize=12)
    axes[2].set_axis_off()
    for axis in axes:  # crop to the box of these pixels, with a margin
        axis.set_xlim(column.min() - 4, column.max() + 4)
        axis.set_ylim(row.max() + 4, row.min() - 4)
    assert axes[2].figure is not None
    axes[2].figure.colorbar(image, ax=axes[2], shrink=0.85).set_label("%, red: the fit is brighter", fontsize=10)


def _photograph(axis: Axes, shot: Photograph, title: str) -> None:
    _picture(axis, shot.radiance, max(float(np.nanpercentile(shot.radiance, 99.5)), 1e-12), title)


def _picture(axis: Axes, radiance: Floats, white: float, title: str) -> None:
    """Draw linear radiance, encoded as sRGB; pixels without a value are light gray."""
    shown = np.clip(np.nan_to_num(radiance / white, nan=0.8), 0.0, 1.0) ** (1.0 / 2.2)
    axis.imshow(shown, interpolation="nearest")
    axis.set_title(title, fontsize=12)
    axis.set_axis_off()


def _fates(axis: Axes, capture: Capture, shot: Photograph) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    codes = capture.chosen.maps[shot.name]
    axis.imshow(codes, cmap=ListedColormap(list(COLORS)), vmin=-0.5, vmax=4.5, interpolation="nearest")
    there = [number for number in range(1, len(COLORS)) if np.any(codes == number)]
    handles = [Patch(color=COLORS[number], label=FATES[number - 1]) for number in there]
    axis.legend(handles=handles, loc="lower right", fontsize=10, frameon=True, framealpha=0.9)
    axis.set_title("classification of its pixels", fontsize=12)
    axis.set_axis_off()


def _values(axis: Axes, capture: Capture) -> None:
    """Draw the samples over theta_h and theta_d, averaged over phi_d."""
    total, count = _binned(capture, capture.samples.table.values)
    with np.errstate(invalid="ignore"):
        value = total / count[..., None]
    white = max(float(np.nanpercentile(np.cbrt(np.abs(value)), 97.0)), 1e-6)
    shown = np.clip(np.cbrt(np.maximum(np.nan_to_num(value), 0.0)) / white, 0.0, 1.0)
    with_alpha = np.concatenate([shown, np.isfinite(value[..., :1])], axis=-1)
    axis.imshow(with_alpha.swapaxes(0, 1), origin="lower", extent=(0.0, 1.0, 0.0, 90.0), aspect="auto")
    axis.set_title("samples of f", fontsize=12)
    _angles(axis)
    _cube_root_bar(axis, white)


def _cube_root_bar(axis: Axes, white: float) -> None:
    """Draw the color scale of f. Brightness is the cube root of f, so that dark lobes and peaks are both visible."""
    from matplotlib.cm import ScalarMappable

    steps = np.linspace(0.0, 1.0, 5)
    assert axis.figure is not None
    bar = axis.figure.colorbar(ScalarMappable(cmap="gray"), ax=axis, shrink=0.85)
    bar.set_ticks(list(steps), labels=[f"{(white * step) ** 3:.2g}" for step in steps])
    bar.set_label("f, 1/sr", fontsize=10)


def _binned(capture: Capture, values: Floats) -> tuple[Floats, Floats]:
    from ..instruments.capture.pixels import CELLS
    from ..measure.angles import half_difference_arrays

    theta_h, theta_d, _ = half_difference_arrays(*capture.samples.table.pairs())
    row = np.minimum((np.sqrt(theta_h / (0.5 * np.pi)) * CELLS[0]).astype(int), CELLS[0] - 1)
    column = np.minimum((theta_d / (0.5 * np.pi) * CELLS[1]).astype(int), CELLS[1] - 1)
    total, count = np.zeros((*CELLS[:2], 3)), np.zeros(CELLS[:2])
    np.add.at(total, (row, column), values)
    np.add.at(count, (row, column), 1.0)
    return total, count


def _errors(axis: Axes, capture: Capture) -> None:
    error = 100.0 * capture.samples.confidence()
    end = min(max(float(np.nanpercentile(error, 95.0)), 0.1), MAX_PERCENT) if np.isfinite(error).any() else 1.0
    image = axis.imshow(
        error.T, origin="lower", extent=(0.0, 1.0, 0.0, 90.0), aspect="auto", cmap="viridis_r", vmin=0.0, vmax=end
    )
    assert axis.figure is not None
    axis.figure.colorbar(image, ax=axis, shrink=0.85).set_label("%", fontsize=10)
    axis.set_title("standard error of the samples", fontsize=12)
    _angles(axis)


def _angles(axis: Axes) -> None:
    axis.set_facecolor(figures.FAINT)  # where there are no samples
    degrees = (0.0, 2.0, 10.0, 30.0, 60.0, 90.0)
    axis.set_xticks([float(np.sqrt(d / 90.0)) for d in degrees], [f"{d:g}" for d in degrees])
    axis.set_yticks([0.0, 30.0, 60.0, 90.0])
    axis.set_xlabel("theta_h, degrees")
    axis.set_ylabel("theta_d, degrees")
