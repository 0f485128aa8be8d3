"""Functions shared by all figures: style, output files, and values from the command line."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import re
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .. import files
from .._html import numbered_ids
from ..errors import InputError, did_you_mean, encodable

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".pdf", ".svg")
SUBTITLE = 9.5  # font size, in points
INK, SOFT, FAINT = "#1d2530", "#6b7683", "#d9dee4"
CHANNELS = ("#c8354a", "#2f9457", "#2f62b5")  # red, green and blue with equal contrast on white
# distinguishable for color-blind readers too
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#a6761d", "#56b4e9", "#1d2530")
DASHES = (0, (4, 2))
STYLE: Any = {  # Matplotlib types its keys one by one
    "font.family": "sans-serif",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "grid.color": FAINT,
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "svg.fonttype": "none",  # text is not converted to paths
    "svg.hashsalt": "gonio",  # equal figures give equal files
}


def load_matplotlib() -> ModuleType:
    """Matplotlib, with the user's settings instead of those in the current folder.

    On import, Matplotlib prefers a file `matplotlibrc` in the current folder; such a file may specify modules and
    programs to run.
    """
    hidden = "matplotlib" not in sys.modules and os.path.exists("matplotlibrc")
    with contextlib.chdir(os.sep) if hidden else contextlib.nullcontext():
        import matplotlib
    return matplotlib


@dataclass(frozen=True)
class Drawing:
    """A figure, which a notebook displays and `save` writes to a file.

    path  the file to which the figure was written, or None
    """

    figure: Figure
    about: str
    dpi: float = 150
    path: Path | None = None

    def save(self, path: str | Path) -> Drawing:
        """Write the figure as .png, .pdf or .svg, completely or not at all. Returns the drawing with its `path`."""
        suffix = _suffix(Path(path))
        return replace(self, path=files.write_whole(path, self._file(suffix[1:])))

    def _repr_png_(self) -> bytes:
        return self._file("png")

    def _file(self, kind: str) -> bytes:
        """The figure in a file format; repeated calls return the same bytes."""
        matplotlib = load_matplotlib()
        from matplotlib.text import Text

        for text in self.figure.findobj(Text):  # file names may contain invalid text, which fonts reject
            text.set_text(encodable(text.get_text()))
        name = "Subject" if kind == "pdf" else "Description"
        no_date = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(kind, {})
        stream = io.BytesIO()
        with matplotlib.rc_context(STYLE):
            metadata = {name: encodable(self.about), **no_date}
            self.figure.savefig(stream, format=kind, dpi=self.dpi, metadata=metadata, facecolor="white")
        return numbered_ids(stream.getvalue().decode()).encode() if kind == "svg" else stream.getvalue()


def check_output(path: Path) -> Path:
    """Raise InputError if no figure can be written to `path`. It is called before anything is computed."""
    _suffix(path)
    files.check_file(path)
    return path


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        hint = did_you_mean(suffix, SUFFIXES) if suffix else "add " + " or ".join(SUFFIXES)
        raise InputError(f"unknown figure format '{path.suffix}'", str(path), hint)
    return suffix


def blank(width: float, height: float, title: str, subtitle: str) -> Figure:
    """An empty figure with a title and a subtitle, which takes several lines if it is wider than the figure.

    No window is opened, regardless of the backend.

    width, height  size of the figure, in inches
    """
    load_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    left = 0.3 / width
    figure.text(left, 1 - 0.38 / height, title, fontsize=14, fontweight="bold", va="baseline")
    below = figure.text(left, 1 - 0.62 / height, subtitle, fontsize=SUBTITLE, color=SOFT, va="baseline")
    excess = below.get_window_extent().width / figure.dpi / (width - 0.6)
    if excess > 1.0:
        longest = math.ceil(1.06 * len(subtitle) / math.ceil(0.9 * excess))
        below.set_text("\n".join(textwrap.wrap(subtitle, longest)))
        below.set(y=1 - 0.5 / height, va="top", fontsize=0.85 * SUBTITLE)
    return figure


def legend_size(handles: Sequence[Artist], width: float) -> tuple[int, float]:
    """The number of columns, and the height in inches, of a legend along the lower edge that is `width` inches wide."""
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, int(width / (0.75 + 0.075 * longest))))
    return columns, 0.3 + 0.2 * math.ceil(len(handles) / columns)


def legend_below(figure: Figure, handles: Sequence[Artist]) -> None:
    columns, _ = legend_size(handles, figure.get_figwidth())
    figure.legend(handles=handles, loc="lower center", ncols=columns, fontsize=9.5, bbox_to_anchor=(0.5, 0.01))


def parse_value(text: str) -> Any:
    """The value of a text: parsed as JSON if possible, where a leading zero is optional; otherwise, the text itself."""
    stripped = text.strip()
    with_zeros = re.sub(r"(?<![\w.])\.(?=\d)", "0.", stripped)
    try:
        return json.loads(with_zeros)
    except (ValueError, RecursionError):
        return stripped


def split_values(text: str) -> list[Any]:
    """The values of "1,[2,3],gold", split at commas outside of brackets, braces and quotes."""
    pieces, depth, quoted, start = [], 0, False, 0
    for at, letter in enumerate(text):
        if letter == '"' and text[at - 1 : at] != "\\":
            quoted = not quoted
        elif quoted:
            continue
        elif letter in "[{(":
            depth += 1
        elif letter in "]})":
            depth -= 1
        elif letter == "," and depth == 0:
            pieces.append(text[start:at])
            start = at + 1
    pieces.append(text[start:])
    return [parse_value(piece) for piece in pieces]


def show_value(value: object, longest: int = 28) -> str:
    """A value as text for a label, abbreviated to `longest` characters."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    # integers beyond the range of floats are shown as text
    if isinstance(value, float) or (isinstance(value, int) and abs(value) < 1 << 64):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        text = "(" + ", ".join(show_value(item) for item in value) + ")"
    elif isinstance(value, dict):
        text = str(value.get("type", json.dumps(value)))
    else:
        text = encodable(str(value))
    return text if len(text) <= longest else text[: longest - 1] + "…"
