"""Possible mistakes in a solution, as formulas for the resulting values of f.

    for family in FAMILIES:
        for variant in family.variants(material, wo, wi): variant.mistake.words, variant.values

There is one file per kind of material, with one entry per mistake.
"""

from __future__ import annotations

from . import diffuse, empirical, general, microfacet
from .base import Values, Variant, f_of

# Ordered by likelihood; `general` is last, because it evaluates other materials, which takes longest.
FAMILIES = (diffuse, empirical, microfacet, general)

__all__ = ["FAMILIES", "Values", "Variant", "f_of"]
