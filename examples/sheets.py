"""Sheets of pictures with titles, for programs in the gallery."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import gonio as go
import numpy as np
from gonio.pictures import images
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath

WIDTH = 1280  # width of a sheet, pixels
DPI = 100
TEXT = "#e4e4e4"
BACKGROUND = "#15171b"
LETTERS = 28.0  # font size in pixels; a page may show the sheet at half its width
POINTS = LETTERS * 72.0 / DPI
LINE = 1.25 * LETTERS / DPI  # line spacing, inches
GAP = 0.08  # inches between pictures
BACKDROP = 0.05  # radiance behind a ball, so that its unlit side has an outline


def save(figure: Figure, path: str | Path) -> Path:
    """Write a sheet as a small JPEG."""
    figure.savefig(path, pil_kwargs={"quality": 86, "optimize": True, "progressive": True})
    return Path(path)


def fitting(lines: Sequence[str], width: float) -> float:
    """Font size at which the longest line is at most `width` inches wide, and no larger than `LETTERS`."""
    widest = max(TextPath((0.0, 0.0), line, size=POINTS).get_extents().width for line in lines if line.strip())
    return min(POINTS, POINTS * width * 72.0 / widest)


def draw(
    path: str | Path,
    cells: Sequence[tuple[str, np.ndarray]],
    columns: int,
    names: Sequence[str] = (),
    rows: Sequence[str] = (),
) -> Path:
    """Write pictures of linear radiance, (height, width, 3) each, in rows of `columns`, each below its title.

    names   labels of the parts that each picture shows side by side, written at its lower edge
    rows    labels of the rows, written upward at the left
    Titles have the same font size and may have several lines; a row without titles has no space for them.
    """
    height, width = cells[0][1].shape[:2]
    margin = GAP + (LINE if rows else 0.0)
    cell = (WIDTH / DPI - margin) / columns - GAP
    tall = cell * height / width
    titles = [title for title, _ in cells]
    heads = [max(_lines(title) for title in titles[i : i + columns]) * LINE for i in range(0, len(cells), columns)]
    tops = np.cumsum([GAP, *(head + tall + 1.5 * GAP for head in heads)])
    size = WIDTH / DPI, float(tops[-1])
    points = fitting([line for title in titles for line in title.split("\n")], cell) if any(titles) else POINTS
    figure = Figure(figsize=size, facecolor=BACKGROUND, dpi=DPI)

    def write(x: float, y: float, words: str, points: float = POINTS, **how: object) -> None:
        style = {"ha": "center", "va": "baseline", "color": TEXT, "fontsize": points, **how}
        figure.text(x / size[0], 1.0 - y / size[1], words, **style)

    for number, (title, pixels) in enumerate(cells):
        row, column = divmod(number, columns)
        left, top = margin + column * (cell + GAP), tops[row] + heads[row]
        place = left / size[0], 1.0 - (top + tall) / size[1], cell / size[0], tall / size[1]
        axes = figure.add_axes(place)
        axes.imshow(images.to_screen(pixels), interpolation="lanczos")
        axes.set_axis_off()
        for above, line in enumerate(reversed(title.split("\n"))):
            write(left + cell / 2.0, top - (above + 0.33) * LINE, line, points)
        for part, name in enumerate(names):
            write(left + cell * (part + 0.5) / len(names), top + tall - 0.22 * LINE, name)
    for row, name in enumerate(rows):
        write(0.55 * margin, tops[row] + heads[row] + tall / 2.0, name, rotation=90, va="center")
    return save(figure, path)


def _lines(title: str) -> int:
    return len(title.split("\n")) if title else 0


def shaded(
    material: go.BSDF,
    light: Sequence[float],
    size: int,
    irradiance: float = 1.0,
    backdrop: float = BACKDROP,
    oversampling: int = 3,
) -> np.ndarray:
    """A ball under one directional light, (size, size, 3), as a shader computes it, without shadows.

    light         direction toward the light in the frame of the picture: x to the right, y up, z toward the viewer
    backdrop      radiance behind the ball
    oversampling  samples along each side of a pixel; the radiance of a pixel is their mean
    """
    fine = oversampling * size
    y, x = np.meshgrid(*[np.linspace(-1.06, 1.06, fine)] * 2, indexing="ij")
    inside = x**2 + y**2 < 1.0
    n = np.stack([x, -y, np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], -1)[inside]
    frame = tangent_frames(n)
    pixels = np.full((fine, fine, 3), backdrop)
    toward = np.asarray(light) / np.linalg.norm(light)
    pixels[inside] = irradiance * np.asarray(material.eval(frame @ [0.0, 0.0, 1.0], frame @ toward))
    return averaged(pixels, oversampling)


def tangent_frames(n: np.ndarray) -> np.ndarray:
    """The rows of each normal's frame, (N, 3, 3): tangent to the right, bitangent up, normal."""
    t = np.cross([0.0, 1.0, 0.0], n)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    return np.stack([t, np.cross(n, t), n], 1)


def averaged(pixels: np.ndarray, block: int) -> np.ndarray:
    """The mean of each block of `block` x `block` pixels of a square picture."""
    size = len(pixels) // block
    return pixels.reshape(size, block, size, block, -1).mean((1, 3))
