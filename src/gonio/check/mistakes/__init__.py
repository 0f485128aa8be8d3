"""Mistakes that a wrong solution may contain, as formulas for the values of f that result.

    for family in FAMILIES:
        for variant in family.variants(material, wo, wi): variant.mistake.words, variant.values

There is one file per kind of material, with one list entry per mistake.
"""

from __future__ import annotations

from . import diffuse, empirical, general, microfacet
from .base import Values, Variant, f_of

# Most likely first; `general` evaluates other materials, which takes longest.
FAMILIES = (diffuse, empirical, microfacet, general)

__all__ = ["FAMILIES", "Values", "Variant", "f_of"]
