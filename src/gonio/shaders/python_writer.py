"""A routine as a Python function: the same expressions as in the shader languages, with Python's operators."""

from __future__ import annotations

from .layout import COLUMNS, INDENT, wrap
from .routine import RoutineWriter
from .syntax import ATOM, OPERATORS, ORDER, SUM
from .values import COMPARE, Value

MASKS = {"and": "&", "or": "|"}


class PythonWriter(RoutineWriter):
    """Writes one routine as a Python function."""

    def text(self) -> list[str]:
        body = self.body()
        return [*wrap(self.head(), ""), *docstring(self.doc().strip().splitlines()), *body]

    def wrapped(self, line: str) -> list[str]:
        """A statement, in parentheses if it needs several lines."""
        if len(INDENT + line) <= COLUMNS:
            return [INDENT + line]
        if line.startswith("return "):
            start, text = "return", line.removeprefix("return ")
        else:
            name, _, text = line.partition(" = ")
            start = f"{name} ="
        return [f"{INDENT}{start} (", *wrap(text, 2 * INDENT), f"{INDENT})"]

    def infix(self, value: Value) -> tuple[str, int]:
        """Comparisons have lower precedence than & and | in Python and are therefore parenthesized as their
        operands."""
        a, b = value.args
        symbol = OPERATORS[value.op][0]
        if value.op in COMPARE:
            return f"{self.part(a, SUM)} {symbol} {self.part(b, SUM)}", ORDER
        if value.op in MASKS:
            return f" {MASKS[value.op]} ".join(self.mask(x, value.op) for x in value.args), ORDER
        return super().infix(value)

    def mask(self, value: Value, op: str) -> str:
        """An operand of & or |."""
        text, level = self.expression(value)
        chained = value.op == op and value.order not in self.locals
        return text if level == ATOM or chained else f"({text})"

    def compose(self, value: Value) -> tuple[str, int]:
        if value.op == "not":
            return f"~{self.part(value.args[0], ATOM)}", ATOM
        if value.op == "constant" and isinstance(value.static, bool):
            return str(value.static), ATOM
        return super().compose(value)

    def texel(self, value: Value) -> str:
        table, group, how = value.static
        return (
            f"{how}({self.names.table(table, 'table_')}[{group}], {', '.join(map(self.unparenthesized, value.args))})"
        )


def docstring(doc: list[str]) -> list[str]:
    """A comment as the docstring of a function."""
    if not doc:
        return []
    lines = [line.replace("\\", "\\\\") for line in doc]
    if len(lines) == 1:
        return [f'{INDENT}"""{lines[0]}"""']
    return [f'{INDENT}"""{lines[0]}', *(f"{INDENT}{line}".rstrip() for line in lines[1:]), f'{INDENT}"""']
