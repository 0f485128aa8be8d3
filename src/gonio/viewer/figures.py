"""What all our figures share: one look, one way to a file, and values typed on the command line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import files
from ..errors import InputError, did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".pdf", ".svg")
INK, SOFT, FAINT = "#1d2530", "#6b7683", "#d9dee4"
CHANNELS = ("#c8354a", "#2f9457", "#2f62b5")  # red, green, blue, of even weight on white
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
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "gonio",  # and the same figure the same file
}


def check_output(path: Path) -> Path:
    """Raise InputError where no figure can be written to `path`: before anything is computed."""
    if path.suffix.lower() not in SUFFIXES:
        hint = did_you_mean(path.suffix.lower(), SUFFIXES) if path.suffix else "add " + " or ".join(SUFFIXES)
        raise InputError(f"unknown figure format '{path.suffix}'", str(path), hint)
    files.check_file(path)
    return path


def save(figure: Figure, path: Path, dpi: float, about: str) -> Path:
    """Write a figure, whole or not at all."""
    names = {".png": "Description", ".pdf": "Subject", ".svg": "Description"}
    metadata: dict[str, Any] = {names[path.suffix.lower()]: about}

    def fill(temporary: Path) -> None:
        figure.savefig(temporary, dpi=dpi, metadata=metadata, facecolor="white")

    return files.write_whole(path, fill)


def parse_value(text: str) -> Any:
    """A value as typed: JSON where it is, with ".3" for 0.3 allowed; else the text itself."""
    stripped = text.strip()
    with_zeros = re.sub(r"(?<![\w.])\.(?=\d)", "0.", stripped)
    try:
        return json.loads(with_zeros)
    except (ValueError, RecursionError):
        return stripped


def split_values(text: str) -> list[Any]:
    """The values of "1,[2,3],gold": split at commas outside of brackets, braces and quotes."""
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


def show_value(value: Any, longest: int = 28) -> str:
    """A value as a label shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        text = "(" + ", ".join(show_value(item) for item in value) + ")"
    elif isinstance(value, dict):
        text = str(value.get("type", json.dumps(value)))
    else:
        text = str(value)
    return text if len(text) <= longest else text[: longest - 1] + "…"
