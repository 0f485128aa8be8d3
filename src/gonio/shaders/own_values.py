"""What a shader does with the values of the material that it is written from."""

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
    """The use of a material's own values.

    lean       omit what they switch off, such as a coat of weight 0
    constants  also write them, as a constant of the struct
    fold       put them into the code: what depends on them alone is a number there
    """

    lean: bool = False
    constants: bool = False
    fold: bool = False
