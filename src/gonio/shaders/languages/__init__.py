"""The shader languages, one file each. To add one, add a file to this folder, an entry point in a package, or a
registered class; see `gonio.members`.
"""

from __future__ import annotations

from .base import Language

__all__ = ["Language", "languages"]


def languages() -> dict[str, Language]:
    """Every language by name, in alphabetical order."""
    return Language.family.all()
