"""The base of the parts of a microfacet material: distributions of normals, masking terms and Fresnel kinds.

Each is a class with one named instance. A user-defined part is tested when it is registered, so that a missing or
broken formula is reported with its line immediately, instead of deep inside a render.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from typing import ClassVar

from .. import ops
from ..errors import GonioError, InputError, summary, user_line
from ..ops import backend, graph
from ..ops.types import Value

GUIDE = "docs/your-own-material.md, under 'A distribution, a masking term, a Fresnel kind'"
SAMPLES = {"vec3": (0.36, 0.48, 0.8), "vec2": (0.3, 0.4), "spectrum": (0.2, 0.5, 0.9), "float": (0.6,)}


class MissingFormula(InputError, NotImplementedError):
    """The error for a call of a method that a user-defined part lacks."""


class Part:
    """Base of distributions of normals, masking terms and Fresnel kinds.

    name      the name used in options, scenes and manuals; derived from the class name by default
    formulas  method -> kinds of its arguments, followed by that of its result; `_given` supplies arguments that are not
              values
    """

    name: ClassVar[str] = ""
    formulas: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    def __init_subclass__(cls, **more: object) -> None:
        super().__init_subclass__(**more)
        if "name" not in vars(cls):
            words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__).lower().replace("_", "-")
            cls.name = "" if words.startswith("-") else words

    def missing(self) -> str:
        """The signature of a required method that is not defined, "D(self, m, alpha)"; "" if none is missing."""
        return ""

    def lacks(self, what: str, method: str) -> MissingFormula:
        """The error for a call of a missing method.

        what    what the class has or lacks, for the message, such as "no `D`"
        method  signature of the method to write
        """
        return MissingFormula(f"{type(self).__name__} has {what}", self.place(), f"write {method}; see {GUIDE}")

    def check_formulas(self) -> None:
        """Raise InputError if a formula is missing, cannot run, or returns a wrong type."""
        missing = self.missing()
        if missing:
            raise self.lacks(f"no `{missing.partition('(')[0]}`", missing)
        for method, kinds in self.formulas.items():
            formula = inspect.unwrap(getattr(type(self), method))
            if not formula.__module__.startswith("gonio."):
                self._try(method, kinds)

    def place(self, method: str = "") -> str:
        """FILE:LINE of the class, or of one of its methods; "" if unknown."""
        try:
            thing = inspect.unwrap(getattr(type(self), method)) if method else type(self)
            return f"{inspect.getsourcefile(thing)}:{inspect.getsourcelines(thing)[1]}"
        except (OSError, TypeError):
            return ""

    def _given(self, kind: str) -> object:
        """An argument of a given kind that is not a value, such as a distribution."""
        raise NotImplementedError(kind)

    def _try(self, method: str, kinds: tuple[str, ...]) -> None:
        """Test a formula by recording it, which compiles nothing, or by running it if it uses Dr.Jit directly."""
        formula = inspect.unwrap(getattr(type(self), method)).__get__(self)
        *given, expected = kinds
        names = list(inspect.signature(formula).parameters)[: len(given)]
        try:
            inspect.signature(formula).bind(*given)
        except TypeError as error:
            what = f"{method} of {type(self).__name__}: {error}; it is called with self and {len(given)} arguments"
            raise InputError(what, self.place(method), f"see {GUIDE}") from None
        values = {name: kind for name, kind in zip(names, given, strict=True) if kind in SAMPLES}
        others: dict[str, Value] = {
            name: self._given(kind) for name, kind in zip(names, given, strict=True) if kind not in SAMPLES
        }
        try:
            kind = graph.type_of(graph.record(formula, types=values, name=method, **others).entry.result)
        except ops.ForbiddenOperator as error:
            raise InputError(error.what, error.where, error.hint) from error
        except Exception:
            self._run(method, given)
            return
        if kind not in (expected, "float"):  # one number may serve all channels
            hint = "alpha is a pair: use alpha.x and alpha.y" if kind == "vec2" else "return one value per ray"
            what = f"{method} of {type(self).__name__} returned a {kind}, a {expected} expected"
            raise InputError(what, self.place(method), hint)

    def _run(self, method: str, kinds: list[str]) -> None:
        types = backend.types("float64")
        values = [_sample(kind, types) if kind in SAMPLES else self._given(kind) for kind in kinds]
        try:
            getattr(self, method)(*values)
        except GonioError:
            raise
        except Exception as error:
            hint = f"it must run on Dr.Jit values, with the functions of gonio.ops; see {GUIDE}"
            raise InputError(summary(error), user_line(error) or self.place(method), hint) from error


def _sample(kind: str, types: backend.Types) -> Value:
    value = SAMPLES[kind]
    return types.float([*value] * 2) if kind == "float" else backend.vector_of([value] * 2, len(value), types)
