"""Declarations of a material's parameters, each with its kind, range, unit and one line of documentation.

    `albedo: Colour = spectrum(0.5, "fraction of light that is reflected", high=1.0)`

The command line, scenes, plugins, sliders, shaders and the manual all read this one declaration. Each kind is a class
that defines which values are valid, how a value is bound, and which symbol represents it in a recording.

The annotation (`Colour`, `Number`, `Width`, `Angle`) tells type checkers the type that the constructor accepts and the
type inside `eval`, where every number is a Dr.Jit value or a symbol.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Never, TypeAlias

from ..members import Family
from ..ops import Pair, Scalar, Spectrum
from ..optics.part import Part
from . import user_code
from .kinds import (
    AngleParameter,
    Choices,
    ColorParameter,
    FileParameter,
    FlagParameter,
    MaterialParameter,
    NumberParameter,
    WidthParameter,
)
from .kinds import ChoiceParameter as ChoiceParameter
from .kinds import Floats as Floats
from .kinds import IndexParameter as IndexParameter
from .kinds import IntegerParameter as IntegerParameter
from .kinds import has_two_values as has_two_values
from .kinds import pair_of as pair_of
from .node import Material as Material
from .node import Parameter as Parameter
from .node import Value as Value

# --------------------------------------------------------------------------- types for checkers and editors

PlainNumber: TypeAlias = "float | list[float] | Floats | Scalar"
PlainColor: TypeAlias = "float | tuple[float, float, float] | list[float] | Floats | Spectrum | Scalar"
PlainIndex: TypeAlias = "PlainNumber | str"
PlainMember: TypeAlias = "str | Part | type[Part]"  # a distribution, a masking term, a Fresnel kind
PlainWidth: TypeAlias = "float | tuple[PlainNumber, PlainNumber] | list[float] | Floats | Pair | Scalar"

if TYPE_CHECKING:
    # `owner: Never`: the constructor accepts the type of `__set__`, and no assignment is possible afterwards
    class Number:
        def __get__(self, owner: object, cls: type | None = None) -> Scalar: ...
        def __set__(self, owner: Never, value: PlainNumber) -> None: ...

    class Index(Number):
        def __set__(self, owner: Never, value: PlainIndex) -> None: ...

    class Colour:
        def __get__(self, owner: object, cls: type | None = None) -> Spectrum: ...
        def __set__(self, owner: Never, value: PlainColor) -> None: ...

    class Width:
        def __get__(self, owner: object, cls: type | None = None) -> Pair: ...
        def __set__(self, owner: Never, value: PlainWidth) -> None: ...

    class Angle:
        def __get__(self, owner: object, cls: type | None = None) -> Pair | None: ...
        def __set__(self, owner: Never, value: PlainNumber | None) -> None: ...

    class Member:
        def __get__(self, owner: object, cls: type | None = None) -> str: ...
        def __set__(self, owner: Never, value: PlainMember) -> None: ...

else:
    Number = Index = Colour = Width = Angle = Member = "a declared parameter"


# --------------------------------------------------------------------------- declarations


def _declare(kind: type[Parameter], default: object, doc: str, **more: object) -> Value:
    """A dataclass field that contains the declaration; required if `default` is None."""
    if default is None:
        return dataclasses.field(metadata={"kind": kind, "doc": doc, **more})
    return dataclasses.field(default=default, metadata={"kind": kind, "doc": doc, **more})


def number(
    default: PlainNumber | None = None,
    doc: str = "",
    *,
    low: float = -math.inf,
    high: float = math.inf,
    unit: str = "",
    inside: bool = False,
    off: float | None = None,
) -> Number:
    """Declare a number with its closed range and unit.

    default    default value; None makes the parameter required
    doc        one line of documentation
    low, high  closed range
    unit       unit, such as "nm"; "" if dimensionless
    inside     whether it describes the medium behind the surface, on which no formula of the surface depends
    off        the plain number, such as a layer's weight of 0, at which `eval`, `pdf`, `sample` and `derive` omit the
               component that it weights; shaders are then written without that component
    """
    return _declare(NumberParameter, default, doc, low=low, high=high, unit=unit, inside=inside, off=off)


def index(default: PlainIndex, doc: str, *, low: float, high: float) -> Index:
    """Declare a refractive index: a number, or the name of a substance of `go.indices()`. Arguments as for `number`."""
    return _declare(IndexParameter, default, doc, low=low, high=high)


def spectrum(
    default: PlainColor | None = None,
    doc: str = "",
    *,
    low: float = -math.inf,
    high: float = math.inf,
    unit: str = "",
    soft_high: bool = False,
    inside: bool = False,
) -> Colour:
    """Declare a color: a number (gray), three values, or an array (N, channels).

    A color whose range ends at 1 is a fraction of the light and is 1 in the material's lossless variant.

    soft_high  whether a value above `high` causes only a warning
    inside     whether it describes the medium behind the surface, on which no formula of the surface depends
    For the other arguments, see `number`.
    """
    white = 1.0 if high == 1.0 else None
    return _declare(
        ColorParameter, default, doc, low=low, high=high, unit=unit, soft_high=soft_high, white=white, inside=inside
    )


def width(default: PlainWidth | None = None, doc: str = "", *, low: float = 0.0, high: float = 1.0) -> Width:
    """Declare a microfacet width alpha, or a tuple of two (along x, along y). In a bound material, its value is a
    vector of two.

    low  the smallest alpha at which the model is valid: 0 if it becomes a mirror there, positive if it divides by alpha
    For the other arguments, see `number`.
    """
    return _declare(WidthParameter, default, doc, low=low, high=high)


def angle(default: PlainNumber = 0.0, doc: str = "") -> Angle:
    """Declare an angle in radians, with its default and documentation. In a bound material, its value is the vector
    (cos, sin), or None for the plain number 0."""
    return _declare(AngleParameter, default, doc, unit="rad")


def choice(default: PlainMember, doc: str, choices: Choices, *, white: str | None = None) -> str:
    """Declare a choice between names. It is static: code is compiled for each choice.

    default  a name; for a family also a class, an instance, or FILE.py:CLASS relative to the file of the declaration
    choices  name -> description, or a function that returns such a mapping; or a family, such as `go.NDF.family`, whose
             members may also be given as classes, instances or FILE.py:CLASS
    white    the name used in the material's lossless variant, such as that of F = 1; None leaves the choice unchanged
    """
    return _declare(
        ChoiceParameter,
        user_code.member_name(default, "choice", choices if isinstance(choices, Family) else None),
        doc,
        members=choices,
        white=white,
    )


def flag(default: bool, doc: str) -> bool:
    """Declare a static switch, True or False: code is compiled for each of the two values."""
    return _declare(FlagParameter, default, doc)


def file(default: str | None = None, doc: str = "") -> Value:
    """Declare the path of a data file. The file is read when the material is constructed, because the code depends on
    it."""
    return _declare(FileParameter, default, doc)


def bsdf(doc: str, default: Material | None = None) -> Value:
    """Declare a material inside another material; required if `default` is None."""
    return _declare(MaterialParameter, default, doc)


def declared(cls: type) -> dict[str, Parameter]:
    """The parameters that a class declares, by name, in order of declaration."""
    parameters = {}
    for field in dataclasses.fields(cls):
        if field.metadata:
            more = dict(field.metadata)
            parameters[field.name] = more.pop("kind")(name=field.name, default=field.default, **more)
    return parameters
