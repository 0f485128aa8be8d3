"""ASTM E1392 text files: lists of angles and values, the common format of scatterometers."""

from __future__ import annotations

import re
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ..tables.angles import Angles
from ..tables.base import Floats, Measurement
from ..tables.samples import Samples, sampled
from .base import Format
from .text import lines, table, written

ANGLES = ["theta_i", "phi_i", "theta_s", "phi_s"]


class Astm(Format):
    """ASTM E1392: a header of keywords, of which VARS is the last, then rows of comma-separated numbers.

    NUM_POINTS, if present, is the number of rows. VARS names the columns: four angles in radians (theta_i, phi_i,
    theta_s, phi_s), then the values: red, green and blue (R, G, B), a single channel, or one value per wavelength
    ("550nm"). Rows that form a complete grid over (theta_i, theta_s, |phi|) are read as a grid.
    """

    name: ClassVar[str] = "astm"
    suffixes: ClassVar[tuple[str, ...]] = (".astm",)
    writes: ClassVar[str] = "samples"

    def read(self, data: bytes, where: str, item: str = "") -> Measurement:
        rows: list[tuple[int, list[str]]] = []
        head: dict[str, str] = {}
        columns: list[str] = []
        for number, line in enumerate(lines(data, where), 1):
            text = line.strip()
            if not text or text.startswith("#"):
                continue
            if columns:
                rows.append((number, [word.strip() for word in text.rstrip(",").split(",")]))
                continue
            word, _, rest = (part.strip() for part in re.sub(r"[=\s]", " ", text, count=1).partition(" "))
            if word.upper() == "VARS":
                columns = [name.strip() for name in rest.lstrip("= ").split(",")]
                if len(columns) < 5 or [_plain(name) for name in columns[:4]] != [_plain(name) for name in ANGLES]:
                    what = f"VARS names {', '.join(columns[:6])}; four angles and a value expected"
                    raise InputError(what, f"{where}:{number}", f"such as VARS={','.join(ANGLES)},R,G,B")
            elif len(head) < 64:
                head[word[:80]] = rest.lstrip("= ")[:400]
        if not columns:
            raise InputError("no VARS line", where, "this is not an ASTM E1392 file")
        values = table(rows, len(columns), where)
        claimed = next((text for key, text in head.items() if key.upper() == "NUM_POINTS"), "")
        if claimed and (not claimed.isdecimal() or int(claimed) != len(values)):
            raise InputError(f"NUM_POINTS says {claimed[:20]}, {len(values)} rows follow", where, "the file is damaged")
        nm = _wavelengths(columns[4:], where)
        if nm is None and len(columns) not in (5, 7):
            what = f"{len(columns) - 4} values per row without wavelengths, 1 or 3 expected"
            raise InputError(what, where, "name the columns 550nm and so on")
        source = {"format": self.name, **head}
        values[:, [0, 2]] = np.abs(values[:, [0, 2]])
        title = head.get("TITLE", "")
        title = "" if title == "-" else title  # "-" is written for tables without a title
        grid = _grid(values, where, title, source, nm)
        return grid or Samples(values[:, :4], values[:, 4:], where, title, source, nm)

    def write(self, table: Measurement) -> bytes:
        if isinstance(table, Angles):
            i, r, p = (a.ravel() for a in np.meshgrid(table.theta_i, table.theta_r, table.phi, indexing="ij"))
            directions, values = np.stack([i, 0.0 * i, r, p], -1), table.values.reshape(len(i), -1)
        else:
            assert isinstance(table, Samples), "ensured by `resampled`"
            directions, values = table.directions, table.values
        if table.wavelengths is not None:
            names = [f"{nm:.17g}nm" for nm in table.wavelengths]
        else:
            names = ["R", "G", "B"] if values.shape[1] == 3 else ["BRDF"]
        title = table.title.replace("\n", " ")
        head = f"TITLE {title or '-'}\nNUM_POINTS {len(values)}\nVARS={','.join([*ANGLES, *names])}\n"
        return (head + written(np.concatenate([directions, values], axis=1), ",")).encode()

    def resampled(self, source: Measurement) -> Measurement:
        """Return samples and grids unchanged; evaluate other tables at the directions of `samples.plan`."""
        if isinstance(source, Samples | Angles):
            return source
        return sampled(source.rgb, title=source.title, source=source.source)


def _plain(name: str) -> str:
    return name.lower().replace(" ", "").replace("_", "").replace("thetar", "thetas").replace("phir", "phis")


def _wavelengths(names: list[str], where: str) -> Floats | None:
    """The wavelengths in column names such as "550nm"; None if there are none."""
    matches = [re.fullmatch(r"([0-9.eE+]+) *nm", name.strip()) for name in names]
    if not any(matches):
        return None
    try:
        nm = np.array([float(one[1]) if one else np.nan for one in matches])
    except ValueError:
        nm = np.full(1, np.nan)
    if not np.all(np.isfinite(nm)) or np.any(np.diff(nm) <= 0.0):
        raise InputError("the columns' wavelengths do not increase", where)
    return nm


def _grid(rows: Floats, where: str, title: str, source: dict[str, str], nm: Floats | None) -> Angles | None:
    """The rows as a table if they form a complete grid with |phi| from 0 to pi; otherwise None."""
    between = np.abs((rows[:, 3] - rows[:, 1] + np.pi) % (2.0 * np.pi) - np.pi)
    axes = [np.unique(column) for column in (rows[:, 0], rows[:, 2], between)]
    count = np.prod([len(nodes) for nodes in axes])
    if count != len(rows) or min(map(len, axes)) < 2:
        return None
    place = np.ravel_multi_index(
        [np.searchsorted(nodes, column) for nodes, column in zip(axes, (rows[:, 0], rows[:, 2], between), strict=True)],
        tuple(map(len, axes)),
    )
    if len(np.unique(place)) != count:
        return None
    theta_i, theta_r, phi = axes
    values = np.empty((int(count), rows.shape[1] - 4))
    values[place] = rows[:, 4:]
    return Angles((theta_i, theta_r, phi), values.reshape(*map(len, axes), -1), where, title, source, nm)
