"""Masking and shadowing, the fraction G of facets visible from both wo and wi. Each term is one file in this folder."""

from __future__ import annotations

from .base import Masking, masking_shadowing, term

__all__ = ["Masking", "masking_shadowing", "term"]
