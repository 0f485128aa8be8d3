"""The variations of a study: paths with their values, from the command line or from Python, and the request of each
picture."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..catalog import notation, texts
from ..errors import InputError
from ..render.request import Request
from ..scene.schema import SceneDescription
from . import figures

_RANGE = re.compile(r"[-+\d.eE]*\d\.\.[-+\d.eE]+")  # a range of numbers; file paths may contain two dots too


@dataclass(frozen=True)
class Variation:
    """The content of one --vary: a path in the scene or in a material, or a $parameter of a Mitsuba XML file, and its
    values.

    path    one path, or several paths that vary together, separated by commas: "kd,ks"
    values  one value per picture; for several paths, each value is a tuple with one entry per path
    """

    path: str
    values: tuple[object, ...]

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path.strip() for path in self.path.split(","))

    @property
    def name(self) -> str:
        """The last non-numeric step of each path: "p" of "scene.shapes.0.material.p", "eta[0]" of "...eta.0"."""
        return ", ".join(map(_last_word, self.paths))

    def settings(self, value: Any) -> dict[str, object]:
        """The settings that a value of the variation represents, by path."""
        return dict(zip(self.paths, value if len(self.paths) > 1 else (value,), strict=True))


def _last_word(path: str) -> str:
    steps = [step for step in path.replace("/", ".").split(".") if step]
    for back, step in enumerate(reversed(steps)):
        if not step.isdecimal() and step != "*":
            return step + "".join(f"[{index}]" for index in steps[len(steps) - back :])
    return path


def parse_variation(text: str) -> Variation:
    """A `Variation` from "shapes.0.material.p=4,16,64" or, with several paths, from "kd,ks=(0.2,0.8),(0.5,0.5)".

    Values are JSON; commas in brackets do not separate values. "0.1..1" is a range of five values.
    """
    paths, values = notation.assignment(text, "--vary")
    if _RANGE.fullmatch(values):
        return variation(paths, [figures.parse_value(value) for value in texts.range_of(values)])
    return variation(paths, figures.split_values(values))


def variation(paths: str | Sequence[str], values: Sequence[object]) -> Variation:
    """A `Variation` of one path, or of several paths that vary together, "kd,ks" or ("kd", "ks"). In the latter case,
    each value has one component per path, (0.2, 0.8) or "(0.2,0.8)". Raises InputError for another number of
    components."""
    names = tuple(path.strip() for path in (paths.split(",") if isinstance(paths, str) else paths))
    if not all(names) or len(set(names)) < len(names):
        what, hint = f"'{','.join(names)}' varies no path, or one twice", "such as kd,ks=(0.2,0.8),(0.5,0.5)"
        raise InputError(what, "--vary", hint)
    if len(names) == 1:
        return Variation(names[0], tuple(values))
    return Variation(",".join(names), tuple(_together(value, names) for value in values))


def _together(value: object, names: Sequence[str]) -> tuple[object, ...]:
    """The values of several paths that vary together."""
    parts: Sequence[object] | None = None
    if isinstance(value, str) and value.startswith("(") and value.endswith(")"):
        parts = figures.split_values(value[1:-1])
    elif isinstance(value, list | tuple):
        parts = value
    if parts is None or len(parts) != len(names):
        count = "one value" if parts is None else f"{len(parts)} value{'s' if len(parts) != 1 else ''}"
        what = f"'{value}' is {count}, {len(names)} expected"
        hint = f"in parentheses, one for each: {','.join(names)}=({','.join('0.5' for _ in names)}),..."
        raise InputError(f"{what} for {', '.join(names)}", "--vary", hint)
    return tuple(parts)


def with_cell(request: Request, cell: Mapping[str, object], named: notation.Settings | None) -> Request:
    """The request with the values of one cell, which are values of the scene, or of a material and of the scene that
    shows it."""
    if named is None:
        return replace(request, overrides={**request.overrides, **cell})
    cls, given = named
    own: dict[str, object] = {}
    of_scene: dict[str, object] = {}
    for path, value in cell.items():
        inside = path.removeprefix("scene.").removeprefix("shapes.0.material.")
        first = path.lstrip("/").replace("/", ".").partition(".")[0]
        if inside == path and first in _OF_A_SCENE and first not in cls.parameters():
            of_scene[path] = value
        else:
            own[inside] = value
    try:
        material = notation.build((cls, {**given, **own}))
    except InputError as error:
        option, _, path = error.where.partition(" ")
        raise InputError(
            error.what, f"--vary {path}" if option == "--param" and path in own else error.where, error.hint
        ) from None
    return replace(request, material=material, overrides={**request.overrides, **of_scene})


# first steps of paths into the scene around a material
_OF_A_SCENE = {field.alias or name for name, field in SceneDescription.model_fields.items()} | {"shapes", "lights"}
