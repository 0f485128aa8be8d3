"""Trees of materials, whose parameters may themselves be materials: traversal, access by path, and replacement.

    for path, parameter, value, owner in leaves(material): ...      "alpha", "base.alpha", "base.a.albedo"
    rougher = replace(material, {"base.alpha": 0.4})

All functions work on bound and unbound materials.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from ..errors import InputError, did_you_mean
from ..ops import backend
from .parameters import Material, Parameter, Value, pair_of

M = TypeVar("M", bound=Material)


class Leaf(NamedTuple, Generic[M]):
    """A parameter in a tree of materials.

    path       its path from the root: "alpha", "base.alpha"
    parameter  its declaration
    value      its value
    owner      the material to which it belongs
    """

    path: str
    parameter: Parameter
    value: Value
    owner: M


MAX_MATERIALS = 64  # materials in a tree: its formula then takes about a second to compile


def count(material: Material) -> int:
    """The number of materials in a tree, the root included. Raises InputError for more than `MAX_MATERIALS`."""
    total = 1 + sum(inner._count for inner in children(material).values())
    if total > MAX_MATERIALS:
        what = f"{total} nested materials, at most {MAX_MATERIALS} expected"
        raise InputError(what, type(material).__name__, "mix fewer materials")
    return total


def children(material: M) -> dict[str, M]:
    """The inner materials of a material, by parameter name."""
    return {name: getattr(material, name) for name, p in material.parameters().items() if p.inner}


def walk(material: M, path: str = "") -> Iterator[tuple[str, M]]:
    """Every material in the tree with its path, parents first: "", "base", "base.a".

    path  path of the material itself, which precedes the paths of inner materials
    """
    yield path, material
    for name, inner in children(material).items():
        yield from walk(inner, join(path, name))


def leaves(material: M, path: str = "") -> Iterator[Leaf[M]]:
    """Every parameter that does not hold a material, including those of inner materials, in order of declaration.

    path  path of the material itself, which precedes the paths of its parameters
    """
    for name, parameter in material.parameters().items():
        value = getattr(material, name)
        if parameter.inner:
            yield from leaves(value, join(path, name))
        else:
            yield Leaf(join(path, name), parameter, value, material)


def surface(material: M) -> Iterator[Leaf[M]]:
    """The `leaves` on which the formulas of the surface depend."""
    return (leaf for leaf in leaves(material) if not leaf.parameter.inside)


def join(path: str, name: str) -> str:
    """The path of a parameter, from the path of its material and its name."""
    return f"{path}.{name}" if path else name


def value_at(material: Material, path: str) -> Value:
    """The value of the parameter at a path. Raises InputError if there is no such parameter."""
    value: Value = material
    for name in path.split("."):
        value = getattr(value, _known(value, name, path))
    return value


def replace(material: M, values: Mapping[str, object], location: str = "replace") -> M:
    """A new material in which the values or inner materials at some paths are replaced.

    values    path -> new value
    location  the place of the values, for errors
    Raises InputError for unknown paths and invalid values.
    """
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
    """A new material in which some parameters, not those of inner materials, are replaced. All values are checked."""
    return type(material)(**{**{name: getattr(material, name) for name in material.parameters()}, **values})


def map_leaves(material: M, change: Callable[[Parameter, object], object]) -> M:
    """A new material in which the value of every leaf is `change(parameter, value)`."""
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
    """A material from its class and values; called by unpickling."""
    return cls(**values)


def plain_values(material: M) -> M:
    """The material with NumPy arrays in place of Dr.Jit arrays."""
    values: dict[str, Value] = {}
    for leaf in leaves(material):
        vector = backend.is_drjit(leaf.value) and backend.drjit().is_vector_v(leaf.value)
        parts = (
            (leaf.value,) if leaf.parameter.kind != "alpha" else tuple(leaf.value) if vector else pair_of(leaf.value)
        )
        if leaf.parameter.numeric and any(map(backend.is_drjit, parts)):
            columns = [np.asarray(backend.to_numpy(backend.drjit().detach(p), 1)) for p in parts]
            one = [float(c[0]) if c.shape == (1,) else c[0] if c.shape == (1, 3) else c for c in columns]
            values[leaf.path] = one[0] if len(one) == 1 else tuple(one)
    return replace(material, values) if values else material
