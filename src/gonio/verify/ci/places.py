"""The place of a verdict in a source file, its level and its texts, as used by all formats."""

from __future__ import annotations

import ast
import os
import re
from pathlib import Path
from typing import Any, NamedTuple

from ...catalog import shaders
from ...errors import GonioError
from ..verdict import DECLARED, FAIL, NOT_TRIED, Card, Unread, Verdict

_CLASS = re.compile(r"(?P<file>[^({=,\s]+\.py):(?P<name>\w[\w-]*)")
_LINE = re.compile(r"\((?P<file>[^()\s:]+\.py):(?P<line>\d+)\)")


_SLIGHT = ("invisible", "noise", "fitting only")  # grades that bias no picture


class Place(NamedTuple):
    """A file, as its path in the repository ("materials/glass.py"), and a line in it."""

    file: str
    line: int


def of(card: Card, verdict: Verdict | None = None) -> Place | None:
    """The line stated in the reasons of a verdict or, if there is none, the first line of the class; None if the target
    is not in a file."""
    named = _CLASS.search(card.subject.target) or next(filter(None, map(_CLASS.search, _settings(card))), None)
    if named is None:
        file = Path(card.subject.target)
        if (shader := shaders.file_in(card.subject.target)) is not None:
            return Place(_relative(shader), _function_line(shaders.head_in(card.subject.target)))
        known = file.suffix.lower() in (".json", ".xml", ".bsdf") and file.is_file()
        return Place(_relative(file), 1) if known else None
    file = Path(os.path.expanduser(named["file"]))
    for text in verdict.why if verdict else ():
        for match in _LINE.finditer(text):
            if match["file"] == file.name:
                return Place(_relative(file), int(match["line"]))
    return Place(_relative(file), _class_line(file, named["name"]))


def of_unread(unread: Unread) -> Place | None:
    """The line stated in an error or, if there is none, the first line of the shader's file."""
    file = shaders.file_in(unread.target)
    if file is None:
        return None
    line = re.fullmatch(rf"(?:.*[/\\])?{re.escape(file.name)}:(\d+).*", unread.where)
    return Place(_relative(file), int(line[1]) if line else 1)


def level(verdict: Verdict) -> str:
    """ "error" for a failure, "warning" for a failure that is not visible in pictures, "note" for a declared or known
    violation or a law that was not tried; otherwise "none"."""
    if verdict.status == FAIL:
        return "warning" if grade(verdict) in _SLIGHT else "error"
    return "note" if verdict.excused or verdict.status in (DECLARED, NOT_TRIED) else "none"


def grade(verdict: Verdict) -> str:
    """The severity of a failure in one word; "" if it is unknown."""
    return str(getattr(verdict, "grade", "") or "")


def cause(verdict: Verdict) -> str:
    """The probable mistake that caused a failure; "" if none is known."""
    return str(getattr(verdict, "cause", "") or "")


def words(verdict: Verdict) -> list[str]:
    """The failure, its consequence, and the command that repeats the test, one line each."""
    lines = list(verdict.why) or ([verdict.notes[0]] if verdict.notes else [])
    for name, text in (
        ("probable cause", cause(verdict)),
        ("grade", grade(verdict)),
        ("worst case", verdict.worst),
        ("consequence", verdict.meaning),
        ("reproduce", verdict.command),
    ):
        if text:
            lines.append(f"{name}: {text}")
    return lines


def _settings(card: Card) -> list[str]:
    return [str(value) for value in card.subject.settings.values()]


def _relative(file: Path) -> str:
    """The path relative to the root of the repository, if CI defines it, or to the current folder; the absolute path
    for files outside of both."""
    path = file.absolute()
    root = Path(os.environ.get("GITHUB_WORKSPACE") or Path.cwd())
    for base in (root, Path.cwd()):
        if path.resolve().is_relative_to(base.resolve()):
            return path.resolve().relative_to(base.resolve()).as_posix()
    return path.as_posix()


def _function_line(shader: str) -> int:
    """The line on which the BRDF of a shader begins; 1 if it is in another file."""
    try:
        cls: Any = shaders.class_of(shader)
        name = cls.program.adapter.function
        text = Path(os.path.expanduser(shaders.parted(shader)[0])).read_text(encoding="utf-8", errors="replace")
    except (GonioError, OSError):
        return 1
    lines = enumerate(text.splitlines(), 1)
    return next((number for number, line in lines if re.search(rf"\b{re.escape(name)}\s*\(", line)), 1)


def _class_line(file: Path, name: str) -> int:
    """The line on which a class begins, without running the file."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return 1
    return next((n.lineno for n in ast.walk(tree) if isinstance(n, ast.ClassDef) and n.name == name), 1)


__all__ = ["Place", "cause", "grade", "level", "of", "of_unread", "words"]
