"""`go.material`: a material from anything that names, describes or is one. Every public function accepts the same."""

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
    """An object of a user's class with `eval(wo, wi)` that is not derived from `BSDF`."""

    eval: Any


# a text or a file, a description as in JSON, a class, or a material itself
MaterialLike: TypeAlias = "BSDF | str | Path | Mapping[str, Any] | type[Any] | HasEval"


def material(given: MaterialLike, fit: str = "", **parameters: Value) -> BSDF:
    """A material from a string, a file, a description, a class or an instance.

        go.material("conductor(preset=Au)", alpha=0.2)      # as on the command line; also "lambert+ggx"
        go.material("alum-bronze", fit="low2012/lowsmooth_E2")
        go.material("gold.json", k=0)                       # the result of a fit, a file of another program, ...
        go.material({"type": "conductor", "preset": "Au"})  # as in JSON
        go.material("ward.py:Ward"), go.material(Ward), go.material(Ward(alpha=0.1))

    given       a string: a model, NAME(parameter=value,...), a sum, FILE.py:CLASS, a name of the library
                (`materials()` lists them; also NAME:FILE/FIT), or a file that describes materials, of another program
                or the result of a fit ("gold.json"), followed by :NAME if it contains several; a path; a dictionary
                with a "type"; a class, Gonio's or your own with `eval(wo, wi)`, which gets its default values (an inner
                material without a default is metal of alpha 0.3); or an instance
    fit         FILE/FIT of a library material; "" selects Bagher2012's
    parameters  values that override its own: `alpha=0.2`, `preset="Au"`, `**{"base.alpha": 0.2}`; a name that only one
                inner material has needs no path
    Raises InputError, with the closest known name, for an unknown name or a fit that the paper does not have, for a
    file that cannot be read, and for a value of any other type. A GonioWarning names features of a file that Gonio's
    materials lack.
    """
    if fit and not isinstance(given, str):
        raise InputError(f"fit '{fit}' given with a {type(given).__name__}", "material: fit", "give a name with it")
    if isinstance(given, BSDF):
        return notation.changed(given, parameters) if parameters else given
    cls, own = _class_and_values(f"{given}:{fit}" if fit else given)
    return outside.probe(notation.made(cls, {**own, **parameters})[0])


def title_of(given: MaterialLike) -> str:
    """A short name for titles: a string itself, any other material in the notation of the command line."""
    return str(given) if isinstance(given, str | Path) else notation.written(material(given))


def is_material(value: object) -> bool:
    """Whether a value other than a string or a path is accepted by `material`."""
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
