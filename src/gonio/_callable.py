"""Packages that can be called: in `gonio`, a subpackage hides a function of the same name, so it stands in for it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType


def make_callable(module: str, function: Callable[..., object]) -> None:
    """Let the named module be called like `function`: go.models(), go.render(scene)."""

    class CallableModule(ModuleType):
        __doc__ = sys.modules[module].__doc__

        def __call__(self, *args: object, **kwargs: object) -> object:
            return function(*args, **kwargs)

    sys.modules[module].__class__ = CallableModule
