"""Mistakes that a wrong solution may contain, as formulas: what the values of f would then be.

    for family in FAMILIES:
        for variant in family.variants(material, wo, wi): variant.mistake.words, variant.values

One file per kind of material; a mistake is one entry of a list there.
"""

from __future__ import annotations

from . import diffuse, empirical, general, microfacet
from .base import Values, Variant, f_of

# The likeliest first; `general` evaluates other materials, which takes longest.
FAMILIES = (diffuse, empirical, microfacet, general)

__all__ = ["FAMILIES", "Values", "Variant", "f_of"]
