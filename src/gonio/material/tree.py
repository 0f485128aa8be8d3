"""A material is a tree, as parameters may hold materials: how to walk it, read it by path, and change it.

    for path, parameter, value, owner in leaves(material): ...      "alpha", "base.alpha", "base.a.albedo"
    rougher = replace(material, {"base.alpha": 0.4})

Works on materials as they were made and on bound ones alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, NamedTuple, TypeVar

from ..errors import InputError, did_you_mean
from .parameters import Material, Parameter, Value

M = TypeVar("M", bound=Material)


class Leaf(NamedTuple, Generic[M]):
    """A parameter in a tree of materials.

    path       "alpha", "base.alpha"
    parameter  its declaration
    value      what it holds
    owner      the material that has it
    """

    path: str
    parameter: Parameter
    value: Value
    owner: M


MAX_MATERIALS = 64  # materials in a tree: its formula then takes about a second to compile


def count(material: Material) -> int:
    """How many materials a tree holds, itself among them. InputError where these are more than MOST."""
    total = 1 + sum(inner._count for inner in children(material).values())
    if total > MAX_MATERIALS:
        what = f"{total} materials inside each other, {MAX_MATERIALS} at most are expected"
        raise InputError(what, type(material).__name__, "mix fewer materials")
    return total


def children(material: M) -> dict[str, M]:
    """The materials that a material holds, by the parameter's name."""
    return {name: getattr(material, name) for name, p in material.parameters().items() if p.inner}


def walk(material: M, path: str = "") -> Iterator[tuple[str, M]]:
    """Every material in the tree with its path, itself ("") first: "base", "base.a"."""
    yield path, material
    for name, inner in children(material).items():
        yield from walk(inner, join(path, name))


def leaves(material: M, path: str = "") -> Iterator[Leaf[M]]:
    """Every parameter that holds no material, here and in inner materials, in order of declaration."""
    for name, parameter in material.parameters().items():
        value = getattr(material, name)
        if parameter.inner:
            yield from leaves(value, join(path, name))
        else:
            yield Leaf(join(path, name), parameter, value, material)


def surface(material: M) -> Iterator[Leaf[M]]:
    """Those of `leaves` that the surface depends on."""
    return (leaf for leaf in leaves(material) if not leaf.parameter.inside)


def join(path: str, name: str) -> str:
    """The path of a parameter of the material at a path."""
    return f"{path}.{name}" if path else name


def value_at(material: Material, path: str) -> Value:
    """What stands at a path; InputError where there is nothing."""
    value: Value = material
    for name in path.split("."):
        value = getattr(value, _known(value, name, path))
    return value


def replace(material: M, values: Mapping[str, object], location: str = "replace") -> M:
    """The material with other values, or other inner materials, at some paths; InputError for what cannot be."""
    own: dict[str, Value] = {}
    below: dict[str, dict[str, object]] = {}
    for path, value in values.items():
        name, _, rest = path.partition(".")
        _known(material, name, location)
        if rest:
            below.setdefault(name, {})[rest] = value
        else:
            own[name] = value
    for name, inner in below.items():
        own[name] = replace(own.get(name, getattr(material, name)), inner, join(location, name))
    return rebuild(material, own)


def rebuild(material: M, values: Mapping[str, object]) -> M:
    """The material made anew, and so checked, with other values of its own parameters."""
    return type(material)(**{**{name: getattr(material, name) for name in material.parameters()}, **values})


def map_leaves(material: M, change: Callable[[Parameter, object], object]) -> M:
    """The material made anew with what `change(parameter, value)` makes of every leaf."""
    values = {
        name: map_leaves(getattr(material, name), change) if p.inner else change(p, getattr(material, name))
        for name, p in material.parameters().items()
    }
    return rebuild(material, values)


def _known(material: Material, name: str, location: str) -> str:
    known = material.parameters() if isinstance(material, Material) else {}
    if name not in known:
        what = f"{type(material).__name__} has no parameter '{name}'"
        raise InputError(what, location, did_you_mean(name, list(known)) if known else "")
    return name


def rebuild_from(cls: type[M], values: Mapping[str, object]) -> M:
    """A material of a class and its values: how a pickled one comes back."""
    return cls(**values)
