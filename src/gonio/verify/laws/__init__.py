"""The laws, one file each. To add a law, add a file to this folder or an entry point to a package, or register a class
(see `gonio.members`).
"""

from __future__ import annotations

from collections.abc import Sequence

from .base import Law

__all__ = ["Law", "chosen", "laws"]


def laws() -> dict[str, Law]:
    """Every law by name, in the order of a report."""
    return {law.name: law for law in sorted(Law.family.all().values(), key=lambda law: (law.number, law.name))}


def chosen(names: Sequence[str] | None) -> list[Law]:
    """The laws with the given names, in the order of a report.

    names  names of laws; None selects all except those that are tested on request only
    Raises InputError for an unknown name.
    """
    asked = None if names is None else {Law.family.get(name).name for name in names}
    return [law for name, law in laws().items() if (not law.on_request if asked is None else name in asked)]
