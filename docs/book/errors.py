"""Every error that Gonio raises, with its remedy, read from the source."""

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

A message gives its place, what was given, what is accepted, and a remedy on the line `hint:`. This table is read from
the source: every message that has a remedy, by the package that raises it. Words in *italics* stand for what you gave.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | a verdict of "fails": a law, a tolerance, a baseline |
| 2 | bad usage or input (`InputError`) |
| 3 | a missing resource of the machine (`MachineError`): see `gonio doctor` |
| 128 + n | ended by signal n; 130 is Ctrl-C |
"""
TITLES = {
    "scene": "Scenes", "cli": "The command line", "verify": "Laws", "catalog": "Names and documents",
    "measure": "Measured files",
    "render": "Rendering", "viewer": "The page", "shaders": "Shader code", "instruments": "Instruments",
    "fitting": "Fitting",
    "material": "Materials", "materials": "Materials", "optics": "Optics", "energy": "Tables", "work": "Many processes",
    "transport": "Integrators", "pictures": "Pictures", "bridge": "Mitsuba", "ops": "Arrays",
}  # fmt: skip


class Message(NamedTuple):
    """An error as it stands in the source; text in Markdown."""

    package: str
    what: str
    hint: str


def pages() -> dict[str, str | bytes]:
    """The page of errors."""
    by_title: dict[str, list[Message]] = {}
    for message in dict.fromkeys(messages()):
        by_title.setdefault(TITLES.get(message.package, "General"), []).append(message)
    parts = [HEAD]
    for title in sorted(by_title):
        rows = [(cell(message.what), cell(message.hint)) for message in sorted(by_title[title])]
        parts += [f"## {title}", table(("message", "remedy"), rows)]
    return {"reference/errors/index.md": "\n\n".join(parts) + "\n"}


def messages() -> Iterator[Message]:
    """All errors with a message and a remedy that stand in the source as text."""
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
    """A text in the source as Markdown, its variable parts in italics; "" if it is computed elsewhere."""
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
