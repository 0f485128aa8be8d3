"""Mistakes that a wrong solution may contain, as formulas: what the values of f would then be.

    for variant in variants(material, wo, wi): variant.mistake.words, variant.values

One file per kind of material; a mistake is one entry of a list there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...material import BSDF
from . import diffuse, empirical, general, microfacet
from .base import Values, Variant, f_of

__all__ = ["Values", "Variant", "f_of", "variants"]


def variants(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """Wrong values of f over pairs of directions (N, 3), the likeliest mistakes first."""
    for family in (diffuse, empirical, microfacet, general):
        yield from family.variants(material, wo, wi)
