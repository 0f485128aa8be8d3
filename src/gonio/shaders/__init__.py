"""Shader code generated from the Python source of the models. `go.emit(model)` calls `emission.emit`."""

from .bundle import Bundle, bundle
from .emission import emit
from .languages import Language
from .placement import Placement

__all__ = ["Bundle", "Language", "Placement", "bundle", "emit"]
