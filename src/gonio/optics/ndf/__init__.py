"""Distributions of microfacet normals. One is a file in this folder: discovery finds it."""

from __future__ import annotations

from .base import NDF, Stretched

__all__ = ["NDF", "Stretched", "distribution", "distributions"]


def distributions() -> dict[str, NDF]:
    """Every distribution by name."""
    return NDF.family.all()


def distribution(name: str) -> NDF:
    """The distribution of that name; InputError where there is none."""
    return NDF.family.get(name)
