"""The names that a material needs, as files written for Gonio 0.1 import them; new ones take them from `gonio`."""

from typing import Any, TypeAlias

from .material import BSDF, Breach, never
from .parameters import Parameter, angle, bsdf, choice, flag, number, spectrum, width
from .sample import Sample

Value: TypeAlias = Any  # how 0.1 annotated every parameter

__all__ = [
    "BSDF", "Breach", "Parameter", "Sample", "Value",
    "angle", "bsdf", "choice", "flag", "never", "number", "spectrum", "width",
]  # fmt: skip
