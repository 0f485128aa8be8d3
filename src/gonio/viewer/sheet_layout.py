"""The layout of a contact sheet: pictures in labeled rows and columns under a heading."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import figures
from .figures import Drawing
from .variations import Variation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Pixels = NDArray[np.uint8]  # (H, W, 3)
MAX_WIDTH = 3200  # pixels; the pictures of larger sheets are scaled down
READABLE = 800  # width in pixels at which a page shows a sheet; the text of wider sheets is enlarged in proportion
GAP, MARGIN = 8, 20
TITLE_HEIGHT, HEADING_HEIGHT, NAME_HEIGHT, LABEL_HEIGHT, BETWEEN = 62, 28, 20, 22, 14
_DPI = 100


@dataclass(frozen=True)
class _Block:
    """A grid of pictures with a heading."""

    heading: str
    rows: list[str]
    columns: list[str]
    pictures: list[Sequence[Pixels]]
    row_name: str = ""
    column_name: str = ""


def draw(pictures: Sequence[Pixels], variations: Sequence[Variation], title: str, subtitle: str) -> Drawing:
    """Lay out 8-bit pictures (in the order of `itertools.product`) with labels.

    One variation gives a row, which is wrapped if it is long. With two variations, the rows correspond to the first and
    the columns to the second. With more variations, there is a grid of the last two for every combination of the
    others.
    """
    matplotlib = figures.load_matplotlib()

    with matplotlib.rc_context(figures.STYLE):
        layout = _Layout.of(_blocks(pictures, variations), title, subtitle)
        return Drawing(_draw(layout, title, subtitle), f"{title}: {subtitle}", _DPI)


def _blocks(pictures: Sequence[Pixels], variations: Sequence[Variation]) -> list[_Block]:
    names = [variation.name for variation in variations]
    if len(set(names)) < len(names):  # such as parameter p of two shapes
        names = [variation.path for variation in variations]
    if len(variations) == 1:
        (only,), (name,) = variations, names
        labels = [f"{name} = {figures.show_value(value)}" for value in only.values]
        across = _columns_of_a_row(len(pictures), pictures[0].shape[1] / pictures[0].shape[0])
        if across == 1:
            rows = [figures.show_value(value) for value in only.values]
            return [_Block("", rows, [""], [[picture] for picture in pictures], name)]
        return [
            _Block("", [], labels[at : at + across], [pictures[at : at + across]])
            for at in range(0, len(pictures), across)
        ]
    *outer, down, across_ = variations
    rows, columns = ([figures.show_value(v) for v in x.values] for x in (down, across_))
    blocks = []
    each = len(rows) * len(columns)
    for index, values in enumerate(itertools.product(*(one.values for one in outer))):
        of_block = pictures[index * each : (index + 1) * each]
        grid = [of_block[at : at + len(columns)] for at in range(0, each, len(columns))]
        named = zip(names, values, strict=False)
        heading = ",   ".join(f"{name} = {figures.show_value(value)}" for name, value in named)
        blocks.append(_Block(heading, rows, columns, grid, *names[-2:]))
    return blocks


def _columns_of_a_row(count: int, aspect: float) -> int:
    """The number of columns for which the aspect ratio of the sheet is closest to 16 : 10, without a nearly empty last
    row."""

    def badness(columns: int) -> float:
        rows = math.ceil(count / columns)
        empty = rows * columns - count
        return abs(math.log(columns * aspect / rows / 1.6)) + 2 * empty / columns

    return min(range(1, count + 1), key=badness)


@dataclass(frozen=True)
class _Layout:
    """The dimensions of a sheet in pixels.

    zoom     scale factor of the text and of the space for it
    left     left edge of the first column of pictures
    cell     width and height of a picture
    pitch    distance between columns
    size     width and height of the sheet
    heights  heights of the blocks
    """

    blocks: Sequence[_Block]
    zoom: float
    left: int
    cell: tuple[int, int]
    pitch: int
    size: tuple[int, float]
    heights: list[float]

    @staticmethod
    def of(blocks: Sequence[_Block], title: str, subtitle: str) -> _Layout:
        """The layout of blocks under a heading, with room for all labels."""
        figures.load_matplotlib()
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.text import Text

        measuring = Figure(dpi=_DPI)
        renderer = FigureCanvasAgg(measuring).get_renderer()

        height, width = blocks[0].pictures[0][0].shape[:2]
        columns = max(len(block.columns) for block in blocks)
        zoom = max(1.0, min(MAX_WIDTH, columns * width) / READABLE)

        def width_of(text: str, size: float, weight: str = "normal") -> float:
            label = Text(0, 0, text, fontsize=zoom * size, fontweight=weight, figure=measuring)
            return label.get_window_extent(renderer).width

        labels = max((width_of(row, 11) for block in blocks for row in block.rows), default=0)
        names = any(block.row_name for block in blocks)
        left = MARGIN + (math.ceil(labels) + 10 if labels else 0) + (math.ceil(24 * zoom) if names else 0)
        scale = min(1.0, (MAX_WIDTH - left - MARGIN) / (columns * (width + GAP)))
        if max(width, height) < 160:  # tiny pictures are enlarged by an integer factor
            scale = float(max(1, 160 // max(width, height)))
        cell = max(1, round(width * scale)), max(1, round(height * scale))
        # Labels must fit above their pictures; small pictures are then placed further apart.
        widest_label = max(width_of(label, 11) for block in blocks for label in block.columns)
        pitch = max(cell[0], math.ceil(widest_label) + 4) + GAP
        heading_width = max(width_of(title, 15, "bold"), width_of(subtitle, 10))
        total_width = math.ceil(max(left + columns * pitch - GAP, MARGIN + heading_width) + MARGIN)
        heights = [_height(block, cell[1], zoom) for block in blocks]
        total_height = zoom * TITLE_HEIGHT + sum(heights) + (len(blocks) - 1) * BETWEEN + MARGIN
        return _Layout(blocks, zoom, left, cell, pitch, (total_width, total_height), heights)


def _height(block: _Block, cell_height: int, zoom: float) -> float:
    rows = len(block.pictures)
    extra = (HEADING_HEIGHT if block.heading else 0) + (NAME_HEIGHT if block.column_name else 0)
    extra += LABEL_HEIGHT if any(block.columns) else 0
    return zoom * extra + rows * cell_height + (rows - 1) * GAP


def _draw(layout: _Layout, title: str, subtitle: str) -> Figure:
    figures.load_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width, height = layout.size
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    FigureCanvasAgg(figure)
    _text(figure, layout, MARGIN, 30 * layout.zoom, title, fontsize=15, fontweight="bold", va="baseline")
    _text(figure, layout, MARGIN, 49 * layout.zoom, subtitle, fontsize=10, color=figures.SOFT, va="baseline")
    y = layout.zoom * TITLE_HEIGHT
    for block, block_height in zip(layout.blocks, layout.heights, strict=True):
        _draw_block(figure, layout, block, y, y + block_height)
        y += block_height + BETWEEN
    return figure


def _text(figure: Figure, layout: _Layout, x: float, y: float, content: str, fontsize: float, **style: Any) -> None:
    """Draw text at a position in pixels from the upper left corner of the sheet."""
    width, height = layout.size
    figure.text(x / width, 1 - y / height, content, fontsize=layout.zoom * fontsize, **style)


def _draw_block(figure: Figure, layout: _Layout, block: _Block, y: float, bottom: float) -> None:
    """Draw a block between two heights: its heading, names, labels and pictures."""
    left, pitch, (cell_width, cell_height), (width, height) = layout.left, layout.pitch, layout.cell, layout.size

    zoom = layout.zoom

    def text(x: float, y: float, content: str, fontsize: float = 10, **style: Any) -> None:
        _text(figure, layout, x, y, content, fontsize, **style)

    if block.heading:
        text(MARGIN, y + 19 * zoom, block.heading, fontsize=12, fontweight="bold", va="baseline")
        y += HEADING_HEIGHT * zoom
    if block.column_name:
        middle = left + (len(block.columns) * pitch - GAP) / 2
        text(middle, y + 13 * zoom, block.column_name, color=figures.SOFT, ha="center", va="baseline")
        y += NAME_HEIGHT * zoom
    for index, label in enumerate(block.columns):
        text(left + index * pitch + cell_width / 2, y + 14 * zoom, label, fontsize=11, ha="center", va="baseline")
    y += LABEL_HEIGHT * zoom if any(block.columns) else 0
    if block.row_name:
        middle = (y + bottom) / 2
        text(MARGIN + 6 * zoom, middle, block.row_name, color=figures.SOFT, rotation=90, ha="center", va="center")
    for row, pictures in enumerate(block.pictures):
        if block.rows:
            text(left - 10, y + cell_height / 2, block.rows[row], fontsize=11, ha="right", va="center")
        for column, picture in enumerate(pictures):
            place = (left + column * pitch) / width, 1 - (y + cell_height) / height
            axes = figure.add_axes((*place, cell_width / width, cell_height / height))
            axes.imshow(picture, interpolation="antialiased", aspect="auto")
            axes.set_axis_off()
        y += cell_height + GAP
