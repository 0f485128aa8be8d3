"""Names in the Python source that are not in the recording: those of constants and of small helper functions."""

from __future__ import annotations

import ast
import functools
import linecache
import sys
from pathlib import Path


@functools.cache
def module_constant(number: float, source: str) -> tuple[str, str]:
    """(name, comment) of the module's constant with this value, if the line uses it; else ("", "").

    source  the line, "file:line"
    """
    path, _, line = source.rpartition(":")
    text = linecache.getline(path, int(line or 0))
    words = {word for word in "".join(c if c.isalnum() or c == "_" else " " for c in text).split() if word.isupper()}
    for name in words if number not in (0.0, 1.0) else ():
        for module in sorted(sys.modules.values(), key=lambda m: getattr(m, "__file__", None) != path):  # own first
            place = getattr(module, "__file__", None) or ""
            if place.startswith(_PACKAGE) and type(vars(module).get(name)) is float and vars(module)[name] == number:
                about = _comment_on(place, name)
                if about is not None:
                    return name.strip("_"), about
    return "", ""


_PACKAGE = str(Path(__file__).parent.parent)


def _comment_on(path: str, name: str) -> str | None:
    """The comment on a constant at its definition, above or after it; None if the constant is only imported there."""
    lines = linecache.getlines(path)
    for index, line in enumerate(lines):
        if line.startswith(f"{name} ="):
            after = line.partition("#")[2].strip()
            above: list[str] = []
            while not after and index > 0 and lines[index - 1].startswith("#"):
                index -= 1
                above.insert(0, lines[index].lstrip("# ").rstrip())
            return after or " ".join(above)
    return None


def returned_by(op: str, source: str, own: str) -> str:
    """The name of the plain function that returned a value, if it was recorded as part of another function; else "".

    source  the line that wrote the value, "file:line"
    own     the line of the function that contains it
    """
    path, _, line = source.rpartition(":")
    for function, statement in _returns(path) if path.startswith(_PACKAGE) else ():
        if statement.lineno <= int(line) <= (statement.end_lineno or 0) and _makes(statement.value, op):
            first = min([function.lineno, *(d.lineno for d in function.decorator_list)])
            return "" if own == f"{path}:{first}" else function.name.strip("_")
    return ""


@functools.cache
def _returns(path: str) -> list[tuple[ast.FunctionDef, ast.Return]]:
    tree = ast.parse("".join(linecache.getlines(path)))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return [(f, node) for f in functions for node in ast.walk(f) if isinstance(node, ast.Return)]


_OPERATORS: dict[type, str] = {
    ast.BitAnd: "and",
    ast.BitOr: "or",
    ast.Add: "add",
    ast.Sub: "sub",
    ast.Mult: "mul",
    ast.Div: "div",
}


def _makes(expression: object, op: str) -> bool:
    """Whether the outermost operation of an expression is `op`."""
    if isinstance(expression, ast.BinOp):
        return _OPERATORS.get(type(expression.op)) == op
    return isinstance(expression, ast.Call) and isinstance(expression.func, ast.Name) and expression.func.id == op
