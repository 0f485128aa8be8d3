"""`gonio study`: a scene rendered with every combination of values, on one labeled contact sheet.

The values are set in the scene before it is validated. Kernels do not depend on the values, so only the first picture
requires compilation.
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
from typing import Unpack

from ..bridge import engine
from ..catalog import notation, operands
from ..catalog.material import MaterialLike, material
from ..catalog.operands import Kind
from ..errors import GonioWarning, InputError, encodable
from ..owner import public
from ..pictures import exposures, images
from ..render.execute import execute, execute_all
from ..render.finish import picture_of
from ..render.options import RenderKeywords, takes_render_options
from ..render.prepare import Prepared, prepare
from ..render.request import Request
from ..render.request_json import described
from ..transport import passes
from ..work import executor, parts
from . import figures
from .figures import Drawing
from .sheet_layout import draw
from .variations import Variation, parse_variation, variation, with_cell

__all__ = ["Sheet", "Variation", "draw", "parse_variation", "render_sheet", "study", "variation", "with_cell"]

MAX_CELLS = 256  # larger numbers of pictures are hard to compare, and are usually due to a typo


@dataclass(frozen=True)
class Sheet:
    """The result of a study. `cells` contains the values of each picture, in the order of `itertools.product`.

    size      width and height of each picture, in pixels
    exposure  exposure of all pictures, in stops
    output    file to which the sheet was written, or None
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
        results = {name: value for name, value in vars(self).items() if name != "drawing"}
        return {"output": str(self.output), **results}

    def _repr_png_(self) -> bytes:
        return self.drawing._repr_png_()


@public
@takes_render_options
def study(
    scene: MaterialLike,
    vary: Mapping[str | tuple[str, ...], Sequence[object]],
    *,
    output: str | Path | None = None,
    title: str = "",
    **options: Unpack[RenderKeywords],
) -> Sheet:
    """Render a scene with every combination of values, and arrange the pictures on one labeled sheet.

        go.study("examples/phong", {"shapes.1.material.p": [4, 16, 64]}, output="p.png")
        go.study("phong", {"p": [4, 16], ("kd", "ks"): [(0.2, 0.8), (0.5, 0.5)]})

    scene     as in `go.render`; a material, in any form that `go.material` accepts, is shown on a ball
    vary      values by their path in the scene, by the path of a material's parameter ("base.alpha"), or by the name of
              a parameter of a Mitsuba XML file. One path gives a row; two paths give a grid, whose rows correspond to
              the first path and whose columns to the second; more paths give several grids. Paths may vary together,
              for example with a constant sum: {("kd", "ks"): [(0.2, 0.8), ...]}, or "kd,ks"
    output    file to write, .png, .pdf or .svg; None writes nothing
    exposure  exposure in stops, the same for all pictures, or "auto"
    title     heading of the sheet; by default, the scene's name
    Other options are as in `go.render`. Returns a Sheet, which a notebook displays. Raises InputError for an invalid
    scene, path, value or option, MachineError if this machine cannot render the scene.
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


def _named(scene: MaterialLike) -> notation.Settings | None:
    """The material to vary; None for a scene."""
    if not isinstance(scene, str | Path):
        shown = material(scene)
        return type(shown), {name: getattr(shown, name) for name in shown.parameters()}
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
    """Render every combination and draw the sheet. Errors are raised before rendering if possible.

    named   the material to vary, instead of a scene
    report  called before each picture, with the number of completed pictures, the total number, and a description of
            the next picture
    tell    called at the start with a notice about results of an earlier run
    """
    started = time.perf_counter()
    if output is not None:
        figures.check_output(output)
    cells = cells_of(variations)
    pictures: list[exposures.RGB] = []
    notices: dict[str, None] = {}
    identity = _identity(with_cell(request, cells[0], named)), [(one.path, repr(one.values)) for one in variations]
    with passes.Interrupts() as interrupts, parts.job("study", *identity) as job:
        if job.found:
            tell(f"resumes an interrupted study: {job.found} of {len(cells)} pictures are complete")
        together = 2 * executor.current().size if executor.current().remote else 1  # keeps every worker busy
        for start in range(0, len(cells), together):
            some = cells[start : start + together]
            state = f"{start + len(some)}/{len(cells)}  " + ", ".join(map(figures.show_value, some[-1].values()))
            report(start, len(cells), state)
            # All pictures have the same seed, so that they differ in the parameter, not in the noise.
            prepared = [prepare(with_cell(request, cell, named)) for cell in some]
            notices |= dict.fromkeys(text for one in prepared for text in one.warnings)
            pictures += _pictures(prepared, job, interrupts)
        last = prepared[-1]
        width, height = last.size
        report(len(cells), len(cells), "drawing")
        exposure = exposures.stops(request.exposure, *pictures)
        clipped = exposures.clipping(exposure, *pictures, automatic=request.exposure == "auto")
        notices |= dict.fromkeys(filter(None, [clipped]))
        heading = encodable(title or _scene_name(request.scene))
        subtitle = f"{width}×{height}, {last.spp} samples per pixel, {last.settings['integrator']}"  # noqa: RUF001
        drawing = draw([images.to_screen(picture, exposure) for picture in pictures], variations, heading, subtitle)
        if output is not None:  # inside the `with` block, so that the pictures remain stored if writing fails
            drawing = drawing.save(output)
    seconds = round(time.perf_counter() - started, 2)
    return Sheet(cells, last.spp, last.size, exposure, seconds, tuple(notices), drawing)


def cells_of(variations: Sequence[Variation]) -> tuple[dict[str, object], ...]:
    """The values of each picture, in the order of `itertools.product`. Raises InputError if there are no values, or too
    many for a sheet."""
    names = [path for variation in variations for path in variation.paths]
    if len(set(names)) < len(names):
        raise InputError("the same path is varied twice", "--vary", "give all its values in one --vary")
    if not variations or not all(variation.values for variation in variations):
        raise InputError("nothing is varied", "--vary", "such as shapes.1.material.p=4,16,64")
    count = math.prod(len(variation.values) for variation in variations)
    if count > MAX_CELLS:
        what = f"{count} pictures are more than a sheet holds ({MAX_CELLS})"
        raise InputError(what, "--vary", "give fewer values")
    settings = [[variation.settings(value) for value in variation.values] for variation in variations]
    return tuple({p: v for one in combination for p, v in one.items()} for combination in itertools.product(*settings))


def _identity(request: Request) -> Sequence[object]:
    """The identity of a study. It is unique for a class that is defined only in this program, so that no part is
    reused."""
    try:
        return sorted(described(request).items())
    except InputError:
        return [uuid.uuid4().hex]


def _pictures(prepared: Sequence[Prepared], job: parts.Parts, interrupts: passes.Interrupts) -> list[exposures.RGB]:
    """Some pictures of a study, taken from the results of an earlier run or rendered; an interrupted picture is
    resumed."""
    keys = [
        parts.key_of(sorted(one.sources.identity().items()), one.spp, one.request.denoise, one.size) for one in prepared
    ]
    with contextlib.suppress(OSError):
        job.open()
    pictures = {key: stored.arrays["picture"] for key in keys if (stored := job.get(key)) is not None}
    missing = [(key, one) for key, one in zip(keys, prepared, strict=True) if key not in pictures]

    def keep(number: int) -> None:
        key, one = missing[number]
        pictures[key] = picture_of(one.render, one.request.denoise)
        job.put(key, {"picture": pictures[key]})

    if executor.current().remote and missing:
        execute_all([one for _, one in missing], interrupted=lambda: interrupts.asked, finished=keep)
        interrupts.check()
    else:
        for number, (key, one) in enumerate(missing):
            begun = job.path(key, ".checkpoint")
            _, keeper = execute(one, temporary=begun, long=0.0, interrupted=lambda: interrupts.asked)
            interrupts.check()
            keep(number)
            keeper.remove()
    return [pictures[key] for key in keys]


def _scene_name(scene: Path) -> str:
    resolved = scene.resolve()
    return resolved.parent.name if resolved.name == "scene.json" else resolved.stem
