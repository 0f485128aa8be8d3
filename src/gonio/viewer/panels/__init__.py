"""Panels of the page that come from outside. The page's own are TypeScript: web/src/panels, a file each."""

from __future__ import annotations

from .base import Panel, scripts

__all__ = ["Panel", "scripts"]
