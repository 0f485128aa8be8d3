"""The shader languages, one file each. A new language is a file in this folder, an entry point of a package, or a
registered class; see `gonio.members`.
"""

from __future__ import annotations

from .base import Language

__all__ = ["Language", "languages"]


def languages() -> dict[str, Language]:
    """Every language by name, in alphabetical order."""
    return Language.family.all()
