"""`gonio compare` and `go.compare`: the difference between two pictures or two materials, with an error map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import shown
from ..catalog import operands
from ..catalog.material import HasEval, MaterialLike, is_material, material, title_of
from ..energy.difference import Difference, difference
from ..errors import InputError
from ..material import BSDF
from ..owner import public
from ..pictures import images, metrics
from . import difference_map, figures

_DPI = 100
_TITLES = {
    "rmse": "RMS difference over the channels",
    "relmse": "(x − r)² / (r² + 0.01), mean over channels",  # noqa: RUF001
    "flip": "FLIP",
}


@overload
def compare(
    test: BSDF | Mapping[str, Any] | type[Any] | HasEval,
    reference: MaterialLike,
    *,
    metric: str | None = ...,
    tolerance: float | None = ...,
    output: str | Path | None = ...,
    encoding: str = ...,
) -> Difference: ...
@overload
def compare(
    test: str | Path | ArrayLike,
    reference: str | Path | ArrayLike,
    *,
    metric: str | None = ...,
    tolerance: float | None = ...,
    output: str | Path | None = ...,
    encoding: str = ...,
) -> metrics.Comparison: ...
@public
def compare(
    test: ArrayLike | MaterialLike,
    reference: ArrayLike | MaterialLike,
    *,
    metric: str | None = None,
    tolerance: float | None = None,
    output: str | Path | None = None,
    encoding: str = "srgb",
) -> metrics.Comparison | Difference:
    """Measure the difference between two pictures or two materials.

        go.compare("mine.exr", "reference.exr", metric="flip", tolerance=0.05).passed
        go.compare(go.OrenNayar(sigma=0.5), "lambert").largest

    test, reference  files (.exr, .hdr, .png, .npz), or linear RGB of shape (H, W, 3), row 0 on top; or two materials,
                     in any form that `go.material` accepts
    metric           the metric for `tolerance` and the map: for pictures, "relmse", "rmse" or "flip"; for materials,
                     "mean", "largest" or "albedo"; None selects the first of these
    tolerance        the largest value that passes
    output           file for an error map, .png, .pdf or .svg; None writes nothing
    encoding         encoding of .png files: "srgb", or "linear" for data such as a table
    Returns a Comparison with all metrics and the verdict; for materials, a Difference, which also states the directions
    in which f and the albedo differ most. FLIP is HDR-FLIP, unless a picture is a .png. Raises InputError for pictures
    that cannot be read or differ in size, and for arguments that are neither pictures nor materials.
    """
    if output is not None:
        figures.check_output(Path(output))
    if _is_material(test):
        return compare_materials(test, reference, metric or "mean", tolerance, output)
    judged = metrics.Tolerance(metric or "relmse", tolerance)
    a, b = _picture(test, "test", encoding), _picture(reference, "reference", encoding)
    try:
        comparison = metrics.compare(a.pixels, b.pixels, a.hdr and b.hdr, judged)
    except InputError as error:
        raise InputError(error.what, f"{a.path}, {b.path}", error.hint) from error
    if output is not None:
        draw(a, b, judged.metric).save(output)
    return comparison if a.hdr and b.hdr else replace(comparison, encoding=encoding)


def compare_materials(
    test: Any, reference: Any, metric: str, tolerance: float | None, output: str | Path | None
) -> Difference:
    """As `compare`, for two materials, each of which is a string or an object."""
    named = []
    for one in (test, reference):
        if not _is_material(one):
            what, hint = f"{type(one).__name__} given, a material expected", "compare two materials or two pictures"
            raise InputError(what, "compare", hint)
        named.append((title_of(one), material(one)))
    (name_a, a), (name_b, b) = named
    compared = difference(a, b, metric, tolerance)
    if output is not None:
        difference_map.draw(name_a, name_b, a, b, compared).save(output)
    return compared


def _is_material(given: object) -> bool:
    """Whether the argument is a material; a string that may name a picture counts as a picture."""
    if not isinstance(given, str | Path):
        return is_material(given)
    return operands.readings(str(given))[0] in operands.MATERIALS


def _picture(given: object, name: str, encoding: str) -> images.Picture:
    if _is_material(given):
        raise InputError("a picture and a material given", "compare", "compare two materials or two pictures")
    if isinstance(given, str | Path):
        return images.read(given, encoding)
    try:
        numeric = np.asarray(given).dtype.kind in "fiub"
    except (TypeError, ValueError):  # ragged
        numeric = False
    if not numeric:
        what = f"{shown(given)} given, a picture, a material or an array of numbers expected"
        raise InputError(what, f"compare: {name}")
    return images.Picture(np.asarray(given, np.float32), Path(name))


def error_of(test: images.Picture, reference: images.Picture, metric: str) -> NDArray[np.floating]:
    """The (H, W) map whose mean is the metric (for rmse, whose root mean square is the metric)."""
    if metric == "flip":
        return metrics.flip_map(test.pixels, reference.pixels, test.hdr and reference.hdr)
    if metric == "relmse":
        return metrics.relmse_map(test.pixels, reference.pixels)
    difference = test.pixels.astype(np.float64) - reference.pixels
    return np.sqrt((difference**2).mean(axis=2))


def draw(test: images.Picture, reference: images.Picture, metric: str) -> figures.Drawing:
    """Draw the map. The range is 0 to 1 for FLIP, otherwise 0 to the 99.5th percentile, so that a few fireflies do not
    darken the rest of the map. An arrow on the color bar indicates larger values."""
    matplotlib = figures.load_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    error = error_of(test, reference, metric)
    highest = 1.0 if metric == "flip" else float(np.percentile(error, 99.5)) or float(error.max()) or 1.0
    height, width = error.shape
    scale = min(1.0, 3000 / width) if width >= 480 else max(1, 480 // width)
    shown_width, shown_height = width * scale, height * scale
    # The bar is at the bottom, because most pictures are wide.
    left, top, bottom = 16, 58, 62
    total_width, total_height = shown_width + 2 * left, shown_height + top + bottom
    with matplotlib.rc_context(figures.STYLE):
        figure = Figure(figsize=(total_width / _DPI, total_height / _DPI), dpi=_DPI)
        FigureCanvasAgg(figure)
        box = (left / total_width, bottom / total_height, shown_width / total_width, shown_height / total_height)
        axes = figure.add_axes(box)
        # Magma is perceptually uniform, so equal steps of error look equal, even when printed in gray.
        shown = axes.imshow(error, cmap="magma", vmin=0, vmax=highest, interpolation="antialiased", aspect="auto")
        axes.set_axis_off()
        bar_width = min(shown_width, 420)
        place = (left / total_width, 36 / total_height, bar_width / total_width, 12 / total_height)
        more = "max" if error.max() > highest else "neither"
        bar = figure.colorbar(shown, cax=figure.add_axes(place), orientation="horizontal", extend=more)
        bar.outline.set_linewidth(0.5)
        bar.ax.tick_params(labelsize=8, length=2)
        x = left / total_width
        names = f"{test.path.name} and {reference.path.name}"
        figure.text(x, 1 - 26 / total_height, names, fontsize=12, fontweight="bold", va="baseline")
        about = f"{_TITLES[metric]}; mean {error.mean():.4g}, largest {error.max():.4g}"
        figure.text(x, 1 - 45 / total_height, about, fontsize=9, color=figures.SOFT, va="baseline")
    return figures.Drawing(figure, about, _DPI)
