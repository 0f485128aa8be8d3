"""The base class of shader languages: their differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from ...members import Family, instances_of


class Language:
    """A shader language. The defaults apply to most languages; a subclass overrides those that differ.

    name, title, suffix  name for users, full name, and file suffix
    precision            sentence about precision in the head of a shader
    types                type in a recording -> name of the type in the language, if different
    words                operation -> template; {0}, {1} are replaced by the arguments
    compare              operation -> template of a comparison of vectors; absent if the operators apply to vectors
    choice               templates of `where` for a scalar mask and for a mask per component; {prefix} begins names
    helpers              functions that the templates call: name -> lines, written only if a text needs them
    spread               template that converts a float {1} to a vector type {0}
    spreads              such templates for individual types, if different
    truth                the words for false and true
    swizzles             whether `v.xy` selects several components
    mix                  name of linear interpolation
    native               functions of `gonio.ops` that the language itself provides
    reserved             reserved names
    overloads            whether functions with the same name may differ in their types
    parameters_change    whether a function may assign to a parameter
    struct_literal       whether `Name(a, b)` constructs a struct inside an expression
    array_literal        whether `array` is an expression that is not limited to declarations
    whole_members        whether braces that initialize a struct may contain whole vectors and arrays
    end                  the end of a statement
    single               whether all values are float32
    standalone           whether a text is a self-contained file (`python_file.py`), not part of a program
    groups               whether bindings of tables have groups; the group is then the last argument of `binding`
    methods              whether values have methods in place of operators (`method_writer.py`)
    templates            whether `a < b, c > d` is parsed as template arguments
    tables               the default format of table files, one of `table_files.FORMATS`
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
    helpers: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    spread: ClassVar[str] = "{0}({1})"
    spreads: ClassVar[Mapping[str, str]] = {}
    truth: ClassVar[tuple[str, str]] = ("false", "true")
    swizzles: ClassVar[bool] = True
    mix: ClassVar[str] = "mix"
    native: ClassVar[frozenset[str]] = frozenset({"normalize", "clamp"})
    reserved: ClassVar[frozenset[str]] = frozenset()
    overloads: ClassVar[bool] = True
    parameters_change: ClassVar[bool] = True
    struct_literal: ClassVar[bool] = True
    array_literal: ClassVar[bool] = True
    whole_members: ClassVar[bool] = True
    groups: ClassVar[bool] = False
    end: ClassVar[str] = ";"
    single: ClassVar[bool] = True
    standalone: ClassVar[bool] = False
    methods: ClassVar[bool] = False
    templates: ClassVar[bool] = False
    tables: ClassVar[str] = "raw"

    def type(self, name: str) -> str:
        """The name of a type in the language."""
        return self.types.get(name, name)

    def word(self, name: str) -> str:
        """The name, or a variant of the name that the language does not reserve."""
        return PREFERRED.get(name, name + "_") if name in self.reserved else name

    def array_declaration(self, type_: str, name: str, count: int) -> tuple[str, str]:
        """(type, name) of the declaration of an array."""
        return type_, f"{name}[{count}]"

    def array(self, type_: str, parts: list[str]) -> str:
        """An array of values."""
        return f"{type_}[{len(parts)}]({', '.join(parts)})"

    def signature(self, result: str, name: str, parameters: list[tuple[str, str]]) -> str:
        """The head of a function, with its opening brace; parameters are (type, name)."""
        return f"{result} {name}({', '.join(f'{type_} {p}' for type_, p in parameters)}) {{"

    def local(self, type_: str, name: str, text: str) -> str:
        """The declaration of a local value."""
        return f"{type_} {name} = {text};"

    def changeable(self, line: str) -> str:
        """The declaration of a local value that is reassigned later."""
        return line

    def constant(self, name: str, text: str) -> str:
        """The declaration of a constant."""
        return f"const float {name} = {text};"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        """The declaration of a constant struct."""
        return f"const {type_} {name} = {type_}({', '.join(parts)});"

    def struct(self, name: str, fields: list[tuple[str, str]]) -> list[str]:
        """The lines of a struct with fields (type, name)."""
        return [f"struct {name} {{", *(f"    {type_} {field};" for type_, field in fields), "};"]

    def finished(self, lines: Sequence[str], prefix: str) -> list[str]:
        """The lines of all declarations, wrapped as the language requires; `prefix` begins global names."""
        return list(lines)

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        """The lines that declare a table's texture.

        dimension  2 or 3
        place      number of the binding
        """
        raise NotImplementedError(f"{type(self).__name__} has no binding")

    def fetch(self, table: str, places: list[str]) -> str:
        """The expression that reads a texel, given its index along each axis."""
        raise NotImplementedError(f"{type(self).__name__} has no fetch")

    def texel(self, table: str, places: list[str], channels: int, shape: Sequence[int], prefix: str) -> str:
        """The expression that reads the 1, 2 or 4 channels of a texel, given its index along each axis.

        shape   number of texels along each axis, in the order of `places`
        prefix  prefix of the names of helpers
        """
        return self.fetch(table, places) + {1: ".r", 2: ".rg", 4: ""}[channels]

    def offset(self, end: int, size: int) -> int:
        """The offset of a field of `size` bytes in a uniform buffer, after data that ends at `end`."""
        return end + -end % {4: 4, 8: 8, 12: 16, 16: 16}[size]


Language.family = Family(
    "language", "gonio.languages", ["gonio.shaders.languages"], instances_of(Language), "emit: lang"
)

# substitutes for names that the language reserves
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
