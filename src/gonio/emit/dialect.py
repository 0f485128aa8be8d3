"""A dialect: what tells one shader language from another, as tables.

types       type -> its name in the language
words       operation -> template; {0}, {1} stand for arguments, "(vector)" variants where they differ
reserved    names that the language keeps for itself
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..ops.table import Table

# precedence of what an expression is made of, loosest first
CHOICE, OR, AND, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(9)

OPERATORS = {
    "or": ("||", OR),
    "and": ("&&", AND),
    "eq": ("==", EQUAL),
    "ne": ("!=", EQUAL),
    "lt": ("<", ORDER),
    "le": ("<=", ORDER),
    "gt": (">", ORDER),
    "ge": (">=", ORDER),
    "add": ("+", SUM),
    "sub": ("-", SUM),
    "mul": ("*", PRODUCT),
    "div": ("/", PRODUCT),
}


@dataclass(frozen=True)
class Dialect:
    """A shader language, see the module.

    name, suffix     as users name it, and the ending of its files
    types, words     see the module
    compare          operation -> template of a comparison of vectors; absent where the operators serve
    choice           templates of `where`: of a plain mask, and of a mask of each component
    spread           template of a float, {1}, spread over a vector type, {0}
    splat            whether min, max, where and comparisons want floats spread to vectors
    overloads        whether functions of one name may differ in their types
    floats           what is said of precision in the head of a shader
    parameters_change
                     whether a function may give a parameter a new value
    struct_literal   whether `Name(a, b)` makes a struct inside an expression
    signature, local, constant, struct, binding, fetch, mix
                     how a function's head, a local value, a constant, a struct, a table's declaration, one of its
                     texels and a value between two are written
    """

    name: str
    suffix: str
    types: dict[str, str]
    words: dict[str, str]
    compare: dict[str, str]
    choice: tuple[str, str]
    spread: str
    splat: bool
    overloads: bool
    floats: str
    parameters_change: bool
    struct_literal: bool
    reserved: frozenset[str]
    signature: Callable[[str, str, list[tuple[str, str]]], str]
    local: Callable[[str, str, str], str]
    constant: Callable[[str, str], str]
    struct: Callable[[str, list[tuple[str, str]]], list[str]]
    binding: Callable[[str, int, int], list[str]]
    fetch: Callable[[str, list[str]], str]
    mix: str

    def type(self, name: str) -> str:
        return self.types.get(name, name)

    def word(self, name: str) -> str:
        """A name that the language does not keep for itself."""
        return PREFERRED.get(name, name + "_") if name in self.reserved else name


# helpers of the vocabulary for which all three languages have a word of their own
NATIVE = {"normalize", "clamp"}

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


def literal(number: float) -> str:
    """The shortest decimal that is the same float32."""
    text = repr(number)
    short = np.format_float_positional(np.float32(number), unique=True, trim="0")
    if len(text) > 9 and np.float32(float(text)) == np.float32(number):
        text = short if 1e-4 <= abs(number) < 1e7 else np.format_float_scientific(np.float32(number), trim="0")
    mantissa, e, exponent = text.partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    return mantissa + (f"e{int(exponent)}" if e else "")


def axes(table: Table) -> tuple[int, ...]:
    """Texels along x, y, z of a table's texture: the last axis is x; groups of four channels are stacked last."""
    sizes = [*reversed(table.shape)]
    if groups(table) > 1:
        if len(sizes) == 3:
            sizes[2] *= groups(table)
        else:
            sizes.append(groups(table))
    return tuple(sizes if len(sizes) > 1 else [*sizes, 1])


def width(table: Table) -> int:
    """Channels of a texel."""
    return table.channels if table.channels in (1, 2) else 4


def groups(table: Table) -> int:
    """How many textures' worth of channels."""
    return -(-table.channels // width(table))


def pixels(table: Table) -> np.ndarray:
    """The texture's contents in the order of upload, x fastest, channels last; float32."""
    padded = np.zeros((*table.shape, groups(table) * width(table)))
    padded[..., : table.channels] = table.values
    split = padded.reshape(*table.shape, groups(table), width(table))
    return np.ascontiguousarray(np.moveaxis(split, -2, 0), dtype=np.float32).reshape(*reversed(axes(table)), -1)


def reader(dialect: Dialect, table: Table) -> list[str]:
    """The function that reads a table: linear in each axis between texel centres, held outside (`gonio.ops.table`).

    A shader's own filtering would not do: its weights have eight bits.
    """
    names = list("xyz"[: len(table.shape)])  # in the order of a lookup, slowest axis first
    sizes = dict(zip(names, table.shape, strict=True))
    many = groups(table) > 1
    channels = width(table)
    real, whole = dialect.type("float"), dialect.type("int")
    result = real if channels == 1 else dialect.type(f"vec{channels}")
    parameters = [(real, name) for name in names] + [(whole, "group")] * many
    lines = [dialect.signature(result, f"lookup_{table.name}", parameters)]
    for axis, count in sizes.items():
        at, cell = f"at_{axis}", f"{axis}0"
        for type_, name, text in (
            (real, at, f"clamp({axis} * {count}.0 - 0.5, 0.0, {count - 1}.0)"),
            (whole, cell, f"min({whole}({at}), {max(count - 2, 0)})"),
            (real, f"t_{axis}", f"{at} - {real}({cell})"),
        ):
            lines.append("    " + dialect.local(type_, name, text))

    def texel(steps: dict[str, int]) -> str:
        places = [f"{axis}0" + (" + 1" if steps[axis] and sizes[axis] > 1 else "") for axis in reversed(names)]
        if many and len(places) == 3:
            places[2] = f"group * {sizes[names[0]]} + {places[2]}"
        elif many:
            places.append("group")
        elif len(places) == 1:
            places.append("0")
        return dialect.fetch(f"table_{table.name}", places) + {1: ".r", 2: ".rg", 4: ""}[channels]

    def between(rest: list[str], steps: dict[str, int], indent: str) -> str:
        if not rest:
            return indent + texel(steps)
        axis, *others = rest
        low, high = (between(others, {**steps, axis: step}, indent + "    ") for step in (0, 1))
        return f"{indent}{dialect.mix}(\n{low},\n{high},\n{indent}    t_{axis})"

    body = between(names, {}, "    ").strip()
    return [*lines, *f"    return {body};".splitlines(), "}"]
