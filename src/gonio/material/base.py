"""The names that a material needs, as files written for Gonio 0.1 import them; new ones take them from `gonio`."""

from .bsdf import BSDF, Breach, never
from .parameters import Parameter, Value, angle, bsdf, choice, flag, number, spectrum, width
from .sample import Sample

__all__ = [
    "BSDF", "Breach", "Parameter", "Sample", "Value",
    "angle", "bsdf", "choice", "flag", "never", "number", "spectrum", "width",
]  # fmt: skip
