"""From what the user names to subjects: a model, a class in a file, a Mitsuba plugin, a Mitsuba file, a measurement.

conductor                a model's name; a material in it is a name again: --param a=lambert
glass.py:Glass           a class in a Python file, which runs because the user named it
mitsuba:roughplastic     a plugin, Mitsuba's or the user's, with its properties as parameters
plastic.xml, .json       a Mitsuba description; also as text: '{"type": "plastic"}'
leather.bsdf             a measured material in the RGL's format
"""

from __future__ import annotations

import importlib.util
import inspect
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from ..models import BSDF, notation
from . import subject as subjects
from .subject import Subject

STEPS = 5  # of a sweep


def resolve(target: str, settings: Sequence[str] = (), sweep: str = "") -> list[Subject]:
    """The subjects that a target names, one for each value of the sweep.

    settings  "name=value" each
    sweep     "name=low..high" (5 values, geometric where the range spans ten or more), or "name=v1,v2,..."
    Raises InputError with the nearest known spelling.
    """
    given = dict(map(notation.assignment, settings))
    if not sweep:
        return [_build(target, given)]
    name, values = _sweep(sweep)
    return [_build(target, {**given, name: value}) for value in values]


def _sweep(text: str) -> tuple[str, list[str]]:
    name, value = notation.assignment(text, "--sweep")
    ends = re.fullmatch(r"(.+?)\.\.(.+)", value)
    if not ends:
        return name, value.split(",")
    try:
        low, high = float(ends[1]), float(ends[2])
    except ValueError:
        raise InputError(f"'{value}' is no range", "--sweep", "such as --sweep alpha=0.01..1") from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise InputError(f"'{value}' is no rising range", "--sweep", "such as --sweep alpha=0.01..1")
    many = np.geomspace(low, high, STEPS) if low > 0.0 and high >= 10.0 * low else np.linspace(low, high, STEPS)
    return name, [f"{v:.6g}" for v in many]


def _build(target: str, given: dict[str, str]) -> Subject:
    path, _, name = target.rpartition(":")
    if target.startswith("mitsuba:"):
        from ..render import foreign

        values = {key: _property(value) for key, value in given.items()}
        return Subject(foreign.plugin(target.removeprefix("mitsuba:"), values), target, values)
    if path.endswith(".py"):
        bsdf, values = notation.made(_class_in(Path(path), name), given)
        return Subject(bsdf, target, values)
    if target.endswith(".py"):
        raise InputError(f"'{target}' names a file, but no class in it", "TARGET", f"give {target}:CLASS")
    if target.lstrip().startswith("{") or target.lower().endswith((".json", ".xml", ".bsdf")):
        return _from_file(target, given)
    if Path(target).suffix in (".binary", ".merl", ".csv", ".txt") or Path(target).is_file():
        hint = "measurements in the RGL's .bsdf format can be verified"
        raise InputError(f"'{target}' is in no format that can be verified", "TARGET", hint)
    if ":" in target.partition("(")[0]:
        raise InputError(f"'{target}' is no target", "TARGET", "give MODEL, FILE.py:CLASS or mitsuba:PLUGIN")
    cls, own = notation.taken_apart(target)
    bsdf, values = notation.made(cls, {**own, **given})
    return Subject(bsdf, cls.name, values)


# --------------------------------------------------------------------------- the user's own


def _class_in(path: Path, name: str) -> type[BSDF]:
    """The class of a Python file, which is run."""
    if not path.is_file():
        raise InputError(f"no file '{path}'", "TARGET")
    spec = importlib.util.spec_from_file_location(f"gonio_target_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except GeneratorExit:
        raise
    except BaseException as error:
        line = subjects._line(None, error) if isinstance(error, Exception) else ""
        raise InputError(f"{type(error).__name__}: {error}", f"{path} {line}".strip(), "the file must run") from None
    found = getattr(module, name, None)
    if not isinstance(found, type):
        classes = [n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__]
        raise InputError(
            f"no class '{name}' in it", str(path), did_you_mean(name, classes) if classes else "it has none"
        )
    if isinstance(found, type) and issubclass(found, BSDF):
        if found.eval is BSDF.eval:
            raise InputError(f"{name} has no eval", str(path), "write eval(self, wo, wi): f |cos theta_i|")
        return found
    return adopt(found, str(path))


def adopt(cls: type, where: str = "") -> type[BSDF]:
    """A class that is no gonio.BSDF but has `eval`, as one: `pdf` and `sample` fall back to cosine sampling."""
    if not callable(getattr(cls, "eval", None)):
        raise InputError(f"{cls.__name__} has no eval", where, "write eval(self, wo, wi): f |cos theta_i|")
    try:
        inner = cls()
    except Exception as error:
        raise InputError(f"{cls.__name__}() fails: {type(error).__name__}: {error}", where, "give defaults") from None
    methods: dict[str, Any] = {}
    for name in ("eval", "pdf", "sample"):
        if callable(getattr(cls, name, None)):
            methods[name] = _forward(inner, name)
    for name in ("transmits", "isotropic", "delta", "stochastic", "breaks", "lossless"):
        if hasattr(cls, name):
            methods[name] = getattr(inner, name)
    namespace = {**methods, "__doc__": cls.__doc__, "__module__": cls.__module__, "__annotations__": {}}
    return type(cls.__name__, (BSDF,), namespace)


def _forward(inner: Any, name: str) -> Any:
    method = getattr(inner, name)
    takes_mode = "mode" in inspect.signature(method).parameters
    if name == "pdf":

        def pdf(self: Any, wo: Any, wi: Any) -> Any:
            return method(wo, wi)

        return pdf

    def forwarded(self: Any, wo: Any, other: Any, mode: str = "radiance") -> Any:
        return method(wo, other, mode) if takes_mode else method(wo, other)

    return forwarded


# --------------------------------------------------------------------------- Mitsuba's


def _property(text: str) -> Any:
    """A plugin's property from the command line: number, true or false, colour, or a name."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return text
    return numbers[0] if len(numbers) == 1 else {"type": "rgb", "value": numbers}


def _from_file(target: str, given: dict[str, str]) -> Subject:
    from ..render import foreign

    values = {key: _property(value) for key, value in given.items()}
    path = Path(target)
    if not target.lstrip().startswith("{"):
        if not path.is_file():
            raise InputError(f"no file '{target}'", "TARGET")
        if path.suffix.lower() == ".bsdf":
            return Subject(foreign.load({"type": "measured", "filename": str(path), **values}), target, values)
        if path.suffix.lower() == ".xml":
            if values:
                raise InputError("parameters of an XML file cannot be set", "--param", "change the file")
            return Subject(foreign.load_file(path), target)
        text = path.read_text(encoding="utf-8")
    else:
        text = target
    try:
        description = json.loads(text)
    except ValueError as error:
        raise InputError(f"no JSON: {error}", target) from None
    if not isinstance(description, dict) or "type" not in description:
        raise InputError('an object with a "type" expected', target, 'such as {"type": "roughplastic", "alpha": 0.2}')
    return Subject(foreign.load({**description, **values}), target, values)


__all__ = ["adopt", "resolve"]
