"""Recordings of materials: run on symbols, a method produces a typed graph, from which shaders are written."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import Any, TypeVar

from .. import ops
from ..ops import Mode, graph
from . import binding, tree
from .parameters import Material

M = TypeVar("M", bound=Material)


def symbols(material: M, without: Iterable[str] = ()) -> M:
    """A copy bound to symbols, one per numeric parameter; an angle given as the plain number 0 has none.

    without  paths of parameters that remain plain numbers because they switch a component off (`switched_off`), so that
             the code of the component is omitted
    """
    bound = binding.bind(material, lambda parameter, value: parameter.symbol(value))
    for path in without:
        bound = binding.shift(bound, path, lambda _, path=path: tree.value_at(material, path))  # type: ignore[misc]
    return bound


def switched_off(material: Material) -> list[str]:
    """Paths of the parameters whose values switch off the components that they weight."""
    return [leaf.path for leaf in tree.leaves(material) if leaf.parameter.is_off(leaf.value)]


def record(material: Material, method: str = "eval", mode: Mode = "radiance") -> graph.Graph:
    """A method as a typed graph. Its inputs are the material's parameters, "self.alpha", ..., then the arguments of the
    method."""
    inner = inspect.unwrap(getattr(type(material), method))
    more: dict[str, Any] = {"mode": mode} if "mode" in inspect.signature(inner).parameters else {}
    kinds = {"wo": "vec3", "u": "vec3"} if method == "sample" else {"wo": "vec3", "wi": "vec3"}
    name = f"{graph.class_name(material)}_{method}"
    return ops.record(inner, types=kinds, name=name, self=symbols(material), **more)
