"""Names of members of `BSDF` in Gonio 0.1. Delete this file after one release."""

from __future__ import annotations

import warnings
from dataclasses import Field

from .parameters import Value


class _FormerName:
    """A descriptor for a member's name in Gonio 0.1: it warns and returns the renamed member."""

    def __init__(self, new: str) -> None:
        self.new = new

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, material: object | None, cls: type) -> Value:
        _warn_of_former(cls, self.name, self.new)
        return getattr(cls if material is None else material, self.new)


# Delete after one release, with `move_former_names`. `lossless` was a number in 0.1, and the method was `white`.
FORMER_NAMES = {
    "breaks": "known_violations",
    "breaches": "violations",
    "gives_way": "overridable",
    "leans": "perturbs_normal",
    "white": "lossless",
}


def add_former_names(cls: type) -> None:
    """Make the members of a class accessible by their names in Gonio 0.1."""
    for old, new in FORMER_NAMES.items():
        former = _FormerName(new)
        former.__set_name__(cls, old)
        setattr(cls, old, former)


def _warn_of_former(cls: type, old: str, new: str) -> None:
    warnings.warn(f"{cls.__name__}.{old} is now {new}", DeprecationWarning, stacklevel=3)


def move_former_names(cls: type) -> None:
    """Rename members that a class defines under their names in Gonio 0.1, with a warning."""
    own = vars(cls)
    former = [(old, new) for old, new in FORMER_NAMES.items() if old in own and not isinstance(own[old], Field)]
    if "lossless" in own and not callable(own["lossless"]):
        former.insert(0, ("lossless", "lossless_tolerance"))
    for old, new in former:
        _warn_of_former(cls, old, new)
        setattr(cls, new, own[old])
        delattr(cls, old)
