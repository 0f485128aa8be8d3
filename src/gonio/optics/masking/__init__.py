"""Masking and shadowing: the share G of facets that are seen from wo and lit from wi. A term is one file here."""

from __future__ import annotations

from .base import Masking, masking_shadowing, term

__all__ = ["Masking", "masking_shadowing", "term"]
