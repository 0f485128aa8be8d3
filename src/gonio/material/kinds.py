"""The kinds of parameters: which values are valid, how they are bound, and their symbols in a recording."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import GonioWarning, InputError, did_you_mean
from ..members import Family
from ..ops import backend, graph, sincos
from ..optics import indices
from . import user_code
from .node import Material, Parameter, Value

CHANNELS = 3  # number of channels of a color given as plain numbers; a renderer's spectra have their own number

Floats: TypeAlias = "NDArray[np.floating]"


Choices: TypeAlias = "Mapping[str, str] | Callable[[], Mapping[str, str]] | Family[Any]"


class _Numeric(Parameter):
    """Base of the numeric kinds."""

    numeric = True
    dimensions: ClassVar[int] = 0  # number of dimensions of one ray's value
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
                raise InputError(f"{value!r} is complex, a real number expected", location, "give eta and k separately")
            array = array.astype(np.float64)
        except InputError:
            raise
        except (TypeError, ValueError):
            raise InputError(f"{value!r} given, a number or an array expected", location) from None
        if isinstance(value, str | bytes) or array.ndim > 1 + self.dimensions:
            raise InputError(f"{value!r} given, a number or an array expected", location)
        if self.dimensions and array.ndim and array.shape[-1] != CHANNELS:
            what = f"a color of shape {array.shape}, a number, {CHANNELS} values or (N, {CHANNELS}) expected"
            raise InputError(what, location)
        if array.size == 0:
            raise InputError("an empty array given, a number or an array expected", location)
        if not np.all(np.isfinite(array)):
            raise InputError(f"{value!r} is not finite", location)
        if array.min() < self.low or (array.max() > self.high and not self.soft_high):
            outside = array.min() if array.min() < self.low else array.max()
            raise InputError(f"{outside:g} given, {self.range} expected", location)
        if array.max() > self.high:
            text = f"{array.max():g} is over {self.high:g}: the material reflects more light than it receives"
            warnings.warn(f"{location}: {text}", GonioWarning, stacklevel=6)

    def bind(self, value: object, types: backend.Types) -> Value:
        return backend.float_of(value, types)

    def symbol(self, value: object) -> Value:
        return graph.symbol(self.symbol_type)

    def rows(self, value: object) -> int:
        array = np.empty(()) if backend.is_drjit(value) else np.asarray(value)
        return 1 if array.ndim <= self.dimensions else len(array)


class NumberParameter(_Numeric):
    """A number. In a bound material, its value is a Dr.Jit float."""

    kind = "float"


class IndexParameter(NumberParameter):
    """A refractive index: a number, or the name of a substance with dispersion.

    A name becomes a `DispersiveIndex`, which acts as a number except in spectral renders.
    """

    def coerce(self, value: object, location: str) -> Value:
        return super().coerce(indices.dispersive(value, location) if isinstance(value, str) else value, location)


class ColorParameter(_Numeric):
    """A color: a number (gray), three values, or an array (N, 3). In a bound material, its value is a
    spectrum."""

    kind = "spectrum"
    dimensions = 1
    symbol_type = "spectrum"

    @property
    def share(self) -> bool:
        """Whether it is a fraction of the light: its declared range ends at 1."""
        return self.high == 1.0

    def bind(self, value: object, types: backend.Types) -> Value:
        if backend.is_drjit(value):
            return value if backend.drjit().is_vector_v(value) else types.vec3(value, value, value)
        array = np.asarray(value, dtype=np.float64)
        return backend.vector_of(np.broadcast_to(array, (CHANNELS,)) if array.ndim == 0 else array, CHANNELS, types)


class WidthParameter(_Numeric):
    """A microfacet width alpha, or a tuple of two (along x, along y). In a bound material, its value is a
    pair."""

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
    """An angle in radians. In a bound material, its value is the pair (cos, sin), or None for the plain number 0, for
    which no rotation is compiled."""

    kind = "angle"
    symbol_type = "vec2"

    @staticmethod
    def none(value: object) -> bool:
        """Whether a value is statically known to cause no rotation."""
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
    """A choice between names. It is static: code is compiled for each choice."""

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
        """The family whose members may be chosen; None for a choice between plain names."""
        return self.members if isinstance(self.members, Family) else None

    def spelled(self, name: str) -> str:
        """The name by which another process finds a member: FILE.py:NAME for a member that only this program has
        registered."""
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


@dataclass(frozen=True)
class IntegerParameter(ChoiceParameter):
    """A static whole number, stored as a string: a choice that accepts every whole number in its range.

    `choices` lists the numbers to be tested, which are the first ones of a large range.
    """

    @property
    def choices(self) -> dict[str, str]:
        default = float(self.default)
        low = self.low if math.isfinite(self.low) else min(0.0, default)
        high = self.high if math.isfinite(self.high) else max(_LEAST - 1.0, default)
        listed = (str(int(low) + place) for place in range(min(int(high - low) + 1, _MOST)))
        return dict.fromkeys((*listed, str(int(default))), "")

    @property
    def range(self) -> str:
        low = f" >= {self.low:g}" if math.isfinite(self.low) else ""
        return f"a whole number{low}" + (f" <= {self.high:g}" if math.isfinite(self.high) else "")

    def coerce(self, value: object, location: str) -> Value:
        self.check(value, location)
        return str(int(float(str(value))))

    def check(self, value: object, location: str) -> None:
        try:
            number = math.nan if isinstance(value, bool) else float(str(value))
        except ValueError:
            number = math.nan
        if not number.is_integer() or not self.low <= number <= self.high:
            raise InputError(f"{str(value)[:40]} given, {self.range} expected", location)


_LEAST, _MOST = 4, 16  # how many numbers are tested: at least, for a range without an end, and at most


class FlagParameter(Parameter):
    """A static switch: code is compiled for each of its two values."""

    kind = "flag"

    def check(self, value: object, location: str) -> None:
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"{value!r} given, True or False expected", location)


class FileParameter(Parameter):
    """The path of a file that the material reads."""

    kind = "file"

    def check(self, value: object, location: str) -> None:
        if isinstance(value, bool | int | float | list | tuple) or value is None or value == "":
            raise InputError(f"{value!r} given, the path of a file expected", location)


class MaterialParameter(Parameter):
    """A material inside another material."""

    kind = "bsdf"
    inner = True

    def check(self, value: object, location: str) -> None:
        if not isinstance(value, Material):
            hint = "give an instance: go.material(...) makes one from a string, a file, a description or a class"
            raise InputError(f"{type(value).__name__} given, a material expected", location, hint)


def has_two_values(width: object) -> bool:
    """Whether an unbound width has, or may have, different values along x and y."""
    if backend.is_drjit(width):
        return bool(backend.drjit().is_vector_v(width))
    x, y = pair_of(width)
    return x is not y and not (isinstance(x, int | float) and isinstance(y, int | float) and x == y)


def pair_of(value: object, location: str = "") -> tuple[Value, Value]:
    """The two widths (along x, along y) of a value given by the user: one number twice, or the entries of a tuple.

    location  the place of the value, for errors
    Raises InputError for a tuple of any other length.
    """
    if not isinstance(value, tuple | list):
        return value, value
    if len(value) != 2:
        raise InputError(f"{len(value)} widths given, one or two expected", location)
    return value[0], value[1]
