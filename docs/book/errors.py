"""A page that lists all errors that Gonio raises, with their remedies, read from the source code."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from .text import cell, escaped, table

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src/gonio"
KINDS = ("InputError", "MachineError", "GonioWarning")

HEAD = """# Troubleshooting

An error message states where the error is, what was given, what is accepted and, on a line that starts with `hint:`,
what to do. The following tables are generated from the source code. They list all messages that have a hint, grouped by
the part of Gonio that raises them. Words in *italics* are placeholders for values that depend on your input.

| exit code | meaning |
|---|---|
| 0 | success |
| 1 | a failed check: a law is violated, a tolerance is exceeded, or a result differs from its baseline |
| 2 | bad usage or input (`InputError`) |
| 3 | a resource that the machine lacks (`MachineError`): see `gonio doctor` |
| 4 | laws are violated, but all violations are too small to be visible in pictures |
| 128 + n | termination by signal n (130: Ctrl-C) |
"""
TITLES = {
    "scene": "Scenes", "cli": "The command line", "verify": "Laws", "catalog": "Names and documents",
    "measure": "Measured files",
    "render": "Rendering", "viewer": "The viewer", "shaders": "Shader code", "instruments": "Instruments",
    "fitting": "Fitting",
    "material": "Materials", "materials": "Materials", "optics": "Optics", "energy": "Tables", "work": "Processes",
    "transport": "Integrators", "pictures": "Pictures", "bridge": "Mitsuba", "ops": "Arrays",
}  # fmt: skip


class Message(NamedTuple):
    """An error message in the source code, as Markdown."""

    package: str
    what: str
    hint: str


def pages() -> dict[str, str | bytes]:
    """The page that lists the errors."""
    by_title: dict[str, list[Message]] = {}
    for message in dict.fromkeys(messages()):
        by_title.setdefault(TITLES.get(message.package, "General"), []).append(message)
    parts = [HEAD]
    for title in sorted(by_title):
        rows = [(cell(message.what), cell(message.hint)) for message in sorted(by_title[title])]
        parts += [f"## {title}", table(("message", "remedy"), rows)]
    return {"reference/errors/index.md": "\n\n".join(parts) + "\n"}


def messages() -> Iterator[Message]:
    """All errors whose message and remedy are literal strings in the source code."""
    for path in sorted(SOURCE.rglob("*.py")):
        package = path.relative_to(SOURCE).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in KINDS:
                what, hint = _argument(node, 0, "what"), _argument(node, 2, "hint")
                if what and hint:
                    yield Message(package, what, hint)


def _argument(call: ast.Call, at: int, name: str) -> str:
    for keyword in call.keywords:
        if keyword.arg == name:
            return _text(keyword.value)
    return _text(call.args[at]) if len(call.args) > at else ""


def _text(node: ast.expr) -> str:
    """A string in the source code as Markdown, with variable parts in italics; "" if it is computed elsewhere."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return escaped(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(
            escaped(str(part.value)) if isinstance(part, ast.Constant) else _placeholder(part) for part in node.values
        )
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "did_you_mean":
        return "the nearest known name, or the list of names"
    return ""


def _placeholder(part: ast.expr) -> str:
    value = part.value if isinstance(part, ast.FormattedValue) else part
    name = next((node.attr for node in ast.walk(value) if isinstance(node, ast.Attribute)), "")
    if isinstance(value, ast.Name):
        name = value.id
    return f"*{(name or 'value').strip('_').replace('_', ' ')}*"
