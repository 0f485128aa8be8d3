"""Tables as textures: their size and contents, and the functions that read them."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..ops.table import Table
from .names import Names


def axes(table: Table) -> tuple[int, ...]:
    """The texels along x, y, z of a table's texture: the last axis is x; groups of four channels are stacked last."""
    sizes = [*reversed(table.shape)]
    if groups(table) > 1:
        if len(sizes) == 3:
            sizes[2] *= groups(table)
        else:
            sizes.append(groups(table))
    return tuple(sizes if len(sizes) > 1 else [*sizes, 1])


def width(table: Table) -> int:
    """The number of channels of a texel."""
    return table.channels if table.channels in (1, 2) else 4


def groups(table: Table) -> int:
    """The number of texels per entry, each with up to four channels."""
    return -(-table.channels // width(table))


def pixels(table: Table, bits: int = 32) -> np.ndarray:
    """The contents of the texture in upload order (x fastest, channels last), as float32, or as float16 for 16 bits.

    bits  bits per number: 32, or 16 for half precision Raises InputError for numbers that overflow.
    """
    number = np.dtype(f"f{bits // 8}")
    if np.abs(table.values).max(initial=0.0) > np.finfo(number).max:
        what = f"table {table.name} contains {np.abs(table.values).max():g}, which {bits} bits cannot represent"
        raise InputError(what, "emit: half", "write it in 32 bits")
    padded = np.zeros((*table.shape, groups(table) * width(table)))
    padded[..., : table.channels] = table.values
    split = padded.reshape(*table.shape, groups(table), width(table))
    return np.ascontiguousarray(np.moveaxis(split, -2, 0), dtype=number).reshape(*reversed(axes(table)), -1)


def reader(names: Names, table: Table) -> list[str]:
    """The function that interpolates a table linearly between texel centers, clamped outside (`gonio.ops.table`).

    Hardware filtering is too inaccurate, because its weights have eight bits.
    """
    language = names.language
    letters, sizes, lines = _head(names, table, "lookup")
    real, integer = language.type("float"), language.type("int")
    for axis, count in sizes.items():
        at, cell = f"at_{axis}", f"{axis}0"
        for type_, name, text in (
            (real, at, f"clamp({axis} * {count}.0 - 0.5, 0.0, {count - 1}.0)"),
            (integer, cell, f"min({integer}({at}), {max(count - 2, 0)})"),
            (real, f"t_{axis}", f"{at} - {real}({cell})"),
        ):
            lines.append("    " + language.local(type_, name, text))

    def texel(steps: dict[str, int]) -> str:
        return _texel(
            names, table, [f"{axis}0" + (" + 1" if steps[axis] and sizes[axis] > 1 else "") for axis in letters]
        )

    def between(rest: list[str], steps: dict[str, int], indent: str) -> str:
        if not rest:
            return indent + texel(steps)
        axis, *others = rest
        low, high = (between(others, {**steps, axis: step}, indent + "    ") for step in (0, 1))
        return f"{indent}{language.mix}(\n{low},\n{high},\n{indent}    t_{axis})"

    body = between(letters, {}, "    ").strip()
    return [*lines, *f"    return {body};".splitlines(), "}"]


def fetcher(names: Names, table: Table) -> list[str]:
    """The function that reads one texel at integer coordinates, which are clamped (`gonio.ops.fetch`)."""
    language = names.language
    _, sizes, lines = _head(names, table, "fetch")
    integer = language.type("int")
    places = [f"{integer}(clamp({axis}, 0.0, {count - 1}.0))" for axis, count in sizes.items()]
    return [*lines, f"    return {_texel(names, table, places)};", "}"]


READERS = {"lookup": reader, "fetch": fetcher}


def _head(names: Names, table: Table, how: str) -> tuple[list[str], dict[str, int], list[str]]:
    """The names of the axes in the order of a lookup, slowest first; their sizes in texels; the function's first
    line."""
    language = names.language
    letters = list("xyz"[: len(table.shape)])
    channels = width(table)
    real = language.type("float")
    result = real if channels == 1 else language.type(f"vec{channels}")
    parameters = [(real, name) for name in letters] + [(language.type("int"), "group")] * (groups(table) > 1)
    sizes = dict(zip(letters, table.shape, strict=True))
    return letters, sizes, [language.signature(result, names.table(table, f"{how}_"), parameters)]


def _texel(names: Names, table: Table, places: list[str]) -> str:
    """The texel at coordinates along the axes, slowest first."""
    at = places[::-1]
    if groups(table) > 1 and len(at) == 3:
        at[2] = f"group * {table.shape[0]} + {at[2]}"
    elif groups(table) > 1:
        at.append("group")
    elif len(at) == 1:
        at.append("0")
    return names.language.texel(names.table(table, "table_"), at, width(table), axes(table), names.placement.prefix)
