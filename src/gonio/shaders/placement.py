"""The place of a shader in a module with other code: a prefix of its names, and the bindings of its tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TypedDict

from ..errors import InputError
from .languages import Language

LOCATION = "emit"


class PlacementKeywords(TypedDict, total=False):
    """The types of `Placement` as keywords."""

    prefix: str
    group: int
    first_binding: int


@dataclass(frozen=True)
class Placement:
    """The place of a shader in a module.

    prefix         begins all global names: functions, structs, constants, tables
    group          of the tables' bindings: WGSL's `@group`, HLSL's register space, a descriptor set
    first_binding  number of the first table's binding
    """

    prefix: str = ""
    group: int = 0
    first_binding: int = 0

    def check(self, language: Language) -> None:
        """Raise InputError for a prefix or a group that the language does not accept."""
        start = self.prefix
        if start and (not re.fullmatch(r"[A-Za-z]\w*", start, re.ASCII) or "__" in start or start.startswith("gl_")):
            hint = "a letter, then letters, digits and single underscores, such as g_; not gl_, which GLSL reserves"
            raise InputError(f"'{start}' given, the start of a name expected", f"{LOCATION}: prefix", hint)
        for name, number in (("group", self.group), ("first_binding", self.first_binding)):
            if isinstance(number, bool) or not isinstance(number, int) or number < 0:
                raise InputError(f"{number!r} given, a whole number >= 0 expected", f"{LOCATION}: {name}")
        if self.group and not language.groups:
            what = f"group {self.group} given, and {language.title or language.name} has no groups of bindings"
            raise InputError(what, f"{LOCATION}: group", "leave it out, or choose wgsl, hlsl, slang or glsl-vulkan")
