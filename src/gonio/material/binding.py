"""The bound copy of a material: every number a Dr.Jit value (or a symbol), ready for `eval`, `pdf` and `sample`.

Binding makes each value an evaluated array of one entry a literal, so that a changed value compiles nothing.
What follows from the parameters alone (`BSDF.derive`) is computed once on the bound copy and kept there.

Copies are made in this file and nowhere else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

from ..ops import Scalar, Vector, backend
from . import tree
from .parameters import Material, Parameter, Value

M = TypeVar("M", bound=Material)

DERIVED = "derived"  # the part of a bound copy that holds what `derive` gave, in recordings and their names


def bound_copy(material: M, values: Mapping[str, object], derived: object = None) -> M:
    """A copy with these bound values: every numeric parameter's, and the inner materials'."""
    copy: M = object.__new__(type(material))
    state = vars(copy)
    state.update(vars(material))
    state.update(values)
    state.update(_bound=True, _plain=material.plain, _derived=derived, _kept=None)
    return copy


def bind(material: M, convert: Callable[[Parameter, object], object]) -> M:
    """A bound copy, its numbers being what `convert(parameter, value)` makes of them, in inner materials too."""
    values = {}
    for name, parameter in material.parameters().items():
        if parameter.inner:
            values[name] = bind(getattr(material, name), convert)
        elif parameter.numeric:
            values[name] = convert(parameter, getattr(material, name))
    return bound_copy(material, values)


def bind_to(material: M, types: backend.Types) -> M:
    """A bound copy for Dr.Jit values of these types, with what its parameters derive, where that is the same for all
    rays; what plain numbers derive is kept with the material, which is frozen."""
    copy = bind(material, lambda parameter, value: parameter.bind(value, types))
    if not material.derives:
        return copy
    cached = vars(material).setdefault("_kept", None) or {}
    if types.float not in cached:
        derived = evaluate_derived(copy)
        if derived is None or not _plain(material):
            return with_derived(copy, derived)
        vars(material)["_kept"] = cached = {**cached, types.float: derived}
    return with_derived(copy, cached[types.float])


def with_derived(material: M, derived: object) -> M:
    """The bound copy holding what `derive` gave, or what a recording has in its place."""
    return bound_copy(material, {}, derived)


def evaluate_derived(material: Material, rays: int = 1) -> object:
    """What a bound copy derives, evaluated now: where no parameter is being differentiated, or varies over more than
    `rays` rays, and never while Dr.Jit records a loop, in which nothing can be computed; else None."""
    if not material.derives:
        return None
    dr = backend.drjit()
    given = list(values(material))
    if any(not backend.is_drjit(value) for value in given):  # symbols
        return None
    if dr.flag(dr.JitFlag.SymbolicScope) or any(dr.width(v) > rays or dr.grad_enabled(v) for v in given):
        return None
    derived = material.derive()
    dr.make_opaque(*_arrays(derived))  # one by one: given a tuple with names in it, Dr.Jit evaluates nothing
    return derived


def _arrays(value: object) -> Iterator[object]:
    """The Dr.Jit values in a structure of tuples."""
    if backend.is_drjit(value):
        yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from _arrays(part)


def values(material: Material) -> Iterator[Scalar | Vector]:
    """The numeric values of a bound copy, inner materials' included."""
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric and leaf.value is not None:
            yield leaf.value


def shift(material: M, path: str, change: Callable[[Value], Value]) -> M:
    """The bound copy with one value changed."""
    name, _, rest = path.partition(".")
    value = getattr(material, name)
    return bound_copy(material, {name: shift(value, rest, change) if rest else change(value)})


def _plain(material: Material) -> bool:
    """Whether all numbers are plain ones, which cannot change behind our back as arrays can."""
    return all(isinstance(leaf.value, int | float | tuple) for leaf in tree.leaves(material) if leaf.parameter.numeric)
