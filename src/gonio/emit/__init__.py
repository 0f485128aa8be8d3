"""Shader code written from the models' own source. The package can be called: `go.emit(model)`."""

from .._callable import make_callable
from .bundle import Bundle, bundle, emit
from .languages import Language

__all__ = ["Bundle", "Language", "bundle", "emit"]

make_callable(__name__, emit)
