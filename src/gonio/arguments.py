"""Check the arguments of public functions against their annotations.

    @checked
    def bake(target: str | Path, size: int = 128, aspect: float | None = None): ...

    bake("ggx", size="4")      # InputError: size: '4' given, a whole number expected

The supported annotations are None, bool, int, float, str, Path, BSDF, ArrayLike, and tuple, Sequence and Mapping of
these. Arguments with other annotations are not checked. Integers, NumPy's included, are converted to `int`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import operator
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import ParamSpec, TypeAlias, TypeVar

from .errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
# returns the converted value; raises ValueError if it is wrong
Check: TypeAlias = Callable[[object], object]

_SHOWN = 60  # characters of an invalid value that an error message shows


def checked(call: Callable[P, R]) -> Callable[P, R]:
    """Wrap a function so that it raises InputError for an argument that does not match its annotation."""
    signature = inspect.signature(call)
    kinds = {name: _check_of(str(p.annotation)) for name, p in signature.parameters.items()}
    several = {name for name, p in signature.parameters.items() if p.kind == p.VAR_POSITIONAL}

    @functools.wraps(call)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = signature.bind(*args, **kwargs)
        for name, value in bound.arguments.items():
            check = kinds[name]
            if check is None:
                continue
            try:
                bound.arguments[name] = tuple(map(check, value)) if name in several else check(value)
            except ValueError as error:
                raise InputError(f"{shown(value)} given, {error} expected", f"{call.__name__}: {name}") from None
        return call(*bound.args, **bound.kwargs)

    return guarded


def takes_fields(options: type | tuple[type, ...], keywords: type) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function with `**options` accept the fields of one or more dataclasses that are not among its own
    parameters: its signature is expanded with the fields and their defaults, for `help`, notebooks and `checked`.

    keywords  a TypedDict that repeats the types of the fields for type checkers, which cannot derive them from a class
    """

    def decorate(call: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(call)
        own = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        annotations = inspect.get_annotations(keywords)
        for base in getattr(keywords, "__orig_bases__", ()):
            annotations = {**getattr(base, "__annotations__", {}), **annotations}
        types = {name: getattr(one, "__forward_arg__", one) for name, one in annotations.items()}
        fields = [
            inspect.Parameter(
                field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=types[field.name]
            )
            for one in (options if isinstance(options, tuple) else (options,))
            for field in dataclasses.fields(one)
            if field.name not in signature.parameters
        ]
        call.__signature__ = signature.replace(parameters=[*own, *fields])  # type: ignore[attr-defined]
        return call

    return decorate


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function accept former names of its keyword arguments: `@renamed(former="present")`.

    A former name causes a DeprecationWarning.
    """

    def decorate(call: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(call)
        def translated(*args: P.args, **kwargs: P.kwargs) -> R:
            for former, present in names.items():
                if former in kwargs:
                    if present in kwargs:
                        raise InputError(f"both {former} and {present} given", call.__name__, f"give only {present}")
                    text = f"{call.__name__}: {former} is now {present}"
                    warnings.warn(text, DeprecationWarning, stacklevel=2)
                    kwargs[present] = kwargs.pop(former)
            return call(*args, **kwargs)

        return translated

    return decorate


def shown(value: object) -> str:
    """The `repr` of a value on one line, shortened for an error message."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


# ---------------------------------------------------------------------- checks of single values


def integer(value: object) -> int:
    """Convert a Python or NumPy integer to `int`; booleans are rejected."""
    import numpy as np  # imported in functions because `gonio --help` loads this file but does not need NumPy

    if isinstance(value, bool | np.bool_):
        raise ValueError
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError from None


def number(value: object) -> object:
    """Return a scalar number unchanged; NaN and strings are rejected."""
    import numpy as np

    if isinstance(value, bool | np.bool_ | str | bytes) or np.ndim(value) != 0:  # type: ignore[arg-type]
        raise ValueError
    try:
        if math.isnan(float(value)):  # type: ignore[arg-type]
            raise ValueError
    except (TypeError, OverflowError):
        raise ValueError from None
    return value


def _flag(value: object) -> bool:
    import numpy as np

    if not isinstance(value, bool | np.bool_):
        raise ValueError
    return bool(value)


def _text(value: object) -> object:
    if not isinstance(value, str) or "\0" in value:
        raise ValueError
    return value


def _nothing(value: object) -> None:
    if value is not None:
        raise ValueError


def _array(value: object) -> object:
    import numpy as np

    try:
        array = np.asarray(value)
    except (TypeError, ValueError):  # ragged
        raise ValueError from None
    if array.dtype.kind not in "fiub":
        raise ValueError
    return value


def _mapping(value: object) -> object:
    if not isinstance(value, Mapping):
        raise ValueError
    return value


def _callable(value: object) -> object:
    if not callable(value):
        raise ValueError
    return value


def _of_class(name: str) -> Check:
    def check(value: object) -> object:
        if not any(cls.__name__ == name for cls in type(value).__mro__) or (name == "Path" and "\0" in str(value)):
            raise ValueError
        return value

    return check


_KINDS: dict[str, tuple[Check, str]] = {
    "None": (_nothing, ""),
    "bool": (_flag, "True or False"),
    "int": (integer, "a whole number"),
    "float": (number, "a number"),
    "str": (_text, "a string"),
    "Path": (_of_class("Path"), "a path"),
    "BSDF": (_of_class("BSDF"), "a material"),
    "ArrayLike": (_array, "an array of numbers"),
    "Floats": (_array, "an array of numbers"),
}


@functools.cache
def _check_of(annotation: str) -> Check | None:
    """The check for an annotation; None if the annotation is not supported."""
    options = []
    for part in _alternatives(annotation):
        option = _one(part)
        if option is None:
            return None
        options.append(option)
    expected = " or ".join(words for _, words in options if words)

    def check(value: object) -> object:
        for option, _ in options:
            try:
                return option(value)
            except ValueError:
                continue
        raise ValueError(expected)

    return check


def _alternatives(annotation: str) -> list[str]:
    """The alternatives of an annotation: split at each `|` outside brackets."""
    parts, depth = [""], 0
    for letter in annotation:
        depth += (letter == "[") - (letter == "]")
        if letter == "|" and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def _one(name: str) -> tuple[Check, str] | None:
    if name in _KINDS:
        return _KINDS[name]
    if name.startswith("Callable["):
        return _callable, "a function"
    match = re.fullmatch(r"(Mapping|Sequence|list|tuple)\[(.*)\]", name)
    if match is None:
        return None
    if match[1] == "Mapping":
        return _mapping, "a dictionary"
    parts = [part.strip() for part in match[2].split(",") if part.strip() != "..."]
    inner = _check_of(parts[0])
    if inner is None or len(set(parts)) > 1:
        return None
    count = len(parts) if match[1] == "tuple" and "..." not in match[2] else None

    def check(value: object) -> object:
        import numpy as np

        if isinstance(value, str | bytes) or not isinstance(value, Sequence | np.ndarray):
            raise ValueError
        if count is not None and len(value) != count:
            raise ValueError
        items = [inner(item) for item in value]
        return tuple(items) if count is not None else items

    words = {"int": "whole numbers", "float": "numbers", "str": "strings"}.get(parts[0], "such values")
    return check, f"{count} {words}" if count is not None else f"several {words}"
