"""Panels from other packages. The page's own panels are TypeScript: web/src/panels, one file each."""

from __future__ import annotations

from .base import Panel, scripts

__all__ = ["Panel", "scripts"]
