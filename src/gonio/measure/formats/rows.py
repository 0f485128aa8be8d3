"""Text files with rows of directions and values of f, which any program can write.

    # up: y
    wo.x, wo.y, wo.z, wi.x, wi.y, wi.z, f
    0.36, -0.48, 0.8, 0.0, 0.6, 0.8, 0.1507

Commas, semicolons, tabs or spaces separate the numbers; empty lines and lines that start with # are skipped. Each row
consists of wo, wi and one or three values of f. The first line may name the columns. If the columns are named theta_i,
phi_i, theta_o and phi_o (or theta_r, theta_s), in any order, the directions are angles in degrees. Five columns without
names are theta_o, phi_o, theta_i, phi_i and f.
"""

from __future__ import annotations

import re
from typing import ClassVar, NamedTuple

import numpy as np

from ...errors import InputError
from ...optics.frame import spherical_array
from ..tables.base import Floats, Measurement, in_rgb
from ..tables.samples import UNIT, Samples, sampled
from . import text
from .base import Format

RADIANS = 1.6  # if no theta exceeds this, and no phi four times this, the angles are probably in radians
ANGLES = ("theta_o", "phi_o", "theta_i", "phi_i")
WIDTHS = {5: 4, 7: 6, 9: 6}  # number of columns in a file without column names -> number of columns of its directions
HINT = "7 columns are wo, wi and f; 9 have f in three channels; 5 are theta_o, phi_o, theta_i, phi_i, f in degrees"
UP = {"z": [0, 1, 2], "y": [2, 0, 1], "x": [1, 2, 0]}  # the axes that are rotated to x, y and z
_COMMENT = re.compile(r"^\s*(?:#|//)\s*(\w+)\s*:\s*(.+?)\s*$")


class Pairs(NamedTuple):
    """Directions (N, 3) with z up, values of f (N, 1) or (N, 3), and the line number of each row."""

    wo: Floats
    wi: Floats
    f: Floats
    line: list[int]


def parsed(data: bytes, where: str, up: str = "z") -> Pairs:
    """Read the rows of a file, and rotate the directions so that the axis `up` becomes z.

    where  name of the file in errors
    Raises InputError, which names the line, for damaged files.
    """
    names, table = _split(text.lines(data, where))
    if not table:
        raise InputError("no rows of numbers", where, "write rows of wo.x wo.y wo.z wi.x wi.y wi.z f")
    angles = _angles(names, where)
    width, lines = len(table[0][1]), [line for line, _ in table]
    first = len(ANGLES) if angles else WIDTHS.get(width, 0)
    if first == 0 or width - first not in (1, 3):
        raise InputError(f"{width} columns given", where, HINT)
    values = text.table(table, width, where)
    if first == 4:
        places = [angles.index(name) for name in ANGLES] if angles else range(4)
        degrees = values[:, list(places)]
        theta, phi = np.abs(degrees[:, [0, 2]]).max(), np.abs(degrees[:, [1, 3]]).max()
        if 0.0 < theta <= RADIANS and phi <= 4.0 * RADIANS:
            raise InputError(
                f"angles of at most {theta:.3g} degrees", where, "convert the angles from radians to degrees"
            )
        wo, wi = _at(*degrees[:, :2].T), _at(*degrees[:, 2:].T)
        return Pairs(wo, wi, values[:, 4:], lines)
    wo, wi = (_directions(values[:, k : k + 3], name, lines, where) for k, name in ((0, "wo"), (3, "wi")))
    return Pairs(wo[:, UP[up]], wi[:, UP[up]], values[:, 6:], lines)


def comments(data: bytes) -> dict[str, str]:
    """The key-value pairs in comments such as `# up: y`."""
    matches = (_COMMENT.match(line) for line in data.decode("utf-8-sig", "replace").splitlines())
    return {match[1]: match[2] for match in matches if match}


def _split(lines: list[str]) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The names of the columns, if present, and the line number and words of each row; comments are skipped."""
    names: list[str] = []
    table: list[tuple[int, list[str]]] = []
    for number, line in enumerate(lines, 1):
        words = [word for word in re.split(r"[,;\s]+", line.strip()) if word]
        if not words or words[0].startswith(("#", "//")):
            continue
        if not table and not _is_number(words[0]):
            names = [word.strip("\"'").lower() for word in words]
            continue
        table.append((number, words))
    return names, table


def _angles(names: list[str], where: str) -> list[str]:
    """The names of the four angles in the order of the columns; [] if the columns are not named or not angles."""
    if not any(name.startswith("theta") for name in names):
        return []
    given = [re.sub(r"_[rsv]\b", "_o", name) for name in names[:4]]
    if sorted(given) != sorted(ANGLES):
        what = f"columns {', '.join(names[:4])} given, {', '.join(ANGLES)} expected in any order"
        raise InputError(what, where, "angles in degrees, then f")
    return given


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _at(theta: Floats, phi: Floats) -> Floats:
    """The unit vectors at angles in degrees, (N, 3)."""
    return spherical_array(np.sin(np.radians(theta)), np.cos(np.radians(theta)), np.radians(phi))


def _directions(w: Floats, name: str, lines: list[int], where: str) -> Floats:
    length = np.linalg.norm(w, axis=1)
    off = np.abs(length - 1.0)
    worst = int(np.argmax(off))
    if off[worst] > UNIT:
        what = f"{name} of length {length[worst]:.4g} given, a unit vector expected"
        raise InputError(what, f"{where}:{lines[worst]}", "normalize the directions")
    return np.asarray(w / length[:, None])


class Rows(Format):
    """Rows of wo, wi and f, where z points up unless a comment such as `# up: y` names another axis."""

    name: ClassVar[str] = "rows"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    writes: ClassVar[str] = "samples"
    common: ClassVar[bool] = True

    def read(self, data: bytes, where: str, item: str = "") -> Samples:
        about = comments(data)
        up = about.get("up", "z")
        if up not in UP:
            raise InputError(f"unknown axis '{up}' in '# up:'", where, "give the axis along the normal: z, y or x")
        pairs = parsed(data, where, up)
        lowest = np.minimum(pairs.wo[:, 2], pairs.wi[:, 2])
        if lowest.min() <= 0.0:
            line = pairs.line[int(np.argmin(lowest))]
            what = "a direction below the surface"
            raise InputError(what, f"{where}:{line}", "give reflected light only; another axis is up: '# up: y'")
        source = {"format": self.name, **{key: value for key, value in about.items() if key not in ("up", "title")}}
        return Samples.of_pairs(pairs.wo, pairs.wi, pairs.f, where, about.get("title", ""), source)

    def write(self, table: Measurement) -> bytes:
        assert isinstance(table, Samples), "ensured by `resampled`"
        f = in_rgb(table.values, table.wavelengths)
        title = " ".join(table.title.split())
        head = f"# title: {title}\n" if title else ""
        head += "wo.x,wo.y,wo.z,wi.x,wi.y,wi.z,f.r,f.g,f.b\n"
        return (head + text.written(np.concatenate([*table.pairs(), f], axis=1), ",")).encode()

    def resampled(self, source: Measurement) -> Measurement:
        """Return RGB samples unchanged, convert spectral samples to RGB, evaluate other tables at `samples.plan`."""
        if not isinstance(source, Samples):
            return sampled(source.rgb, title=source.title, source=source.source)
        if source.wavelengths is None and source.values.shape[1] == 3:
            return source
        rgb = in_rgb(source.values, source.wavelengths)
        return Samples(source.directions, rgb, title=source.title, source=source.source)
