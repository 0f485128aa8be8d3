"""Distributions of microfacet normals. Each is one file in this folder."""

from __future__ import annotations

from .base import NDF, Stretched

__all__ = ["NDF", "Stretched", "distribution", "distributions"]


def distributions() -> dict[str, NDF]:
    """All distributions, by name."""
    return NDF.family.all()


def distribution(name: str) -> NDF:
    """The distribution of this name. Raises InputError if there is none."""
    return NDF.family.get(name)
