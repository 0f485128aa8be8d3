"""Image slices of materials: f as a function of half angle and difference angle at phi_d = 90 degrees, as is usual for
measured BRDFs.

The highlight is at the left edge, the rise of the Fresnel reflectance toward grazing angles at the top, and
retro-reflection at the bottom.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..material import BSDF
from ..measure.tables.half_difference import pair_at
from . import figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEPS = 180  # pixels along each axis
ACROSS = 4  # largest number of panels in a row
LONGEST = 32  # largest number of characters in a panel's title


def slice_of(bsdf: BSDF, steps: int = STEPS) -> NDArray[np.float64]:
    """f at `steps` values each of theta_d (rows, 90 degrees first) and theta_h (columns); NaN where f is unknown. At
    phi_d = 90 degrees, all pairs of directions are above the surface."""
    middle = (np.arange(steps) + 0.5) / steps * (0.5 * np.pi)
    theta_d, theta_h = (a.ravel() for a in np.meshgrid(middle[::-1], middle, indexing="ij"))
    wo, wi = pair_at(theta_h, theta_d, np.full(theta_h.shape, 0.5 * np.pi))
    values = np.where(bsdf.angular_range.holds(wo, wi)[:, None], np.asarray(bsdf.f(wo, wi), float), np.nan)
    return values.reshape(steps, steps, 3)


def draw(title: str, labels: Sequence[str], bsdfs: Sequence[BSDF]) -> Figure:
    """Draw one panel per material, with the same scale: pi f, clamped to 1 and encoded as sRGB; values below 0 are
    magenta."""
    subtitle = "π f at φd = 90°, as sRGB, clamped to 1; magenta: below 0"
    if not all(bsdf.angular_range.everything for bsdf in bsdfs):
        subtitle += "; gray: not measured"
    columns, rows = min(len(bsdfs), ACROSS), -(-len(bsdfs) // ACROSS)
    width, height = max(0.5 + 3.3 * columns, 5.2), 0.8 + 3.5 * rows
    figure = figures.blank(width, height, title, subtitle)
    for index, (label, bsdf) in enumerate(zip(labels, bsdfs, strict=True)):
        row, column = divmod(index, columns)
        x, y = (0.65 + 3.3 * column) / width, (3.5 * (rows - 1 - row) + 0.55) / height
        axes = figure.add_axes((x, y, 2.5 / width, 2.5 / height))
        values = slice_of(bsdf)
        shown = np.clip(np.pi * values, 0.0, 1.0)
        shown = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 1e-9) ** (1.0 / 2.4) - 0.055)
        shown[values.min(axis=-1) < 0.0] = (0.85, 0.1, 0.75)
        shown[np.isnan(values).any(axis=-1)] = (0.72, 0.74, 0.76)
        axes.imshow(shown, extent=(0.0, 90.0, 0.0, 90.0), interpolation="nearest")
        axes.set_xticks(range(0, 91, 30), [f"{angle}°" for angle in range(0, 91, 30)])
        axes.set_yticks(range(0, 91, 30), [f"{angle}°" for angle in range(0, 91, 30)])
        axes.set_xlabel("θh, half vector")
        axes.set_ylabel("θd, difference")
        if len(bsdfs) > 1:
            short = label if len(label) <= LONGEST else "…" + label[1 - LONGEST :]  # the end of a path identifies it
            axes.set_title(short, fontsize=10, fontweight="bold")
    return figure
