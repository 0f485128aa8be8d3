"""Options for the use of a material's own values in its shader."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict


class OwnKeywords(TypedDict, total=False):
    """The types of `OwnValues` as keywords."""

    lean: bool
    constants: bool
    fold: bool


@dataclass(frozen=True)
class OwnValues:
    """Options for the use of a material's own values in its shader.

    lean       omit code that they switch off, such as a coat of weight 0
    constants  also write them, as a constant of the material's struct
    fold       write them into the code, where expressions of them alone become numbers
    """

    lean: bool = False
    constants: bool = False
    fold: bool = False
