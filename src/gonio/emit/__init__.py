"""Shader code (GLSL, WGSL, HLSL) written from the models' own source. The package can be called: `go.emit(model)`."""

from .._callable import make_callable
from .bundle import DIALECTS, Bundle, bundle, emit

__all__ = ["DIALECTS", "Bundle", "bundle", "emit"]

make_callable(__name__, emit)
