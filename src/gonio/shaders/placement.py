"""Options for combining a shader with other code: the prefix of its names, the bindings and files of its tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TypedDict

from ..errors import InputError, did_you_mean
from .languages import Language
from .table_files import CHOICES, FORMATS

LOCATION = "emit"


class PlacementKeywords(TypedDict, total=False):
    """The types of `Placement` as keywords."""

    prefix: str
    group: int
    first_binding: int
    tables: str
    half: bool


@dataclass(frozen=True)
class Placement:
    """Options for combining a shader with other code.

    prefix         prefix of all global names: functions, structs, constants, tables
    group          binding group of the tables: WGSL's `@group`, HLSL's register space, a descriptor set
    first_binding  binding number of the first table
    tables         format of the table files: "raw", "exr" or "ktx2"; "" is the language's default, mostly "raw"
    half           whether tables have 16 bits per number
    """

    prefix: str = ""
    group: int = 0
    first_binding: int = 0
    tables: str = ""
    half: bool = False

    def check(self, language: Language) -> None:
        """Raise InputError for a prefix, a group or a table format that the language does not accept."""
        start = self.prefix
        if start and (not re.fullmatch(r"[A-Za-z]\w*", start, re.ASCII) or "__" in start or start.startswith("gl_")):
            hint = "a letter, then letters, digits and single underscores, such as g_; not gl_, which GLSL reserves"
            raise InputError(f"'{start}' given, the start of a name expected", f"{LOCATION}: prefix", hint)
        for name, number in (("group", self.group), ("first_binding", self.first_binding)):
            if isinstance(number, bool) or not isinstance(number, int) or number < 0:
                raise InputError(f"{number!r} given, a whole number >= 0 expected", f"{LOCATION}: {name}")
        if self.group and not language.groups:
            what = f"group {self.group} given, but {language.title or language.name} has no groups of bindings"
            raise InputError(what, f"{LOCATION}: group", "leave it out, or choose wgsl, hlsl, slang or glsl-vulkan")
        if self.tables and self.tables not in CHOICES:
            raise InputError(
                f"unknown format '{self.tables}'", f"{LOCATION}: tables", did_you_mean(self.tables, CHOICES)
            )
        if self.tables and language.tables not in CHOICES:
            what = f"{self.tables} given, but {language.title or language.name} reads tables in its own format"
            raise InputError(what, f"{LOCATION}: tables", "leave it out")

    def form(self, language: Language) -> str:
        """The name of the format of table files."""
        return self.tables or language.tables

    def suffix(self, language: Language) -> str:
        """The suffix of the names of table files."""
        form = self.form(language)
        return ".f16" if self.half and form == "raw" else FORMATS[form].suffix

    @property
    def bits(self) -> int:
        """The number of bits of a number in a table."""
        return 16 if self.half else 32
