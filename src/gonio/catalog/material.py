"""`go.material`: a material from a name, a file, a description, a class or an instance, as in all public functions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from ..arguments import shown
from ..errors import InputError
from ..material import BSDF
from ..material.parameters import Value
from . import notation, outside, texts


class HasEval(Protocol):
    """An object of a user's class that has `eval(wo, wi)` but does not derive from `BSDF`."""

    eval: Any


# a string, a file, a description as in JSON, a class, or a material
MaterialLike: TypeAlias = "BSDF | str | Path | Mapping[str, Any] | type[Any] | HasEval"


def material(given: MaterialLike, fit: str = "", **parameters: Value) -> BSDF:
    """A material from a string, a file, a description, a class or an instance.

        go.material("conductor(preset=Au)", alpha=0.2)      # as on the command line; also "lambert+ggx"
        go.material("alum-bronze", fit="low2012/lowsmooth_E2")
        go.material("gold.json", k=0)                       # the result of a fit, or a file of another program
        go.material({"type": "conductor", "preset": "Au"})  # as in JSON
        go.material("ward.py:Ward"), go.material(Ward), go.material(Ward(alpha=0.1))

    given       a string, which may be the name of a model, NAME(parameter=value,...), a sum, FILE.py:CLASS, or a
                material of the library (`materials()` lists them), also in the form NAME:FILE/FIT; a file of another
                program or the result of a fit ("gold.json"), as a string or a path, followed by :NAME if it contains
                several materials; a dictionary with a "type"; a class, one of Gonio's or your own with `eval(wo, wi)`,
                whose parameters have their default values (a nested material without a default is a metal with
                alpha = 0.3); or an instance
    fit         name FILE/FIT of a published fit of a library material; "" selects that of Bagher2012
    parameters  parameters to override: `alpha=0.2`, `preset="Au"`, `**{"base.alpha": 0.2}`. A parameter that only one
                nested material has can be given without its path
    Raises InputError for an unknown name or fit, with the closest known name, for a file that cannot be read, and for a
    value of another type. A GonioWarning names features of a file that Gonio's materials do not support.
    """
    if fit and not isinstance(given, str):
        raise InputError(f"fit '{fit}' given with a {type(given).__name__}", "material: fit", "give a name with it")
    if isinstance(given, BSDF):
        return notation.changed(given, parameters) if parameters else given
    cls, own = _class_and_values(f"{given}:{fit}" if fit else given)
    return outside.probe(notation.made(cls, {**own, **parameters})[0])


def title_of(given: MaterialLike) -> str:
    """A short name for titles: a string is returned unchanged; other materials are written in the notation."""
    return str(given) if isinstance(given, str | Path) else notation.written(material(given))


def is_material(value: object) -> bool:
    """Whether `material` accepts a value that is neither a string nor a path."""
    return isinstance(value, BSDF | Mapping) or callable(getattr(value, "eval", None))


def _class_and_values(given: object) -> notation.Settings:
    if isinstance(given, str | Path):
        return texts.taken_apart(str(given), "material")
    if isinstance(given, Mapping):
        return texts.apart(given, "material")
    if isinstance(given, type):
        return outside.as_material(given), {}
    if callable(getattr(given, "eval", None)):
        return outside.adopt(given), {}
    hint = "a string such as 'conductor(preset=Au)', a file, a dictionary with a \"type\", a class or an instance"
    raise InputError(f"{shown(given)} given, a material expected", "material", hint)
