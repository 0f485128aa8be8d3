"""A parameter of a material, declared once: kind, range, unit and a line of documentation.

    albedo: Colour = spectrum(0.5, "share of light that is reflected", high=1.0)

The command line, scenes, plugins, sliders, shaders and the manual all read that declaration. Each kind is a class that
says what it accepts, what it becomes when the material is bound, and what symbol stands for it in a recording.

The annotation (`Colour`, `Number`, `Width`, `Angle`) tells type checkers two things: what the constructor takes, and
what `eval` sees, where every number has become a Dr.Jit value or a symbol.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Never, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import GonioWarning, InputError, did_you_mean
from ..members import Family
from ..ops import Pair, Scalar, Spectrum, backend, graph, sincos
from ..optics import indices
from ..optics.part import Part
from . import user_code

CHANNELS = 3  # of a colour given as plain numbers; a renderer's spectra have their own number

# --------------------------------------------------------------------------- what checkers and editors see

# What a parameter holds: what the user gave; in a bound copy a Dr.Jit value or a symbol, which share no type.
Value: TypeAlias = Any
Floats: TypeAlias = "NDArray[np.floating]"
PlainNumber: TypeAlias = "float | list[float] | Floats | Scalar"
PlainColour: TypeAlias = "float | tuple[float, float, float] | list[float] | Floats | Spectrum | Scalar"
PlainIndex: TypeAlias = "PlainNumber | str"
PlainMember: TypeAlias = "str | Part | type[Part]"  # a distribution, a masking term, a Fresnel kind
PlainWidth: TypeAlias = "float | tuple[PlainNumber, PlainNumber] | list[float] | Floats | Pair | Scalar"

if TYPE_CHECKING:
    # `owner: Never`: the constructor takes what `__set__` does, and nobody can set it afterwards
    class Number:
        def __get__(self, owner: object, cls: type | None = None) -> Scalar: ...
        def __set__(self, owner: Never, value: PlainNumber) -> None: ...

    class Index(Number):
        def __set__(self, owner: Never, value: PlainIndex) -> None: ...

    class Colour:
        def __get__(self, owner: object, cls: type | None = None) -> Spectrum: ...
        def __set__(self, owner: Never, value: PlainColour) -> None: ...

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


# --------------------------------------------------------------------------- the kinds


class Material:
    """What the tree of materials is made of, and a parameter may hold: `BSDF`, as far as parameters go."""

    derives: ClassVar[bool] = False  # whether `derive` is written
    guided: ClassVar[bool] = False  # whether of eval, pdf and sample only `eval` is: a guide is found for sampling

    _bound: ClassVar[bool] = False
    _count: int = 1  # of materials in the tree; no field of its own
    _plain: Self | None = None
    _derived: object = None

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """The declared parameters by name."""
        raise NotImplementedError

    def derive(self) -> object:
        """What follows from the parameters alone and is expensive to compute for every ray: a NamedTuple, or None."""
        return None

    def prepare(self) -> None:
        """Find what is found once from the parameters as they were given, such as tables: no loop can do it."""

    @property
    def is_bound(self) -> bool:
        """Whether this is a bound copy."""
        return self._bound

    @property
    def plain(self) -> Self:
        """The material as it was made: itself, or what a bound copy was bound from. Facts that shape code ask it."""
        return self if self._plain is None else self._plain


@dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter; a kind is a subclass.

    low, high  closed range; outside it is an error, above `high` only a warning where `soft_high`
    white      its value in the material's white twin (`BSDF.white`); None leaves it as it is
    inside     whether it is of what lies behind the surface: no formula of the surface depends on it
    off        a number's value at which what it weighs is not there, so that code can be written without it
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
        """The range in words, as errors and the manual print it."""
        return self.kind

    @property
    def choices(self) -> dict[str, str]:
        """name -> what it means, of a choice."""
        return {}

    def check(self, value: object, location: str) -> None:
        """Raise InputError, or warn, where `value` cannot stand for this parameter."""

    def coerce(self, value: object, location: str) -> Value:
        """What a material holds where the user gave `value`: here that itself, once it is checked."""
        self.check(value, location)
        return value

    def portable(self, value: object) -> object:
        """What a pickled material has in the value's place."""
        return value

    def bind(self, value: object, types: backend.Types) -> Value:
        """The value as Dr.Jit values of these types; what shapes the code stays as it is."""
        return value

    def symbol(self, value: object) -> Value:
        """The symbol that stands for the value in a recording; what shapes the code stays as it is."""
        return value

    def is_off(self, value: object) -> bool:
        """Whether that is the plain number at which what it weighs is not there."""
        return self.off is not None and isinstance(value, int | float) and value == self.off

    def rows(self, value: object) -> int:
        """How many rays the value has entries for, 1 where it is the same for all."""
        return 1


Choices: TypeAlias = "Mapping[str, str] | Callable[[], Mapping[str, str]] | Family[Any]"


class _Numeric(Parameter):
    """What the kinds that hold numbers share."""

    numeric = True
    dimensions: ClassVar[int] = 0  # of one ray's value
    symbol_type: ClassVar[str] = "float"

    @property
    def range(self) -> str:
        low = "" if self.low == -math.inf else f">= {self.low:g}"
        high = "" if self.high == math.inf else f"<= {self.high:g}"
        return " and ".join(x for x in (low, high) if x) or "any number"

    def check(self, value: object, location: str) -> None:
        if backend.is_drjit(value) or isinstance(value, graph.Node) or value is None:
            return
        try:
            array = np.asarray(value)
            if np.iscomplexobj(array):
                raise InputError(f"{value!r} is complex, a real number expected", location, "give eta and k apart")
            array = array.astype(np.float64)
        except InputError:
            raise
        except (TypeError, ValueError):
            raise InputError(f"{value!r} given, a number or an array expected", location) from None
        if isinstance(value, str | bytes) or array.ndim > 1 + self.dimensions:
            raise InputError(f"{value!r} given, a number or an array expected", location)
        if self.dimensions and array.ndim and array.shape[-1] != CHANNELS:
            what = f"a colour of shape {array.shape}, a number, {CHANNELS} values or (N, {CHANNELS}) expected"
            raise InputError(what, location)
        if array.size == 0:
            raise InputError("an empty array given, a number or an array expected", location)
        if not np.all(np.isfinite(array)):
            raise InputError(f"{value!r} is not finite", location)
        if array.min() < self.low or (array.max() > self.high and not self.soft_high):
            outside = array.min() if array.min() < self.low else array.max()
            raise InputError(f"{outside:g} given, {self.range} expected", location)
        if array.max() > self.high:
            text = f"{array.max():g} is over {self.high:g}: the material gives back more light than it receives"
            warnings.warn(f"{location}: {text}", GonioWarning, stacklevel=5)

    def bind(self, value: object, types: backend.Types) -> Value:
        return backend.float_of(value, types)

    def symbol(self, value: object) -> Value:
        return graph.symbol(self.symbol_type)

    def rows(self, value: object) -> int:
        array = np.empty(()) if backend.is_drjit(value) else np.asarray(value)
        return 1 if array.ndim <= self.dimensions else len(array)


class NumberParameter(_Numeric):
    """A number; bound: a Dr.Jit float."""

    kind = "float"


class IndexParameter(NumberParameter):
    """A refractive index: a number, or the name of a substance, whose index depends on the wavelength.

    A name becomes a `DispersiveIndex`, which is a number to all but spectral renders.
    """

    def coerce(self, value: object, location: str) -> Value:
        return super().coerce(indices.dispersive(value, location) if isinstance(value, str) else value, location)


class ColourParameter(_Numeric):
    """A colour: a number (grey), three values, or an array (N, 3); bound: a spectrum."""

    kind = "spectrum"
    dimensions = 1
    symbol_type = "spectrum"

    @property
    def share(self) -> bool:
        """Whether it says how much of the light is kept: its declared range ends at 1."""
        return self.high == 1.0

    def bind(self, value: object, types: backend.Types) -> Value:
        if backend.is_drjit(value):
            return value if backend.drjit().is_vector_v(value) else types.vec3(value, value, value)
        array = np.asarray(value, dtype=np.float64)
        return backend.vector_of(np.broadcast_to(array, (CHANNELS,)) if array.ndim == 0 else array, CHANNELS, types)


class WidthParameter(_Numeric):
    """A microfacet width alpha, or a tuple of two (along x, along y); bound: a pair."""

    kind = "alpha"
    symbol_type = "vec2"

    def check(self, value: object, location: str) -> None:
        for one in pair_of(value, location):
            super().check(one, location)

    def bind(self, value: object, types: backend.Types) -> Value:
        if backend.is_drjit(value) and backend.drjit().is_vector_v(value):
            return value
        x, y = pair_of(value)
        x, y = backend.float_of(x, types), backend.float_of(y, types) if y is not x else None
        return types.vec2(x, x if y is None else y)

    def rows(self, value: object) -> int:
        return max(_Numeric.rows(self, one) for one in pair_of(value))


class AngleParameter(_Numeric):
    """An angle in radians; bound: the pair (cos, sin), or None where it is the plain number 0: no turn at all."""

    kind = "angle"
    symbol_type = "vec2"

    @staticmethod
    def none(value: object) -> bool:
        """Whether a value is no turn, known before anything runs."""
        return value is None or (isinstance(value, int | float) and value == 0)

    def bind(self, value: object, types: backend.Types) -> Value:
        if self.none(value):
            return None
        if backend.is_drjit(value) and backend.drjit().is_vector_v(value):
            return value
        s, c = sincos(backend.float_of(value, types))
        return types.vec2(c, s)

    def symbol(self, value: object) -> Value:
        return None if self.none(value) else super().symbol(value)


@dataclass(frozen=True)
class ChoiceParameter(Parameter):
    """A choice between names; it shapes the code, so it is known before anything runs."""

    kind = "choice"
    members: Choices = dataclasses.field(default_factory=dict)

    @property
    def choices(self) -> dict[str, str]:
        if isinstance(self.members, Family):
            return self.members.titles()
        return dict(self.members() if callable(self.members) else self.members)

    @property
    def range(self) -> str:
        return " | ".join(self.choices)

    def coerce(self, value: object, location: str) -> Value:
        return super().coerce(user_code.member_name(value, location, self.family), location)

    @property
    def family(self) -> Family[Any] | None:
        """The family whose members may be chosen; None of a choice between plain names."""
        return self.members if isinstance(self.members, Family) else None

    def spelled(self, name: str) -> str:
        """The name as a text for another process: FILE.py:NAME of a member that this program alone has."""
        return name if self.family is None else self.family.spelled(name)

    def portable(self, value: object) -> object:
        return value if self.family is None or not isinstance(value, str) else self.family.portable(value)

    def check(self, value: object, location: str) -> None:
        known = self.choices
        if self.family is not None and isinstance(value, str) and user_code.names_code(value):
            hint = "name it on the command line, in a program, or in a scene with --allow-code; here give a name"
            raise InputError(f"'{value}' is code, which is not run from here", location, hint)
        if not isinstance(value, str) or value not in known:
            raise InputError(f"unknown {self.name} '{value}'", location, did_you_mean(str(value), list(known)))


class FlagParameter(Parameter):
    """A switch that shapes the code."""

    kind = "flag"

    def check(self, value: object, location: str) -> None:
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"{value!r} given, True or False expected", location)


class FileParameter(Parameter):
    """A file, by its path; what reads it is the material's own business."""

    kind = "file"

    def check(self, value: object, location: str) -> None:
        if isinstance(value, bool | int | float | list | tuple) or value is None or value == "":
            raise InputError(f"{value!r} given, the path of a file expected", location)


class MaterialParameter(Parameter):
    """A material inside a material."""

    kind = "bsdf"
    inner = True

    def check(self, value: object, location: str) -> None:
        if not isinstance(value, Material):
            raise InputError(f"{type(value).__name__} given, a material expected", location)


def pair_of(value: object, location: str = "") -> tuple[Value, Value]:
    """The two widths of a width as a user gives it: itself twice, or the tuple's."""
    if not isinstance(value, tuple | list):
        return value, value
    if len(value) != 2:
        raise InputError(f"{len(value)} widths given, one or two expected", location)
    return value[0], value[1]


# --------------------------------------------------------------------------- how a material declares them


def _declare(kind: type[Parameter], default: object, doc: str, **more: object) -> Value:
    """A field that knows its declaration; without a default it must be given."""
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

    inside  it is of what lies behind the surface, which no formula of the surface depends on
    off     the value, such as a layer's weight of 0, at which `eval`, `pdf`, `sample` and `derive` do without what it
            weighs where they see that plain number: lean shaders are written without it
    """
    return _declare(NumberParameter, default, doc, low=low, high=high, unit=unit, inside=inside, off=off)


def index(default: PlainIndex, doc: str, *, low: float, high: float) -> Index:
    """Declare a refractive index: a number, or a name of `go.indices()`."""
    return _declare(IndexParameter, default, doc, low=low, high=high)


def spectrum(
    default: PlainColour | None = None,
    doc: str = "",
    *,
    low: float = -math.inf,
    high: float = math.inf,
    unit: str = "",
    soft_high: bool = False,
    inside: bool = False,
) -> Colour:
    """Declare a colour: a number (grey), three values, or an array (N, channels).

    A colour whose range ends at 1 is a share of the light: it is 1 in the material's white twin.

    inside  it is of what lies behind the surface, which no formula of the surface depends on
    """
    white = 1.0 if high == 1.0 else None
    return _declare(
        ColourParameter, default, doc, low=low, high=high, unit=unit, soft_high=soft_high, white=white, inside=inside
    )


def width(default: PlainWidth | None = None, doc: str = "", *, low: float = 0.0, high: float = 1.0) -> Width:
    """Declare a microfacet width alpha, or a tuple of two (along x, along y); bound: a vector of two.

    low  0 where the model knows what a mirror is; a model that divides by alpha says from where on it holds
    """
    return _declare(WidthParameter, default, doc, low=low, high=high)


def angle(default: PlainNumber = 0.0, doc: str = "") -> Angle:
    """Declare an angle in radians; bound: the vector (cos, sin), or None where it is the plain number 0."""
    return _declare(AngleParameter, default, doc, unit="rad")


def choice(default: PlainMember, doc: str, choices: Choices, *, white: str | None = None) -> str:
    """Declare a choice between names; it shapes the code, so it is known before anything runs.

    default  a name; of a family's members also a class or an instance, or FILE.py:CLASS beside the file that says so
    choices  name -> what it means, or a function that returns them; or a family, `go.NDF.family`, whose members may be
             given as classes, instances and FILE.py:CLASS too
    white    the name that stands in the material's white twin, such as F = 1
    """
    return _declare(
        ChoiceParameter,
        user_code.member_name(default, "choice", choices if isinstance(choices, Family) else None),
        doc,
        members=choices,
        white=white,
    )


def flag(default: bool, doc: str) -> bool:
    """Declare a switch that shapes the code."""
    return _declare(FlagParameter, default, doc)


def file(default: str | None = None, doc: str = "") -> Value:
    """Declare a file of data, by its path; it shapes the code, so it is read when the material is made."""
    return _declare(FileParameter, default, doc)


def bsdf(doc: str, default: Material | None = None) -> Value:
    """Declare a material inside a material."""
    return _declare(MaterialParameter, default, doc)


def declared(cls: type) -> dict[str, Parameter]:
    """The parameters that a class declares, by name, in order."""
    parameters = {}
    for field in dataclasses.fields(cls):
        if field.metadata:
            more = dict(field.metadata)
            parameters[field.name] = more.pop("kind")(name=field.name, default=field.default, **more)
    return parameters
