"""Shader code generated from the models' Python source. `go.emit(model)` is `emission.emit`."""

from .bundle import Bundle, bundle
from .emission import emit
from .languages import Language
from .placement import Placement

__all__ = ["Bundle", "Language", "Placement", "bundle", "emit"]
