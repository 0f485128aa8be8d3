"""Shader text in JavaScript files: template literals, or named strings, read as data. No JavaScript is executed.

Engines on npm keep their shaders in such files:

    export default /* glsl */`float pow2( float x ) { return x * x; }`;
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from ..errors import InputError

_NAMED = re.compile(r"(?:\b([A-Za-z_$][\w$]*)\s*(?::\s*string\s*)?[=:]|\bexport\s+(default))\s*$")
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "v": "\v", "0": "\0", "\n": ""}
_TOKEN = re.compile(r"""//[^\n]*|/\*.*?\*/|'(?:\\.|[^'\\\n])*'|"(?:\\.|[^"\\\n])*"|`""", re.DOTALL)
_NAME_BEFORE = 400  # characters before a literal that may contain its name


class Literal(NamedTuple):
    """A template literal: the name that it is assigned to ("default", or "" for none), its text, and its first line.

    code  the line of its first `${`, 0 for none; a text with one depends on code that runs
    """

    name: str
    text: str
    line: int
    code: int = 0


def literals(text: str, where: str) -> list[Literal]:
    """The template literals of a JavaScript text, outside comments and strings. Raises InputError if one is open."""
    result, at = [], 0
    while (token := _TOKEN.search(text, at)) is not None:
        at = token.end()
        if token[0] == "`":
            line = text.count("\n", 0, at) + 1
            end, code = _end(text, at, f"{where}:{line}")
            named = _NAMED.search(_COMMENT.sub(" ", text[max(at - _NAME_BEFORE, 0) : at - 1]).rstrip())
            name = (named[1] or named[2]) if named else ""
            code_line = text.count("\n", 0, code) + 1 if code else 0
            result.append(Literal(name, _unescaped(text[at : end - 1]), line, code_line))
            at = end
    return result


def shader_in(text: str, name: str, where: str) -> Literal:
    """The literal of that name, or the only one of a file. Raises InputError if it is missing or contains code."""
    every = literals(text, where)
    chosen = [one for one in every if one.name == name] if name else every
    if name and not chosen:  # bundlers write strings
        chosen = [one for one in _strings(text) if one.name == name]
    if len(chosen) != 1:
        what = f"{len(chosen)} template literals{f' named {name}' if name else ''}, one expected"
        known = ", ".join(one.name for one in every if one.name)
        raise InputError(what, where, f"write #include <FILE.js#NAME>; it has {known or 'none with a name'}")
    if chosen[0].code:
        raise InputError("'${': this text is made by running JavaScript", f"{where}:{chosen[0].code}", "write it out")
    return chosen[0]


def _strings(text: str) -> Iterator[Literal]:
    """The strings of a JavaScript text that are assigned to a name."""
    for token in _TOKEN.finditer(text):
        if token[0][0] in "'\"" and (
            named := _NAMED.search(text[max(token.start() - _NAME_BEFORE, 0) : token.start()])
        ):
            line = text.count("\n", 0, token.start()) + 1
            yield Literal(named[1] or named[2], _unescaped(token[0][1:-1]), line)


def _end(text: str, start: int, where: str) -> tuple[int, int]:
    """The positions after the closing backtick and of the first `${`, whose code may contain literals."""
    at, code, braces = start, 0, [0]  # braces: of the surrounding code, innermost last; 0 in a literal
    while at < len(text):
        one, inside = text[at], len(braces) % 2 == 1
        if inside and one == "\\":
            at += 1
        elif inside and one == "`":
            braces.pop()
            if not braces:
                return at + 1, code
        elif inside and text.startswith("${", at):
            code = code or at
            braces.append(1)
            at += 1
        elif not inside and one == "`":
            braces.append(0)
        elif not inside and one in "{}":
            braces[-1] += 1 if one == "{" else -1
            if braces[-1] == 0:
                braces.pop()
        at += 1
    raise InputError("a template literal is not closed", where, "the file may be truncated")


def _unescaped(text: str) -> str:
    return re.sub(r"\\(.)", lambda match: _ESCAPES.get(match[1], match[1]), text, flags=re.DOTALL)


_ARRAY = r"\b{name}\s*=\s*new\s+(\w+Array)\s*\(\s*\[([\s\d.,xa-fA-F+eE-]*)\]\s*\)"


def array_in(text: str, name: str, where: str) -> tuple[str, list[float]]:
    """The numbers of `NAME = new Uint16Array([...])`, with the kind of array. Raises InputError if there is none."""
    match = re.search(_ARRAY.format(name=re.escape(name)), text)
    if match is None:
        raise InputError(f"no array {name} of numbers", where, f"{name} = new Uint16Array([...])")
    try:
        return match[1], [_number(word) for word in match[2].replace(",", " ").split()]
    except ValueError as error:
        raise InputError(f"{name}: {error}", where, "use only numbers") from None


def _number(word: str) -> float:
    return int(word, 16) if word.startswith("0x") else float(word)
