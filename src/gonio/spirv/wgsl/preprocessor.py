"""Bevy's directives in a WGSL text: #ifdef and related directives, #define, #import and #define_import_path.

    #import bevy_pbr::lighting as lighting
    #import bevy_pbr::{utils::PI, pbr_types::{A, B as C}}

Omitted lines are replaced by empty lines, so that line numbers are preserved.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..values import refuse

MAX_DEPTH = 64  # depth of nested conditions
_DIRECTIVE = re.compile(r"\s*#\s*([a-z_]+)\b(.*)", re.DOTALL)
_VALUE = re.compile(r"#\{(\w+)\}|#([A-Z]\w*)")
_PATH = re.compile(r'"[^"\n]+"(?:::\w+)*|\w+(?:::\w+)*')
_ORDERS: dict[str, Callable[[Any, Any], Any]] = {
    "==": operator.eq, "!=": operator.ne, ">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le,
}  # fmt: skip


@dataclass
class Preprocessed:
    """The text after preprocessing.

    path      the path under which other files import it; "" if it has none
    imports   name in this file -> path
    lines     name in this file -> line of its import
    """

    text: str = ""
    path: str = ""
    imports: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)


class _Conditions:
    """The conditions around a line: for each, whether its branch is active, and whether an earlier branch was
    active."""

    def __init__(self, defines: dict[str, str]) -> None:
        self.defines = defines
        self.stack: list[tuple[bool, bool]] = []

    def hold(self) -> bool:
        return all(now for now, _ in self.stack)

    def take(self, word: str, rest: str, place: str) -> bool:
        """Process a directive if it is a condition, and return whether it is one."""
        if word in ("ifdef", "ifndef", "if"):
            if len(self.stack) >= MAX_DEPTH:
                raise refuse(f"more than {MAX_DEPTH} nested #if", "", place)
            now = self.test(word, rest, place)
            self.stack.append((now, now))
        elif word == "else":
            if not self.stack:
                raise refuse("#else without #ifdef", "", place)
            _, before = self.stack.pop()
            inner = re.match(r"(ifdef|ifndef|if)\b(.*)", rest, re.DOTALL)
            now = not before and (self.test(inner[1], inner[2].strip(), place) if inner else True)
            self.stack.append((now, before or now))
        elif word == "endif":
            if not self.stack:
                raise refuse("#endif without #ifdef", "", place)
            self.stack.pop()
        else:
            return False
        return True

    def test(self, word: str, rest: str, place: str) -> bool:
        if word == "if":
            match = re.fullmatch(r"(\w+)\s*(==|!=|>=|<=|>|<)\s*(-?\w+)", rest)
            if match is None:
                raise refuse(f"#if {rest[:40]} is not supported", "write #if NAME == VALUE", place)
            if match[1] not in self.defines:
                return False
            given = (self.defines[match[1]], match[3])
            if all(re.fullmatch(r"-?\d{1,18}", one) for one in given):
                return bool(_ORDERS[match[2]](*map(int, given)))
            return match[2] in ("==", "!=") and bool(_ORDERS[match[2]](*given))
        return (rest.split("//")[0].strip() in self.defines) == (word == "ifdef")


def preprocessed(text: str, where: str, defines: Mapping[str, str]) -> Preprocessed:
    """The text after its directives have been processed. Raises InputError, with file and line."""
    if "#" not in text:
        return Preprocessed(text)
    known, result = dict(defines), Preprocessed()
    conditions, lines, pending, start = _Conditions(known), [], "", 0
    for number, line in enumerate(text.split("\n"), 1):
        place, expanded = f"{where}:{number}", ""
        match = _DIRECTIVE.match(line)
        if pending:
            pending += " " + line.split("//")[0]
        elif (match and conditions.take(match[1], match[2].strip(), place)) or not conditions.hold():
            pass
        elif match is not None and match[1] == "import":
            pending, start = match[2].split("//")[0], number
        elif match is not None:
            _other(match[1], match[2].split("//")[0].strip(), known, result, place)
        else:
            expanded = _expanded(line, known, place) if "#" in line else line
        if pending and pending.count("{") <= pending.count("}"):
            _add(result, pending, start, f"{where}:{start}")
            pending = ""
        lines.append(expanded)
    if pending or conditions.stack:
        raise refuse("a directive is not closed", "add #endif or }", f"{where}:{start or len(lines)}")
    result.text = "\n".join(lines)
    return result


def _other(word: str, rest: str, defines: dict[str, str], result: Preprocessed, place: str) -> None:
    if word == "define_import_path":
        result.path = rest
    elif word == "define":
        name, _, value = rest.partition(" ")
        defines[name] = value.strip()
    else:
        known = "#import, #define, #ifdef, #ifndef, #if, #else, #endif, #define_import_path"
        raise refuse(f"unknown directive #{word}", f"known: {known}", place)


def _expanded(line: str, defines: Mapping[str, str], place: str) -> str:
    """A line with #NAME replaced by its value; comments, in which a # may be part of a URL, are unchanged."""
    code, slashes, comment = line.partition("//")
    return _VALUE.sub(lambda one: _value(one, defines, place), code) + slashes + comment


def _value(match: re.Match[str], defines: Mapping[str, str], place: str) -> str:
    name = match[1] or match[2]
    if name not in defines:
        raise refuse(f"#{{{name}}} has no value", f"defines = {{ {name} = '...' }} in the adapter", place)
    return defines[name]


def _add(result: Preprocessed, text: str, line: int, place: str) -> None:
    """Add the names of an #import."""
    listed = re.fullmatch(r"\s*([\w:]+)\s+(?!as\b)(\w+(?:\s*,\s*\w+)*)\s*", text)  # the old form `path a, b`
    text = f"{listed[1]}::{{{listed[2]}}}" if listed else text
    words = re.findall(r'"[^"]*"|\w+|::|[{},]', text)
    prefixes, parts, name = [""], list[str](), ""

    def finish() -> None:
        if parts:
            path = prefixes[-1] + "::".join(parts)
            key = name or parts[-1].strip('"')
            result.imports[key], result.lines[key] = path, line

    at = 0
    while at < len(words):
        word = words[at]
        if word == "{":
            prefixes.append(prefixes[-1] + "".join(f"{part}::" for part in parts))
            parts, name = [], ""
        elif word in ("}", ","):
            finish()
            parts, name = [], ""
            if word == "}":
                if len(prefixes) < 2:
                    raise refuse("'}' without '{' in an #import", "", place)
                prefixes.pop()
        elif word == "as" and at + 1 < len(words):
            at += 1
            name = words[at]
        elif word != "::":
            parts.append(word)
        at += 1
        if len(prefixes) > MAX_DEPTH or len(parts) > MAX_DEPTH:
            raise refuse("an #import of too many parts", "", place)
    finish()
