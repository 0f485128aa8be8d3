"""The base class of rough surfaces. A surface is a triangle mesh of one period, which repeats infinitely in x and y."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arguments import shown
from ...errors import InputError, did_you_mean
from ...members import Family, subclasses_of

Floats = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True)
class Patch:
    """One period of a surface, as a mesh of triangles that face upward.

    vertices  (N, 3). The period extends from -size / 2 to size / 2; geometry that crosses a boundary is repeated on the
              opposite side
    faces     (M, 3), indices of the vertices, counterclockwise as seen from above
    size      extent of the period, (x, y)
    top       upper bound of the heights
    """

    vertices: Floats
    faces: NDArray[np.uint32]
    size: tuple[float, float]
    top: float

    def __post_init__(self) -> None:
        points, faces = np.asarray(self.vertices), np.asarray(self.faces)
        fits = points.ndim == faces.ndim == 2 and points.shape[1] == faces.shape[1] == 3 and len(faces) > 0
        if not fits or faces.max() >= len(points) or not np.all(np.isfinite(points)) or not min(self.size) > 0.0:
            what = f"vertices {points.shape}, faces {faces.shape} and size {self.size}"
            raise InputError(f"{what} are not a patch", "Patch", "give finite vertices (N, 3), faces (M, 3)")


class Surface:
    """A kind of rough surface: a frozen dataclass of parameters, which `parameter` declares, with the method `patch`.

    name    name on the command line, as in "gaussian:alpha=0.3"
    random  whether `patch` uses random numbers; if so, several patches are measured, and the variation among them is
            part of the standard error
    """

    family: ClassVar[Family[type[Surface]]]
    name: ClassVar[str] = ""
    random: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type]  # each member is a dataclass
            if "low" in field.metadata:
                where = f"{self.name}.{field.name}"
                object.__setattr__(self, field.name, _in_range(getattr(self, field.name), field.metadata, where))

    def patch(self, rng: np.random.Generator) -> Patch:
        """One period of the surface. A random surface must take all random numbers from `rng`."""
        raise NotImplementedError

    def __str__(self) -> str:
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        given = [f"{one.name}={getattr(self, one.name)}" for one in fields if getattr(self, one.name) != one.default]
        return f"{self.name}({','.join(given)})" if given else self.name

    @classmethod
    def reads(cls, text: str) -> bool:
        """Whether a string names a file with a surface of this kind; its path is then the parameter `file`."""
        return False


Surface.family = Family(
    "surface", "gonio.surfaces", ["gonio.instruments.surfaces"], subclasses_of(Surface), where="--surface"
)


def parameter(default: T, doc: str, low: float, high: float, unit: str = "") -> T:
    """Declare a numeric parameter of a surface. It is an integer if the default is an integer; None is accepted too.

    doc        description of the parameter
    low, high  bounds of its range
    unit       unit of the parameter
    """
    about = {"doc": doc, "low": low, "high": high, "unit": unit, "whole": isinstance(default, int)}
    declared: T = dataclasses.field(default=default, metadata=about)
    return declared


def _in_range(value: object, about: Mapping[str, Any], where: str) -> object:
    if value is None:
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    kind = "a whole number" if about["whole"] else "a number"
    if not about["low"] <= number <= about["high"] or (about["whole"] and number != int(number)):
        unit = f" {about['unit']}" if about["unit"] else ""
        what = f"{shown(value)} given, {kind} from {about['low']:g} to {about['high']:g}{unit} expected"
        raise InputError(what, where, about["doc"])
    return int(number) if about["whole"] else number


def named(text: str, settings: dict[str, str]) -> Surface:
    """A surface from its name or file, with parameters given as strings.

    Raises InputError for unknown names, with the closest known name, and for values out of range.
    """
    reader = next((kind for kind in Surface.family.all().values() if kind.reads(text)), None)
    kind = reader or Surface.family.get(text, "--surface")
    known = {field.name: field for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    for name in settings:
        if name not in known or (reader and name == "file"):
            hint = did_you_mean(name, [one for one in known if one != "file"])
            raise InputError(f"{kind.name} has no parameter '{name}'", f"--param {name}", hint)
    given: dict[str, Any] = {**settings, **({"file": text} if reader else {})}
    missing = [name for name, field in known.items() if field.default is dataclasses.MISSING and name not in given]
    if missing:
        raise InputError(f"{kind.name} needs {missing[0]}", "--param", f"give --param {missing[0]}=...")
    return kind(**given)


def of_heights(heights: Floats, spacing: float = 1.0) -> Patch:
    """The mesh of a periodic surface through heights (y, x) on a square grid, with an additional square on each side.

    Each square is divided into two triangles. The diagonals alternate between neighboring squares, so no direction is
    preferred.
    """
    rows, columns = heights.shape
    y, x = np.arange(-1, rows + 2), np.arange(-1, columns + 2)
    z = heights[np.ix_(y % rows, x % columns)]
    grid = np.meshgrid((x - 0.5 * columns) * spacing, (y - 0.5 * rows) * spacing)
    vertices = np.stack([*grid, z], -1).reshape(-1, 3)
    index = np.arange(len(vertices), dtype=np.uint32).reshape(z.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    even = (np.add.outer(y[:-1], x[:-1]) % 2 == 0)[..., None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    faces = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    return Patch(vertices, faces, (columns * spacing, rows * spacing), float(heights.max()))
