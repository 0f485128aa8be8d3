"""The figure of a fit to a picture: the picture, the fit, their difference, and the loss over the steps."""

from __future__ import annotations

import numpy as np

from ..instruments.pictures import PictureFit
from ..pictures import exposures, images
from . import figures
from .figures import Drawing

MAX_PERCENT = 50.0  # upper limit of the scale of differences
LINES = 4  # largest number of lines with fitted values; each line has two values


def draw(fit: PictureFit) -> Drawing:
    """The picture, the fit and the difference side by side, and the loss after each step."""
    matplotlib = figures.load_matplotlib()
    from matplotlib.figure import Figure

    height, width = fit.wanted.shape[:2]
    with matplotlib.rc_context(figures.STYLE):
        tall = 3.7 * min(max(height / width, 0.5), 1.5)
        figure = Figure(figsize=(8.6, 2.0 * tall + 1.6), layout="constrained")
        axes = figure.subplots(2, 2).ravel()
        stops = exposures.stops("auto", fit.wanted)
        for axis, picture, title in zip(axes, (fit.wanted, fit.fitted), ("picture", "fit"), strict=False):
            axis.imshow(images.to_screen(picture, stops), interpolation="nearest")
            axis.set_title(title, fontsize=12)
            axis.set_axis_off()
        level = np.maximum(fit.wanted.mean(axis=2), 0.05 * float(np.median(fit.wanted)) + 1e-12)
        off = 100.0 * (fit.fitted - fit.wanted).mean(axis=2) / level
        end = min(max(float(np.percentile(np.abs(off), 98.0)), 1.0), MAX_PERCENT)
        image = axes[2].imshow(off, cmap="RdBu_r", vmin=-end, vmax=end, interpolation="nearest")
        axes[2].set_title("difference", fontsize=12)
        axes[2].set_axis_off()
        figure.colorbar(image, ax=axes[2], shrink=0.8).set_label("%, red: the fit is brighter", fontsize=10)
        axes[3].semilogy(range(len(fit.losses)), fit.losses, color=figures.PALETTE[0], marker="o", markersize=3)
        axes[3].set_title("loss", fontsize=12)
        axes[3].set_xlabel("step")
        axes[3].xaxis.get_major_locator().set_params(integer=True)
        axes[3].grid(True)
        axes[3].set_box_aspect(height / width)
        values = zip(fit.names, fit.values, fit.errors, strict=True)
        words = [f"{n} = {v:.4g} ± {1.96 * e:.2g}" for n, v, e in values]
        lines = [",  ".join(words[i : i + 2]) for i in range(0, len(words), 2)]
        figure.supxlabel("\n".join(lines[:LINES]) + (", ..." if len(lines) > LINES else ""), fontsize=10)
    return Drawing(figure, str(fit))
