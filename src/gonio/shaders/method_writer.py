"""Routines in languages without operators, in which a + b is written `a.add(b)` and tables are functions of nodes."""

from __future__ import annotations

from ..ops.table import Table
from .names import Names
from .routine import RoutineWriter
from .syntax import ATOM
from .textures import groups, width
from .values import Value

METHODS = {
    "or": "or",
    "and": "and",
    "eq": "equal",
    "ne": "notEqual",
    "lt": "lessThan",
    "le": "lessThanEqual",
    "gt": "greaterThan",
    "ge": "greaterThanEqual",
    "add": "add",
    "sub": "sub",
    "mul": "mul",
    "div": "div",
}


class MethodWriter(RoutineWriter):
    """Writes one routine with methods in place of operators; every number is a node."""

    def infix(self, value: Value) -> tuple[str, int]:
        left, right = value.args
        texts = [self.part(left, ATOM), self.expression(right)[0]]
        if value.type.startswith("bvec"):
            texts = [self.splat(x, "vec" + value.type[-1], ATOM) for x in value.args]
        return f"{texts[0]}.{METHODS[value.op]}({texts[1]})", ATOM

    def compose(self, value: Value) -> tuple[str, int]:
        if value.op in ("neg", "not"):
            return f"{self.part(value.args[0], ATOM)}.{'negate' if value.op == 'neg' else 'not'}()", ATOM
        return super().compose(value)

    def choice(self, value: Value) -> tuple[str, int]:
        mask = value.args[0]
        parts = [self.expression(mask)[0], *(self.splat(x, value.type) for x in value.args[1:])]
        vector = mask.type.startswith("bvec")
        name = self.names.placement.prefix + f"choose{mask.type[-1]}" if vector else "select"
        return f"{name}({', '.join(parts)})", ATOM

    def constant(self, value: Value) -> tuple[str, int]:
        if value.type == "bool":
            return f"bool({'true' if value.static else 'false'})", ATOM
        text, level = super().constant(value)
        plain = text.lstrip("-")
        if value.type == "float" and plain[0].isdigit():
            return f"float({text})", ATOM
        if value.type == "float" and text.startswith("-"):
            return f"{plain}.negate()", ATOM
        return text, ATOM if text.endswith(")") else level


INTERPOLATED = """
// Linear between texel centers, clamped outside; places along the axes, slowest first.
const {name} = (sizes, places, texel) => {{
    const at = places.map((x, i) => clamp(x.mul(float(sizes[i])).sub(float(0.5)), float(0), float(sizes[i] - 1)));
    const cells = at.map((x, i) => min(floor(x), float(Math.max(sizes[i] - 2, 0))));
    const read = (cell) => {{
        const i = cell.length;
        if (i === sizes.length) return texel(cell.map((x) => int(x)));
        const next = min(cells[i].add(float(1)), float(sizes[i] - 1));
        return mix(read([...cell, cells[i]]), read([...cell, next]), at[i].sub(cells[i]));
    }};
    return read([]);
}};
"""


def readers(names: Names, table: Table, readings: list[str]) -> list[str]:
    """The functions that read a table for `lookup` and `fetch`."""
    axes = range(len(table.shape))
    letters = [*"xyz"[: len(axes)]]
    cells = [f"cell[{axis}]" for axis in axes]
    at = cells[::-1]
    if groups(table) > 1 and len(at) == 3:
        at[2] = f"int(group * {table.shape[0]}).add({at[2]})"
    elif groups(table) > 1:
        at.append("int(group)")
    elif len(at) == 1:
        at.append("int(0)")
    texel = names.language.fetch(names.table(table, "table_"), at) + {1: ".x", 2: ".xy", 4: ""}[width(table)]
    more = ", group" if groups(table) > 1 else ""
    lines = []
    for how in readings:
        lines += ["", f"const {names.table(table, f'{how}_')} = ({', '.join(letters)}{more}) => {{"]
        lines.append(f"    const texel = (cell) => {texel};")
        if how == "lookup":
            interpolated = f"{names.placement.prefix}interpolated"
            lines.append(f"    return {interpolated}({list(table.shape)}, [{', '.join(letters)}], texel);")
        else:
            bounds = zip(letters, table.shape, strict=True)
            clamped = ", ".join(f"int(clamp({x}, float(0), float({count - 1})))" for x, count in bounds)
            lines.append(f"    return texel([{clamped}]);")
        lines.append("};")
    return lines[1:]
