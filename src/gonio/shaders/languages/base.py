"""What a shader language is: what tells one from another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...members import Family, instances_of


class Language:
    """A shader language. What stands here is what most languages say; a language changes what it says otherwise.

    name, title, suffix  as users name it, its full name, and the ending of its files
    precision            what is said of precision in the head of a shader
    types                type of a recording -> its name in the language, where that is another
    words                operation -> template; {0}, {1} stand for the arguments
    compare              operation -> template of a comparison of vectors; absent where the operators serve
    choice               templates of `where`: of a plain mask, and of a mask of each component
    spread               template of a float, {1}, spread over a vector type, {0}
    mix                  the word for a value between two
    native               functions of the vocabulary for which the language has a word of its own
    reserved             names that the language keeps for itself
    overloads            whether functions of one name may differ in their types
    parameters_change    whether a function may give a parameter a new value
    struct_literal       whether `Name(a, b)` makes a struct inside an expression
    templates            whether `a < b, c > d` is read as a template's arguments
    """

    family: ClassVar[Family[Language]]

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    suffix: ClassVar[str] = ""
    precision: ClassVar[str] = ""
    types: ClassVar[Mapping[str, str]] = {}
    words: ClassVar[Mapping[str, str]] = {
        "sqrt": "sqrt({0})",
        "abs": "abs({0})",
        "minimum": "min({0}, {1})",
        "maximum": "max({0}, {1})",
        "exp": "exp({0})",
        "log": "log({0})",
        "sin": "sin({0})",
        "cos": "cos({0})",
        "atan2": "atan2({0}, {1})",
        "floor": "floor({0})",
        "dot": "dot({0}, {1})",
        "integer": "int({0})",
    }
    compare: ClassVar[Mapping[str, str]] = {}
    choice: ClassVar[tuple[str, str]] = ("{0} ? {1} : {2}", "{0} ? {1} : {2}")
    spread: ClassVar[str] = "{0}({1})"
    mix: ClassVar[str] = "mix"
    native: ClassVar[frozenset[str]] = frozenset({"normalize", "clamp"})
    reserved: ClassVar[frozenset[str]] = frozenset()
    overloads: ClassVar[bool] = True
    parameters_change: ClassVar[bool] = True
    struct_literal: ClassVar[bool] = True
    templates: ClassVar[bool] = False

    def type(self, name: str) -> str:
        """A type's name in the language."""
        return self.types.get(name, name)

    def word(self, name: str) -> str:
        """A name that the language does not keep for itself."""
        return PREFERRED.get(name, name + "_") if name in self.reserved else name

    def signature(self, result: str, name: str, parameters: list[tuple[str, str]]) -> str:
        """A function's head, with its opening brace; parameters are (type, name)."""
        return f"{result} {name}({', '.join(f'{type_} {p}' for type_, p in parameters)}) {{"

    def local(self, type_: str, name: str, text: str) -> str:
        """A local value."""
        return f"{type_} {name} = {text};"

    def changeable(self, line: str) -> str:
        """The line of a local value that is given another value later."""
        return line

    def constant(self, name: str, text: str) -> str:
        """A constant of the shader."""
        return f"const float {name} = {text};"

    def struct(self, name: str, fields: list[tuple[str, str]]) -> list[str]:
        """A struct with its fields, (type, name), a line each."""
        return [f"struct {name} {{", *(f"    {type_} {field};" for type_, field in fields), "};"]

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        """The declaration of a table's texture."""
        raise NotImplementedError(f"{type(self).__name__} has no binding")

    def fetch(self, table: str, places: list[str]) -> str:
        """A texel by its place along each axis."""
        raise NotImplementedError(f"{type(self).__name__} has no fetch")

    def offset(self, end: int, size: int) -> int:
        """Where a field of that many bytes begins in a uniform buffer, after what ends at `end`."""
        return end + -end % {4: 4, 8: 8, 12: 16, 16: 16}[size]


Language.family = Family(
    "language", "gonio.languages", ["gonio.shaders.languages"], instances_of(Language), "emit: lang"
)

# what a name becomes where the language keeps it for itself
PREFERRED = {
    "log": "ln",
    "sin": "sine",
    "cos": "cosine",
    "mix": "mixed",
    "reflect": "reflect_at",
    "refract": "refract_at",
    "pow": "power",
    "smooth": "is_smooth",
    "self": "material",
}
