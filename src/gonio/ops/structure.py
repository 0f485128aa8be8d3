"""Nested structures of recorded values: tuples, lists, dicts, and objects such as materials.

`kind` is the class of the values, such as `graph.Node`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, TypeGuard

from .types import Value


class Composite(Protocol):
    """An object whose fields a recording treats as separate values, such as a material."""

    def __parts__(self) -> Mapping[str, object]:
        """The parts that may contain values, by name."""

    def __with_parts__(self, parts: Mapping[str, object]) -> object:
        """A copy with these parts replaced."""


def is_composite(value: object) -> TypeGuard[Composite]:
    # called for every local variable and every new value: isinstance with a Protocol took 80 % of the time of `emit`
    return hasattr(type(value), "__parts__")


def flatten(value: object, name: str, kind: type[Any]) -> Iterator[tuple[str, Value]]:
    """The values inside an argument (value, tuple, list, dict, object with fields), each with its path."""
    if isinstance(value, kind):
        yield name, value
    elif isinstance(value, tuple | list):
        fields = getattr(value, "_fields", None) or [str(i) for i in range(len(value))]
        for field, item in zip(fields, value, strict=True):
            yield from flatten(item, f"{name}.{field}", kind)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from flatten(item, f"{name}.{key}", kind)
    elif is_composite(value):
        for part, held in value.__parts__().items():
            yield from flatten(held, f"{name}.{part}", kind)


def rebuild(value: Value, replace: Callable[[Value], object], kind: type | tuple[type, ...]) -> Value:
    """The same structure with each value of the kind replaced."""
    if isinstance(value, kind):
        return replace(value)
    if isinstance(value, tuple | list):
        items = [rebuild(item, replace, kind) for item in value]
        return type(value)(*items) if hasattr(value, "_fields") else type(value)(items)
    if isinstance(value, dict):
        return {key: rebuild(item, replace, kind) for key, item in value.items()}
    if is_composite(value):
        return value.__with_parts__({name: rebuild(part, replace, kind) for name, part in value.__parts__().items()})
    return value


def static_key(value: Value, kind: type[Any]) -> object:
    """The parts of an argument, besides values, that determine the recording: names, flags, classes, plain numbers."""
    if isinstance(value, kind):
        return value.type
    if isinstance(value, tuple | list):
        return tuple(static_key(item, kind) for item in value)
    if isinstance(value, dict):
        return tuple((key, static_key(item, kind)) for key, item in value.items())
    if is_composite(value):
        return (type(value), *((name, static_key(part, kind)) for name, part in value.__parts__().items()))
    try:
        hash(value)
    except TypeError:
        return id(value)
    # with the type, because True, 1 and 1.0 are equal keys; repr distinguishes 0.0 from -0.0
    return (type(value), repr(value) if isinstance(value, float) else value)


def leaves(value: Value) -> Iterator[Value]:
    """The innermost items of nested tuples and dicts."""
    if isinstance(value, tuple | dict):
        for item in value.values() if isinstance(value, dict) else value:
            yield from leaves(item)
    else:
        yield value
