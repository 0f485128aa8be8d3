"""The difference between two tables, and conversion to another format."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import files
from ..errors import InputError
from ..ops import backend
from . import format_of, read
from .formats.merl import Merl
from .tables.base import Floats, Measurement
from .tables.samples import Samples

PAIRS = 1 << 16
ROUNDS = 16
SURE = 0.03
GRAZING = 0.03  # smallest cosine of the view direction: within 1.7 degrees of the horizon, every format extrapolates


class Comparable(Protocol):
    """The interface that `difference` requires of the objects it compares."""

    @property
    def rgb(self) -> Callable[[Floats, Floats], Floats]: ...
    @property
    def draw(self) -> Callable[..., Any]: ...
    @property
    def pdf(self) -> Callable[..., Any]: ...


def difference(table: Comparable, other: Comparable, pairs: int = PAIRS, seed: int = 1) -> float:
    """The relative difference of two tables, E |other - table| / E |table|, where E is the mean of f cos theta_i.

    The mean is taken over the channels, over view directions with uniformly distributed cosines, and over all
    directions of light. A third each of the directions of light is sampled from the density of either table and from
    the cosine, and weighted by the inverse density of the mixture, so narrow lobes contribute according to their
    energy. Rounds of samples continue until the relative standard error of the result is below `SURE`, but at most for
    `ROUNDS` rounds; many are necessary if there is a spike where all three densities are low.

    pairs  pairs of directions per round
    seed   seed of the pairs
    """
    rng = np.random.default_rng([seed, 83])
    sums, squares, total = 0.0, 0.0, 0.0
    for _ in range(ROUNDS):
        off, size = _round(table, other, pairs, rng)
        sums, squares, total = sums + float(off.sum()), squares + float((off * off).sum()), total + float(size.sum())
        if squares <= (SURE * sums) ** 2 or not np.isfinite(sums):
            break
    return sums / total if total > 0.0 else 0.0


def _round(
    table: Comparable, other: Comparable, pairs: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """|other - table| and |table| at random pairs of directions, divided by the density of each pair."""
    types = backend.types("float64")
    mu, phi = rng.uniform(GRAZING, 1.0, pairs), rng.uniform(0.0, 2.0 * np.pi, pairs)
    sin = np.sqrt(1.0 - mu * mu)
    wo = np.stack([sin * np.cos(phi), sin * np.sin(phi), mu], -1)
    u = rng.random((pairs, 3))
    radius, turn = np.sqrt(u[:, 1]), 2.0 * np.pi * u[:, 2]
    wi = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - u[:, 1])], -1)
    third = np.arange(pairs) % 3
    for index, one in enumerate((table, other), 1):
        drawn, _ = one.draw(*(backend.vector_of(v[third == index], 3, types) for v in (wo, u)))
        wi[third == index] = backend.to_numpy(drawn, int((third == index).sum()))
    upper = wi[:, 2] > 1e-6
    wo, wi = wo[upper], wi[upper]
    density = wi[:, 2] / np.pi
    for one in (table, other):
        density = density + backend.to_numpy(
            one.pdf(backend.vector_of(wo, 3, types), backend.vector_of(wi, 3, types)), len(wo)
        )
    a, b = table.rgb(wo, wi), other.rgb(wo, wi)
    return np.abs(a - b).mean(axis=1) / density, np.abs(a).mean(axis=1) / density


@dataclass(frozen=True)
class Converted:
    """A table in another format.

    path         the file
    kind         kind of the table in the file
    resampled    whether the values were computed by evaluating the source; otherwise they were copied
    error        difference between the file and the source, see `difference`
    size         size of the file in bytes
    resolution   the part of the error due to the size of the cells: the difference between the file and the reciprocal
                 part of the source
    reciprocity  the part of the error due to a format that stores one value for a pair of directions and its swapped
                 pair: the difference between the reciprocal part and the source. The two parts of the error overlap
    measured     the directions at which the source is measured; "" if the file has values at no other directions
    """

    path: Path
    kind: str
    resampled: bool
    error: float
    size: int
    resolution: float = 0.0
    reciprocity: float = 0.0
    measured: str = ""

    def as_dict(self) -> dict[str, object]:
        return {**vars(self), "path": str(self.path), "output": str(self.path)}


class ReciprocalPart:
    """The reciprocal part of a table: a pair of directions and its swapped pair share one value of f.

    This value is the least-squares fit to both, as in `half_difference.sampled`.
    """

    def __init__(self, table: Measurement) -> None:
        self.draw, self.pdf, self._rgb = table.draw, table.pdf, table.rgb

    def rgb(self, wo: Floats, wi: Floats) -> Floats:
        o, i = wo[:, 2:], wi[:, 2:]
        return np.asarray((self._rgb(wo, wi) * i + self._rgb(wi, wo) * o) / (i * i + o * o) * i)


def convert(source: str | os.PathLike[str], output: str | os.PathLike[str], phi: int | None = None) -> Converted:
    """Convert a measurement file to another format, and measure the error of the written file.

    source  the file to convert, as for `read`
    output  the file to write; its suffix determines the format
    phi     number of cells along phi_d in a MERL file: 180, or 360 for nonreciprocal tables; None uses the default of
            `Merl.resampled`
    Raises InputError if the source cannot be read, or the format cannot be written.
    """
    table, path = read(source), Path(output)
    target = files.check_file(path)
    kind = format_of(path)
    if not kind.writes:
        raise InputError(f"{kind.name} files cannot be written", str(path), "choose another suffix, such as .gonio")
    if not table.isotropic and kind.writes not in (table.name, "any"):
        hint = ".bsdf and .gonio preserve the anisotropy"
        raise InputError(f"{kind.name} files hold isotropic materials, this one is anisotropic", str(path), hint)
    if phi is not None and (not isinstance(kind, Merl) or phi not in (180, 360)):
        raise InputError(f"{phi} given for a {kind.name} file", "phi", "180 or 360 cells of phi_d, for .binary files")
    resampled = kind.resampled(table, phi) if isinstance(kind, Merl) else kind.resampled(table)
    data = kind.write(resampled)
    made = kind.read(data, str(path))
    error, resolution, reciprocity = difference(table, made), 0.0, 0.0
    if resampled is not table and made.reciprocal and not table.reciprocal:
        even = ReciprocalPart(table)
        resolution, reciprocity = difference(even, made), difference(table, even)
    files.write_whole(target, data)
    known = _measured(table, made)
    return Converted(path, resampled.name, resampled is not table, error, len(data), resolution, reciprocity, known)


def _measured(table: Measurement, made: Measurement) -> str:
    """The directions at which a table is measured, if a table made from it also has values at other directions."""
    if isinstance(table, Samples) and not isinstance(made, Samples):
        return f"at {len(table.values)} pairs of directions"
    if made.angular_range.within(table.angular_range) != made.angular_range:
        return f"at {table.angular_range}"
    return ""


def _swapped(table: Measurement, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f for pairs of directions, and f for the same pairs swapped."""
    return table.rgb(wo, wi) / wi[:, 2:], table.rgb(wi, wo) / wo[:, 2:]


def asymmetry(table: Measurement, pairs: int = 1 << 14) -> float:
    """The deviation from reciprocity, E |f(wo, wi) - f(wi, wo)| / E |f|, where E is the mean over pairs of directions.

    Both directions are cosine-distributed. The result is 0 for a reciprocal table.
    """
    rng = np.random.default_rng([1, 84])
    u, v = rng.random((2, pairs)), rng.random((2, pairs)) * 2.0 * np.pi
    wo, wi = (
        np.stack([np.sqrt(a) * np.cos(b), np.sqrt(a) * np.sin(b), np.sqrt(1.0 - a)], -1)
        for a, b in zip(u, v, strict=True)
    )
    there, back = _swapped(table, wo, wi)
    return float(np.abs(there - back).mean() / max(float(np.abs(there).mean()), 1e-300))
