"""The bases of all materials and of all kinds of parameters."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeAlias

from ..ops import backend

# The value of a parameter: as given by the user; in a bound copy a Dr.Jit value or a symbol, which have no common type.
Value: TypeAlias = Any


class Material:
    """The part of `BSDF` that parameters need: a node of a tree of materials."""

    derives: ClassVar[bool] = False  # whether `derive` is defined
    guided: ClassVar[bool] = False  # whether only `eval` is defined, so that a guide is computed for sampling

    _bound: ClassVar[bool] = False
    _count: int = 1  # number of materials in the tree; not a field
    _plain: Self | None = None
    _derived: object = None

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """The declared parameters by name."""
        raise NotImplementedError

    def derive(self) -> object:
        """Values that depend only on the parameters and are expensive to compute per ray: a NamedTuple, or None."""
        return None

    def prepare(self) -> None:
        """Compute the tables that depend on unbound parameters, which is impossible while a loop is recorded."""

    @property
    def is_bound(self) -> bool:
        """Whether this is a bound copy."""
        return self._bound

    @property
    def plain(self) -> Self:
        """The unbound material: itself, or the one from which this copy was bound. Its facts determine the compiled
        code."""
        return self if self._plain is None else self._plain


@dataclass(frozen=True)
class Parameter:
    """The declaration of one parameter. Each kind of parameter is a subclass.

    name       name of the parameter
    default    its default value; `dataclasses.MISSING` if it is required
    doc        one line of documentation
    low, high  closed range; a value outside is an error, but one above `high` only a warning if `soft_high`
    unit       unit, such as "rad"; "" if dimensionless
    white      its value in the material's lossless variant (`BSDF.lossless`); None leaves it unchanged
    inside     whether it describes the medium behind the surface, on which no formula of the surface depends
    off        the value at which the component that it weights vanishes, so that code can be written without that
               component; None if there is no such value
    """

    kind: ClassVar[str] = ""
    numeric: ClassVar[bool] = False
    inner: ClassVar[bool] = False  # whether it holds a material

    name: str
    default: Value
    doc: str
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    soft_high: bool = False
    white: Value = None
    inside: bool = False
    off: float | None = None

    @property
    def required(self) -> bool:
        return self.default is dataclasses.MISSING

    @property
    def range(self) -> str:
        """The range in words, for errors and the manual."""
        return self.kind

    @property
    def choices(self) -> dict[str, str]:
        """Name -> description of each option, for a choice; else empty."""
        return {}

    def check(self, value: object, location: str) -> None:
        """Raise InputError, or warn, if `value` is not valid for this parameter.

        location  the place of the value, for the message: "Conductor.alpha"
        """

    def coerce(self, value: object, location: str) -> Value:
        """The value that a material stores for a given `value`, which is checked: by default the same value."""
        self.check(value, location)
        return value

    def portable(self, value: object) -> object:
        """The value to store in a pickled material."""
        return value

    def bind(self, value: object, types: backend.Types) -> Value:
        """The value as Dr.Jit values of these types; static values are unchanged."""
        return value

    def symbol(self, value: object) -> Value:
        """The symbol for the value in a recording; static values are unchanged."""
        return value

    def is_off(self, value: object) -> bool:
        """Whether the value is the plain number `off`."""
        return self.off is not None and isinstance(value, int | float) and value == self.off

    def rows(self, value: object) -> int:
        """The number of rays for which an array has entries; 1 if the value is the same for all rays."""
        return 1
