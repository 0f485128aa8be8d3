"""A material on symbols: the same methods leave a typed graph (`gonio.ops.graph`), from which shaders are written."""

from __future__ import annotations

import inspect
from typing import Any, TypeVar

from .. import ops
from ..ops import Mode, graph
from . import binding
from .parameters import Material

M = TypeVar("M", bound=Material)


def symbols(material: M) -> M:
    """A copy bound to symbols, one for each numeric parameter; an angle that is the plain number 0 is none."""
    return binding.bind(material, lambda parameter, value: parameter.symbol(value))


def record(material: Material, method: str = "eval", mode: Mode = "radiance") -> graph.Graph:
    """A method as a typed graph; parameters are "self.alpha", ..., then the method's own."""
    inner = inspect.unwrap(getattr(type(material), method))
    more: dict[str, Any] = {"mode": mode} if "mode" in inspect.signature(inner).parameters else {}
    kinds = {"wo": "vec3", "u": "vec3"} if method == "sample" else {"wo": "vec3", "wi": "vec3"}
    name = f"{type(material).__name__}_{method}"
    return ops.record(inner, types=kinds, name=name, self=symbols(material), **more)
