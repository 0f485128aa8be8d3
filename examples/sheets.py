"""Sheets of pictures with titles, for the programs of the gallery."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import gonio as go
import numpy as np
from gonio.pictures import images
from matplotlib.figure import Figure

WIDTH = 1280  # pixels of a sheet
DPI = 100
TEXT = "#d8d8d8"


def draw(path: str | Path, cells: Sequence[tuple[str, np.ndarray]], columns: int, background: str = "#0b0c0f") -> Path:
    """Write pictures of linear radiance, (height, width, 3) each, in rows of `columns`, each below its title."""
    height, width = cells[0][1].shape[:2]
    rows = -(-len(cells) // columns)
    gap, line = 0.06, 0.24  # inches
    cell = (WIDTH / DPI - gap) / columns - gap
    tall = cell * height / width
    size = (WIDTH / DPI, gap + rows * (tall + line + gap))
    figure = Figure(figsize=size, facecolor=background, dpi=DPI)
    for number, (title, pixels) in enumerate(cells):
        row, column = divmod(number, columns)
        left = gap + column * (cell + gap)
        top = size[1] - gap - row * (tall + line + gap)
        axes = figure.add_axes((left / size[0], (top - line - tall) / size[1], cell / size[0], tall / size[1]))
        axes.imshow(images.to_screen(pixels), interpolation="lanczos")
        axes.set_axis_off()
        figure.text(
            (left + cell / 2) / size[0], (top - line / 2) / size[1], title,
            ha="center", va="center", color=TEXT, fontsize=min(9.0, cell * 100 / max(len(title), 14)),
        )  # fmt: skip
    figure.savefig(path, pil_kwargs={"quality": 88, "optimize": True, "progressive": True})
    return Path(path)


def shaded(material: go.BSDF, light: Sequence[float], size: int, irradiance: float = 1.0) -> np.ndarray:
    """A ball under one directional light, (size, size, 3), as a shader computes it: nothing casts a shadow.

    light  direction toward the light in the frame of the picture: x to the right, y up, z to the viewer
    """
    y, x = np.meshgrid(*[np.linspace(-1.06, 1.06, size)] * 2, indexing="ij")
    inside = x**2 + y**2 < 1.0
    n = np.stack([x, -y, np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], -1)[inside]
    t = np.cross([0.0, 1.0, 0.0], n)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frame = np.stack([t, np.cross(n, t), n], 1)
    pixels = np.zeros((size, size, 3))
    toward = np.asarray(light) / np.linalg.norm(light)
    pixels[inside] = irradiance * np.asarray(material.eval(frame @ [0.0, 0.0, 1.0], frame @ toward))
    return pixels
