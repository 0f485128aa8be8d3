"""The model with which values of f are compared: the requested model, with the parameters stated in the file itself.

    # model: oren-nayar(sigma=0.5)      a comment in the file
    # up: y

On the command line, the user's settings take precedence over this line. In a folder, the sheet prescribes the model and
its terms (distribution, masking, kind of Fresnel term), and only numbers are taken from the line: a file must not
determine the model with which it is compared.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..catalog import notation, operands
from ..errors import GonioError, InputError
from ..material import BSDF, tree
from ..material.parameters import ChoiceParameter
from ..measure.formats import rows
from .mistakes import f_of

_SAMPLING = "sampling"  # a choice that does not change f
_EDGE = "edge"  # a parameter of `metal` that, unlike other numbers, changes the formula of F


@dataclass(frozen=True)
class Asked:
    """The material with which values are compared.

    remark    a statement of the source of its parameters; "" if the user specified it completely
    defaults  whether neither the user nor the file specified parameters, so that other parameters are possible
    """

    material: BSDF
    remark: str = ""
    defaults: bool = False


class Line(NamedTuple):
    """The model specified by the line `# model:`: its class, and its settings by parameter name."""

    cls: type[BSDF]
    settings: dict[str, object]


class AnotherModelError(InputError):
    """A file specifies a different model, or different terms, than the sheet prescribes."""


def comments(path: Path) -> dict[str, str]:
    """The values of "model" and "up" in the file's comments, if any; empty for a file that cannot be read."""
    try:
        return rows.comments(path.read_bytes())
    except OSError:
        return {}


def for_command(path: Path, against: str | BSDF | None) -> Asked:
    """The material of a command: `against`, with the settings of the file's line for parameters that the command omits,
    or else the material of the line. Raises InputError if neither specifies a material."""
    if isinstance(against, BSDF):
        return Asked(against)
    text = comments(path).get("model", "")
    if not against:
        if not text:
            hint = "such as: gonio check f.csv oren-nayar -p sigma=0.3, or a line '# model: oren-nayar(sigma=0.3)'"
            raise InputError("no model to compare with", "MODEL", hint)
        return Asked(
            notation.made(*_line(text, path.name))[0], f"compared with the material in the file's line: {text}"
        )
    operands.kind_of(against, operands.MATERIALS, "MODEL")
    cls, own = notation.taken_apart(against)
    line: Line | None = None
    with contextlib.suppress(InputError):
        line = _line(text, path.name) if text else None
    if line is not None and line.cls is cls and line.settings:
        material = notation.build((cls, {**_without_preset(line, own), **own}))
        return Asked(material, f"with the parameters of the file's line: {text}")
    material = notation.build((cls, own))
    if text and (line is None or line.cls is not cls):
        return Asked(material, f"the file's line names {text}, but {cls.name} was requested", not own)
    return _with_defaults(material, own)


def for_task(path: Path, models: tuple[str, ...]) -> Asked:
    """The material of a task: its model and terms, with the parameters of the file's line.

    models  representations of the same material, the usual one first
    Raises AnotherModelError if the line specifies a different model or different terms, InputError if it cannot be
    interpreted.
    """
    text = comments(path).get("model", "")
    if not text:
        cls, own = notation.taken_apart(models[0])
        return _with_defaults(notation.build((cls, own)), {})
    line = _line(text, path.name)
    asked = next((one for one in map(notation.taken_apart, models) if one[0] is line.cls), None)
    if asked is None:
        name = notation.taken_apart(models[0])[0].name
        raise AnotherModelError(f"the file names {line.cls.name}, but the task is {name}", path.name)
    cls, own = asked
    wanted = notation.build((cls, own))
    given = notation.build((cls, {**_without_preset(Line(cls, own), line.settings), **line.settings}))
    material = tree.replace(given, _terms(wanted, given, path.name))
    return Asked(material, "with the parameters of its line '# model:'")


def degenerate(material: BSDF, wo: np.ndarray, wi: np.ndarray, accuracy: float) -> str:
    """The reason why values of a material cannot confirm its model: its parameters reduce it to a simpler one. The
    result is "" if they do not.

    accuracy  relative difference below which values count as equal
    """
    f = f_of(material, wo, wi)
    lit = f[f[:, 0] > 0.0]
    if type(material).name != "lambert" and len(lit) and np.all(np.ptp(lit, axis=0) <= accuracy * lit.max(axis=0)):
        return "with these parameters f is constant, as Lambert's"
    simpler = {f"{path} alone": inner for path, inner in tree.walk(material) if path}
    for path, inner in tree.walk(material):
        fresnel = type(inner).parameters().get("fresnel")
        if isinstance(fresnel, ChoiceParameter) and "one" in fresnel.choices:
            simpler["F = 1"] = tree.replace(material, {tree.join(path, "fresnel"): "one"})
    for words, other in simpler.items():
        if np.allclose(f_of(other, wo, wi), f, rtol=accuracy, atol=0.0):
            return f"with these parameters the values are those of {words}"
    return ""


def _line(text: str, where: str) -> Line:
    """The model of a line. Raises InputError for code, which must not be run from a file, and for an unknown
    material."""
    if ".py" in text.lower():
        raise InputError(f"'{text}' is code, which is not run from a file", where, "name a model of Gonio's")
    try:
        return Line(*notation.taken_apart(text, where))
    except GonioError as error:
        raise InputError(f"its line '# model:' cannot be used: {error.what}", where, error.hint) from None


def _without_preset(line: Line, own: Mapping[str, object]) -> dict[str, object]:
    """The settings of a line, without those that are set by the preset in `own`."""
    preset = line.cls.presets().get(str(own.get("preset", "")))
    hidden = set(preset.values) if preset is not None else set()
    return {name: value for name, value in line.settings.items() if name not in hidden}


def _terms(wanted: BSDF, given: BSDF, where: str) -> dict[str, object]:
    """The choices of the wanted material, by path. Raises AnotherModelError if the given material has different choices
    or inner materials. A default of an inner material does not count as a choice."""
    inside = dict(tree.walk(given))
    terms: dict[str, object] = {}
    for path, inner in tree.walk(wanted):
        other = inside.get(path)
        if other is None or type(other) is not type(inner):
            has = "missing" if other is None else other.name
            what = f"{path} is {has}, but the task has {inner.name}"
            raise AnotherModelError(f"the file names another model: {what}", where)
        for name, parameter in type(inner).parameters().items():
            if not (isinstance(parameter, ChoiceParameter) or name == _EDGE) or name == _SAMPLING:
                continue
            asked, given_one = getattr(inner, name), getattr(other, name)
            if given_one != asked and (not path or given_one != parameter.default):
                raise AnotherModelError(f"the file names {name}={given_one}, but the task has {name}={asked}", where)
            terms[tree.join(path, name)] = asked
    return terms


def _with_defaults(material: BSDF, own: Mapping[str, object]) -> Asked:
    """A material that is not specified in the file. If the user gave no settings, the remark lists its parameters."""
    numbers = {
        name: getattr(material, name)
        for name, parameter in type(material).parameters().items()
        if parameter.kind in ("float", "spectrum", "alpha")
    }
    if own or not numbers:
        return Asked(material)
    name = type(material).name
    values = ", ".join(f"{key}={notation.written(value)}" for key, value in numbers.items())
    line = f"# model: {name}({next(iter(numbers))}=...)"
    return Asked(material, f"compared with {values}; a line '{line}' in the file, or -p, names others", True)
