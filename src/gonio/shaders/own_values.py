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

    lean       omit code that these values switch off, such as a coat of weight 0
    constants  also write these values, as a constant of the type of the material's struct
    fold       write these values into the code, in which expressions that depend on them alone become numbers
    """

    lean: bool = False
    constants: bool = False
    fold: bool = False
