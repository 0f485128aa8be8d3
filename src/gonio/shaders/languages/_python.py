"""The base of the languages that write a material as a self-contained Python file."""

from __future__ import annotations

import builtins
import keyword
from collections.abc import Mapping
from typing import ClassVar

from .base import Language

# names of the file's own functions, which local values must not shadow
_OWN = """
    Vector vec2 vec3 vec4 dot mean max_component where sqrt exp log sin cos atan2 floor erf copysign isfinite minimum
    maximum lookup fetch np torch jax jnp math base64 zlib itertools NamedTuple DEFAULTS
"""


class Python(Language):
    """A Python file; `imports` provides the functions of its array library under the names used in `gonio.ops`."""

    suffix = ".py"
    standalone = True
    end = ""
    single = False
    overloads = False
    native = frozenset()
    imports: ClassVar[str] = ""
    decorator: ClassVar[str] = ""  # decorator of the public functions
    choice = ("where({0}, {1}, {2})", "where({0}, {1}, {2})")
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "abs": "abs({0})",
        "minimum": "minimum({0}, {1})",
        "maximum": "maximum({0}, {1})",
        "mean": "mean({0})",
        "max_component": "max_component({0})",
        "erf": "erf({0})",
        "copysign": "copysign({0}, {1})",
        "isfinite": "isfinite({0})",
    }
    reserved = frozenset([*keyword.kwlist, *dir(builtins), *_OWN.split()])

    def array_declaration(self, type_: str, name: str, count: int) -> tuple[str, str]:
        return type_, name

    def array(self, type_: str, parts: list[str]) -> str:
        return f"({', '.join(parts)})"

    def signature(self, result: str, name: str, parameters: list[tuple[str, str]]) -> str:
        return f"def {name}({', '.join(p for _, p in parameters)}):"

    def local(self, type_: str, name: str, text: str) -> str:
        return f"{name} = {text}"

    def constant(self, name: str, text: str) -> str:
        return f"{name} = {text}"

    def struct(self, name: str, fields: list[tuple[str, str]]) -> list[str]:
        return [f"class {name}(NamedTuple):", *(f"    {field}: object" for _, field in fields)]
