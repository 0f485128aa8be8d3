"""The bound copy of a material: its numbers are Dr.Jit values (or symbols), ready for `eval`, `pdf` and `sample`.

Binding converts each number to an evaluated array of one entry instead of a literal, so that changing a value does not
require compilation. Values that depend only on the parameters (`BSDF.derive`) are computed once and stored in the bound
copy.

Bound copies are made in this file only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

from ..ops import Scalar, Vector, backend
from . import tree
from .parameters import Material, Parameter, Value

M = TypeVar("M", bound=Material)

DERIVED = "derived"  # the part of a bound copy that holds the result of `derive`; also its name in recordings


def bound_copy(material: M, values: Mapping[str, object], derived: object = None) -> M:
    """A bound copy with the given values.

    values   parameter name -> bound value or bound inner material; other parameters keep their values
    derived  the result of `derive`; None if it is not known
    """
    copy: M = object.__new__(type(material))
    state = vars(copy)
    state.update(vars(material))
    state.update(values)
    state.update(_bound=True, _plain=material.plain, _derived=derived, _kept=None)
    return copy


def bind(material: M, convert: Callable[[Parameter, object], object]) -> M:
    """A bound copy in which each number, including those of inner materials, is `convert(parameter, value)`."""
    values = {}
    for name, parameter in material.parameters().items():
        if parameter.inner:
            values[name] = bind(getattr(material, name), convert)
        elif parameter.numeric:
            values[name] = convert(parameter, getattr(material, name))
    return bound_copy(material, values)


def bind_to(material: M, types: backend.Types) -> M:
    """A bound copy for Dr.Jit values of these types, with its derived values if they are the same for all rays. Values
    derived from plain numbers are cached with the material, which is frozen."""
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
    """The bound copy with the result of `derive`, or with its counterpart in a recording."""
    return bound_copy(material, {}, derived)


def evaluate_derived(material: Material, rays: int = 1) -> object:
    """The derived values of a bound copy, evaluated. None if a parameter is being differentiated or has values for more
    than `rays` rays, or while Dr.Jit records a loop, inside which nothing can be evaluated."""
    if not material.derives:
        return None
    dr = backend.drjit()
    given = list(values(material))
    if any(not backend.is_drjit(value) for value in given):  # symbols
        return None
    if dr.flag(dr.JitFlag.SymbolicScope) or any(dr.width(v) > rays or dr.grad_enabled(v) for v in given):
        return None
    derived = material.derive()
    dr.make_opaque(*_arrays(derived))  # one by one, because Dr.Jit evaluates nothing in a tuple that contains names
    return derived


def _arrays(value: object) -> Iterator[object]:
    """The Dr.Jit values in a nested structure of tuples."""
    if backend.is_drjit(value):
        yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from _arrays(part)


def values(material: Material) -> Iterator[Scalar | Vector]:
    """The numeric values of a bound copy, including those of inner materials."""
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric and leaf.value is not None:
            yield leaf.value


def shift(material: M, path: str, change: Callable[[Value], Value]) -> M:
    """The bound copy with the value at a path ("base.alpha") replaced by `change(value)`."""
    name, _, rest = path.partition(".")
    value = getattr(material, name)
    return bound_copy(material, {name: shift(value, rest, change) if rest else change(value)})


def _plain(material: Material) -> bool:
    """Whether all numbers are plain numbers. Arrays could be modified by their owner."""
    return all(isinstance(leaf.value, int | float | tuple) for leaf in tree.leaves(material) if leaf.parameter.numeric)
