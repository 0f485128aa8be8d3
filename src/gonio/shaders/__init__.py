"""Shader code generated from the models' Python source. `go.emit(model)` is `bundle.emit`."""

from .bundle import Bundle, bundle, emit
from .languages import Language
from .placement import Placement

__all__ = ["Bundle", "Language", "Placement", "bundle", "emit"]
