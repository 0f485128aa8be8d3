"""Shader code generated from the models' Python source. `go.emit(model)` is `bundle.emit`."""

from .bundle import Bundle, bundle, emit
from .languages import Language

__all__ = ["Bundle", "Language", "bundle", "emit"]
