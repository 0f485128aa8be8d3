"""`gonio study`: one scene rendered with every combination of values, on one labelled sheet.

The values go into the scene before it is validated, and kernels do not depend on them, so the first picture
compiles and the others only render.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import time
import uuid
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from ..bridge import engine
from ..catalog import notation, operands
from ..catalog.operands import Kind
from ..errors import GonioWarning, InputError
from ..material import BSDF
from ..owner import public
from ..pictures import exposures, images
from ..render.execute import by_crew, execute
from ..render.finish import picture_of
from ..render.options import RenderKeywords, takes_render_options
from ..render.prepare import Prepared, prepare
from ..render.request import Request
from ..render.request_json import described
from ..transport import passes
from ..work import crew, parts
from . import figures
from .figures import Drawing
from .variations import Variation, parse_variation, variation, with_cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Sheet", "Variation", "draw", "parse_variation", "render_sheet", "study", "variation", "with_cell"]

Pixels = NDArray[np.uint8]  # (H, W, 3)
MOST_CELLS = 256  # a sheet of more is no longer looked at, and is a typing error more often than not
WIDEST = 3200  # pixels; larger sheets are drawn at less than one picture pixel per sheet pixel
GAP, MARGIN = 8, 20
_DPI = 100


@dataclass(frozen=True)
class Sheet:
    """What came of a study; `cells` are the values of each picture, in the order of `itertools.product`.

    size      of each picture, pixels
    exposure  of all of them, stops
    output    where the sheet has been written, None where it has not
    """

    cells: tuple[dict[str, object], ...]
    spp: int
    size: tuple[int, int]
    exposure: float
    seconds: float
    warnings: tuple[str, ...]
    drawing: Drawing

    @property
    def output(self) -> Path | None:
        return self.drawing.path

    def as_dict(self) -> dict[str, object]:
        kept = {name: value for name, value in vars(self).items() if name != "drawing"}
        return {"output": str(self.output), **kept}

    def _repr_png_(self) -> bytes:
        return self.drawing._repr_png_()


@public
@takes_render_options
def study(
    scene: str | Path | BSDF,
    vary: Mapping[str | tuple[str, ...], Sequence[object]],
    *,
    output: str | Path | None = None,
    title: str = "",
    **options: Unpack[RenderKeywords],
) -> Sheet:
    """Render a scene with every combination of values, and lay the pictures on one labelled sheet.

        go.study("examples/phong", {"shapes.1.material.p": [4, 16, 64]}, output="p.png")
        go.study("phong", {"p": [4, 16], ("kd", "ks"): [(0.2, 0.8), (0.5, 0.5)]})

    scene     as in `go.render`; a material, or its text, is shown on a ball
    vary      values by their path in the scene, by that of a material's parameter ("base.alpha"), or by the parameter's
              name of a Mitsuba XML. One gives a row, two a grid (the first goes down, the second across), more a grid
              each. Several paths vary together, such as values whose sum stays: {("kd", "ks"): [(0.2, 0.8), ...]}, or
              "kd,ks"
    output    file to write, .png, .pdf or .svg; None writes nothing
    exposure  stops, the same for all pictures, or "auto"
    title     heading of the sheet; the scene's name if not given
    Other options as in `go.render`. Returns a Sheet, which a notebook shows. Raises InputError, MachineError.
    """
    named = _named(scene)
    request = Request(
        Path(named[0].name if named else str(scene)),
        **options,
    )
    variations = [variation(path, values) for path, values in vary.items()]
    tell = functools.partial(warnings.warn, category=GonioWarning, stacklevel=3)
    with engine.put_back():
        return render_sheet(request, variations, None if output is None else Path(output), title, named, tell=tell)


def _named(scene: str | Path | BSDF) -> notation.Settings | None:
    """The material that is studied, None of a scene."""
    if isinstance(scene, BSDF):
        return type(scene), {name: getattr(scene, name) for name in scene.parameters()}
    kind = operands.kind_of(scene, {Kind.SCENE, *operands.MATERIALS}, "study: scene")
    return None if kind is Kind.SCENE else notation.taken_apart(str(scene), "study: scene")


def render_sheet(
    request: Request,
    variations: Sequence[Variation],
    output: Path | None,
    title: str = "",
    named: notation.Settings | None = None,
    report: Callable[[int, int, str], None] = lambda done, total, state: None,
    tell: Callable[[str], None] = lambda text: None,
) -> Sheet:
    """Render every combination and draw the sheet; raises InputError before rendering where it can.

    named   the material that is varied, in place of a scene
    report  called before each picture with pictures done, all pictures, and what is next
    tell    called at the start with what an earlier run of the same study has left
    """
    started = time.perf_counter()
    if output is not None:
        figures.check_output(output)
    names = [path for variation in variations for path in variation.paths]
    if len(set(names)) < len(names):
        raise InputError("the same path is varied twice", "--vary", "give all its values in one --vary")
    if not variations or not all(variation.values for variation in variations):
        raise InputError("nothing is varied", "--vary", "such as shapes.1.material.p=4,16,64")
    count = math.prod(len(variation.values) for variation in variations)
    if count > MOST_CELLS:
        what = f"{count} pictures are more than a sheet holds ({MOST_CELLS})"
        raise InputError(what, "--vary", "give fewer values")
    settings = [[variation.settings(value) for value in variation.values] for variation in variations]
    cells = tuple({p: v for one in combination for p, v in one.items()} for combination in itertools.product(*settings))
    pictures: list[exposures.RGB] = []
    notices: dict[str, None] = {}
    whole = _identity(with_cell(request, cells[0], named)), [(one.path, repr(one.values)) for one in variations]
    with passes.Interrupts() as interrupts, parts.job("study", *whole) as job:
        if job.found:
            tell(f"goes on with a study that was begun: {job.found} of {len(cells)} pictures are done")
        together = 1 if crew.current().size == 1 else 2 * crew.current().size  # of a crew each needs enough to do
        for start in range(0, len(cells), together):
            some = cells[start : start + together]
            state = f"{start + len(some)}/{len(cells)}  " + ", ".join(map(figures.show_value, some[-1].values()))
            report(start, len(cells), state)
            # Each picture has the same seed, so that what differs is the parameter, not the noise.
            prepared = [prepare(with_cell(request, cell, named)) for cell in some]
            notices |= dict.fromkeys(text for one in prepared for text in one.warnings)
            pictures += _pictures(prepared, job, interrupts)
        last = prepared[-1]
        width, height = last.size
        report(len(cells), len(cells), "drawing")
    exposure = exposures.stops(request.exposure, *pictures)
    clipped = exposures.clipping(exposure, *pictures, automatic=request.exposure == "auto")
    notices |= dict.fromkeys(filter(None, [clipped]))
    heading = title or _scene_name(request.scene)
    subtitle = f"{width}×{height}, {last.spp} samples per pixel, {last.settings['integrator']}"  # noqa: RUF001
    drawing = draw([images.to_screen(picture, exposure) for picture in pictures], variations, heading, subtitle)
    if output is not None:
        drawing = drawing.save(output)
    seconds = round(time.perf_counter() - started, 2)
    return Sheet(cells, last.spp, last.size, exposure, seconds, tuple(notices), drawing)


def _identity(request: Request) -> Sequence[object]:
    """What tells a study from others; of a class that this program alone knows nothing does: no part is used again."""
    try:
        return sorted(described(request).items())
    except InputError:
        return [uuid.uuid4().hex]


def _pictures(prepared: Sequence[Prepared], job: parts.Parts, interrupts: passes.Interrupts) -> list[exposures.RGB]:
    """Some pictures of a study: as an earlier run has left them, or from where that one was stopped."""
    keys = [
        parts.key_of(sorted(one.sources.identity().items()), one.spp, one.request.denoise, one.size) for one in prepared
    ]
    with contextlib.suppress(OSError):
        job.open()
    found = {key: kept.arrays["picture"] for key in keys if (kept := job.get(key)) is not None}
    missing = [(key, one) for key, one in zip(keys, prepared, strict=True) if key not in found]

    def keep(number: int) -> None:
        key, one = missing[number]
        found[key] = picture_of(one.render, one.request.denoise)
        job.put(key, {"picture": found[key]})

    if crew.current().size > 1 and missing:
        by_crew([one for _, one in missing], interrupted=lambda: interrupts.asked, finished=keep)
        interrupts.check()
    else:
        for number, (key, one) in enumerate(missing):
            begun = job.path(key, ".checkpoint")
            _, keeper = execute(one, temporary=begun, long=0.0, interrupted=lambda: interrupts.asked)
            interrupts.check()
            keep(number)
            keeper.remove()
    return [found[key] for key in keys]


def _scene_name(scene: Path) -> str:
    resolved = scene.resolve()
    return resolved.parent.name if resolved.name == "scene.json" else resolved.stem


# --- the drawing ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Block:
    """A grid of pictures under one heading."""

    heading: str
    rows: list[str]
    columns: list[str]
    pictures: list[Sequence[Pixels]]
    row_name: str = ""
    column_name: str = ""


def draw(pictures: Sequence[Pixels], variations: Sequence[Variation], title: str, subtitle: str) -> Drawing:
    """Lay out 8-bit pictures (in the order of `itertools.product`) with labels.

    One variation: a row, wrapped where it gets long. Two: the first goes down, the second across. More: a grid
    of the last two for every combination of the others.
    """
    import matplotlib

    with matplotlib.rc_context(figures.STYLE):
        return Drawing(_draw(_blocks(pictures, variations), title, subtitle), f"{title}: {subtitle}", _DPI)


def _blocks(pictures: Sequence[Pixels], variations: Sequence[Variation]) -> list[_Block]:
    names = [variation.name for variation in variations]
    if len(set(names)) < len(names):  # p of one shape and p of another
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
    """As many columns as make the sheet's shape nearest to 16 by 10, without a nearly empty last row."""

    def badness(columns: int) -> float:
        rows = math.ceil(count / columns)
        empty = rows * columns - count
        return abs(math.log(columns * aspect / rows / 1.6)) + 2 * empty / columns

    return min(range(1, count + 1), key=badness)


def _draw(blocks: Sequence[_Block], title: str, subtitle: str) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    measuring = Figure(dpi=_DPI)
    renderer = FigureCanvasAgg(measuring).get_renderer()

    def width_of(text: str, size: float, weight: str = "normal") -> float:
        label = Text(0, 0, text, fontsize=size, fontweight=weight, figure=measuring)
        return label.get_window_extent(renderer).width

    height, width = blocks[0].pictures[0][0].shape[:2]
    columns = max(len(block.columns) for block in blocks)
    labels = max((width_of(row, 11) for block in blocks for row in block.rows), default=0)
    names = any(block.row_name for block in blocks)
    left = MARGIN + (math.ceil(labels) + 10 if labels else 0) + (24 if names else 0)
    # Labels must fit over their pictures; small pictures are then set wider apart.
    widest_label = max(width_of(label, 11) for block in blocks for label in block.columns)
    scale = min(1.0, (WIDEST - left - MARGIN) / (columns * (width + GAP)))
    if max(width, height) < 160:  # tiny pictures are shown larger, by whole pixels
        scale = float(max(1, 160 // max(width, height)))
    cell_width, cell_height = max(1, round(width * scale)), max(1, round(height * scale))
    pitch = max(cell_width, math.ceil(widest_label) + 4) + GAP
    heading_width = max(width_of(title, 15, "bold"), width_of(subtitle, 10))
    total_width = math.ceil(max(left + columns * pitch - GAP, MARGIN + heading_width) + MARGIN)

    # From the top, in pixels: title, then for each block its heading, names, labels and rows.
    title_height = 62
    label_height, name_height, heading_height, between = 22, 20, 28, 14
    heights = []
    for block in blocks:
        rows = len(block.pictures)
        extra = (heading_height if block.heading else 0) + (name_height if block.column_name else 0)
        extra += label_height if any(block.columns) else 0
        heights.append(extra + rows * cell_height + (rows - 1) * GAP)
    total_height = title_height + sum(heights) + (len(blocks) - 1) * between + MARGIN

    figure = Figure(figsize=(total_width / _DPI, total_height / _DPI), dpi=_DPI)
    FigureCanvasAgg(figure)

    def text(x: float, y: float, content: str, **style: Any) -> None:
        figure.text(x / total_width, 1 - y / total_height, content, **style)

    text(MARGIN, 30, title, fontsize=15, fontweight="bold", va="baseline")
    text(MARGIN, 49, subtitle, fontsize=10, color=figures.SOFT, va="baseline")
    y = float(title_height)
    for block, block_height in zip(blocks, heights, strict=True):
        bottom = y + block_height
        block_width = len(block.columns) * pitch - GAP
        if block.heading:
            text(MARGIN, y + 19, block.heading, fontsize=12, fontweight="bold", va="baseline")
            y += heading_height
        if block.column_name:
            text(left + block_width / 2, y + 13, block.column_name, color=figures.SOFT, ha="center", va="baseline")
            y += name_height
        for index, label in enumerate(block.columns):
            x = left + index * pitch + cell_width / 2
            text(x, y + 14, label, fontsize=11, ha="center", va="baseline")
        y += label_height if any(block.columns) else 0
        if block.row_name:
            middle = (y + bottom) / 2
            text(MARGIN + 6, middle, block.row_name, color=figures.SOFT, rotation=90, ha="center", va="center")
        for row, pictures in enumerate(block.pictures):
            if block.rows:
                text(left - 10, y + cell_height / 2, block.rows[row], fontsize=11, ha="right", va="center")
            for column, picture in enumerate(pictures):
                x = left + column * pitch
                place = (x / total_width, 1 - (y + cell_height) / total_height)
                axes = figure.add_axes((*place, cell_width / total_width, cell_height / total_height))
                axes.imshow(picture, interpolation="antialiased", aspect="auto")
                axes.set_axis_off()
            y += cell_height + GAP
        y = bottom + between
    return figure
