"""Zemax's tabular BSDF, a text format for data interchange by Radiant Imaging."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...errors import InputError
from .. import colours
from ..tables.base import Floats, Measurement, in_rgb
from ..tables.specular import Specular, sampled
from .base import Format
from .text import lines, numbers, table, written

AXES = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
BLOCKS = {"monochrome": ("Monochrome",), "xyz": ("TristimulusX", "TristimulusY", "TristimulusZ")}
MOST = 100_000  # maximum number of nodes that the header may state for an axis


class _Lines:
    """The numbered lines of a file, without comments and empty lines, read one by one."""

    def __init__(self, rows: list[tuple[int, str]], where: str) -> None:
        self._rows, self.where = iter(rows), where

    def left(self) -> tuple[int, str] | None:
        """The next line; None at the end of the file."""
        return next(self._rows, None)

    def following(self, what: str) -> tuple[int, str]:
        """The next line. Raises InputError, which states that `what` is expected, at the end of the file."""
        row = self.left()
        if row is None:
            raise InputError(f"the file ends where {what} is expected", self.where, "the file is truncated")
        return row

    def keyword(self, word: str, first_only: bool = True, hint: str = "") -> tuple[int, str]:
        """The next line, which must begin with the given keyword."""
        number, line = self.following(f"'{word}'")
        if (line.split()[0] if first_only else line).lower() != word.lower():
            raise InputError(f"'{line[:40]}' where '{word}' is expected", f"{self.where}:{number}", hint)
        return number, line


def _head(rest: _Lines) -> tuple[dict[str, str], dict[str, Floats]]:
    """Read the header: the keywords, and the axes in radians."""
    head: dict[str, str] = {}
    axes: dict[str, Floats] = {}
    where = rest.where
    while len(axes) < len(AXES):
        number, line = rest.following(f"'{AXES[len(axes)]}'")
        word, _, value = line.partition(" " if " " in line else "\t")
        if word in AXES:
            claimed = numbers([value], where, number)[0]
            if claimed != int(claimed) or not 1 <= claimed <= MOST:
                raise InputError(f"{word} {value.strip()[:20]}, a count from 1 expected", f"{where}:{number}")
            angles: list[float] = []
            while len(angles) < claimed:
                number, line = rest.following(f"{claimed:g} angles of {word}")
                angles += numbers(line.split(), where, number)
            if len(angles) != claimed:
                raise InputError(f"{len(angles)} angles of {word}, {claimed:g} expected", f"{where}:{number}")
            axes[word] = np.radians(angles)
        elif len(head) < 32 and word:
            head[word[:80]] = value.strip()[:400]
        else:
            raise InputError("no list of angles where one is expected", f"{where}:{number}")
    return head, axes


def _blocks(head: dict[str, str], axes: dict[str, Floats], where: str) -> tuple[str, ...]:
    """The names of the blocks of values. Raises InputError for files that cannot be read, such as a BTDF."""
    for word in AXES:
        if word not in axes:
            raise InputError(f"no axis {word}", where)
    if head.get("ScatterType", "BRDF").upper() != "BRDF":
        raise InputError(f"ScatterType {head['ScatterType'][:20]}, BRDF expected", where, "reflection only")
    if len(axes["SampleRotation"]) != 1:
        raise InputError(f"{len(axes['SampleRotation'])} sample rotations, one expected", where, "isotropic only")
    blocks = BLOCKS.get(head.get("SpectralContent", "Monochrome").lower())
    if blocks is None:
        raise InputError(f"SpectralContent {head['SpectralContent'][:20]}, Monochrome or XYZ expected", where)
    return blocks


def _channel(rest: _Lines, block: str, incidences: int, azimuths: int, radials: int) -> Floats:
    """One block of values, (incidences, azimuths, radials)."""
    for word in (block, "DataBegin"):
        rest.keyword(word)
    values = []
    for _ in range(incidences):
        number, line = rest.keyword("TIS")
        numbers(line.split()[1:2], rest.where, number)
        rows = [rest.following(f"{azimuths} rows of azimuth") for _ in range(azimuths)]
        values.append(table([(n, line.split()) for n, line in rows], radials, rest.where))
    rest.keyword("DataEnd", first_only=False, hint="too many rows?")
    return np.stack(values)


class Zemax(Format):
    """Zemax BSDF: a header with keywords and axes in degrees, then a block of values for each channel.

    The view direction is relative to the mirror direction: ScatterRadial is the angle between the two, and
    ScatterAzimuth is the azimuth about the mirror direction, 0 toward the normal. For each AngleOfIncidence, a block
    contains a line "TIS x" and, for each azimuth, a row of values by radial angle, in 1/sr. Only BRDFs with one
    SampleRotation and the spectral content Monochrome or XYZ are supported. Anisotropic samples, which have several
    rotations, and BTDFs are rejected.
    """

    name: ClassVar[str] = "zemax"
    suffixes: ClassVar[tuple[str, ...]] = (".zbsdf", ".bsdf")
    writes: ClassVar[str] = "specular"

    def fits(self, data: bytes) -> bool:
        return not data.startswith(b"tensor_file")

    def read(self, data: bytes, where: str, item: str = "") -> Specular:
        rows = [(n, line.strip()) for n, line in enumerate(lines(data, where), 1)]
        comments = [line.strip("# ") for _, line in rows if line.startswith("#")]
        rest = _Lines([(n, line) for n, line in rows if line and not line.startswith("#")], where)
        head, axes = _head(rest)
        blocks = _blocks(head, axes, where)
        shape = [len(axes[word]) for word in AXES[1:]]
        channels = [_channel(rest, block, *shape) for block in blocks]
        if (left := rest.left()) is not None:
            raise InputError(f"'{left[1][:40]}' after the end of the data", f"{where}:{left[0]}")
        values = np.stack(channels, -1)
        if len(channels) == 3:
            values = values @ colours.XYZ_TO_RGB.T
        title = next((text.partition(":")[2].strip() for text in comments if text.lower().startswith("model")), "")
        grid = axes["AngleOfIncidence"], axes["ScatterAzimuth"], axes["ScatterRadial"]
        title = title or (comments[0] if comments else "")
        return Specular(grid, values, where, title, {"format": self.name, **head})

    def write(self, table: Measurement) -> bytes:
        assert isinstance(table, Specular), "`resampled` made it so"
        values = in_rgb(table.values, table.wavelengths)
        grey = table.values.shape[-1] == 1
        content, blocks = ("Monochrome", BLOCKS["monochrome"]) if grey else ("XYZ", BLOCKS["xyz"])
        values = values[..., :1] if grey else values @ np.linalg.inv(colours.XYZ_TO_RGB).T
        symmetry = "ASymmetrical" if table.azimuth[-1] > 1.5 * np.pi else "PlaneSymmetrical"
        axes = (np.zeros(1), table.theta_i, table.azimuth, table.radial)
        parts = [f"#Written by Gonio\n#Model: {table.title.replace(chr(10), ' ')}\nSource  Measured\n"]
        parts.append(f"Symmetry  {symmetry}\nSpectralContent  {content}\nScatterType  BRDF\n")
        for word, nodes in zip(AXES, axes, strict=True):
            parts.append(f"{word} {len(nodes)}\n" + written(np.degrees(nodes)[None]))
        shares = scattered(table)
        for channel, block in enumerate(blocks):
            parts.append(f"\n{block}\nDataBegin\n")
            for view, share in zip(values[..., channel], shares, strict=True):
                parts.append(f"TIS {share:.6g}\n" + written(view))
            parts.append("DataEnd\n")
        return "".join(parts).encode()

    def resampled(self, source: Measurement) -> Measurement:
        """The table itself if it is of kind `specular`; otherwise, its values at the nodes of such a table."""
        return source if isinstance(source, Specular) else sampled(source.rgb, title=source.title, source=source.source)


def scattered(table: Specular) -> list[float]:
    """The total integrated scatter for each angle of incidence, int f cos theta_r d omega_r, in luminance."""
    rng = np.random.default_rng(1)
    u, v = (np.arange(4096) + 0.5) / 4096, rng.random(4096)
    wo = np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1.0 - u)], -1)
    fractions = []
    for angle in np.minimum(table.theta_i, np.radians(89.9)):
        wi = np.broadcast_to([np.sin(angle), 0.0, np.cos(angle)], wo.shape)
        fractions.append(float(np.mean(table.rgb(wo, wi) @ colours.LUMINANCE) * np.pi / np.cos(angle)))
    return fractions
