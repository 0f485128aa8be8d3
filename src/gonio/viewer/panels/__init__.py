"""Panels from other packages. The page's own panels are TypeScript files in web/src/panels."""

from __future__ import annotations

from .base import Panel, scripts

__all__ = ["Panel", "scripts"]
