"""The tokens of a WGSL text, with their lines.

    tokens("let x = 2.0f;", "a.wgsl")   let, x, =, 2.0f, ;

`<` and `>` around the arguments of a type are distinguished from comparisons by the specification's rule: a `<` after a
name opens a list if a `>` follows at the same depth of brackets before the expression ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from ...errors import InputError
from ..values import refuse

MAX_TOKENS = 400_000  # number of tokens of a file
MAX_NESTING = 64  # depth of nested brackets and blocks

_TOKEN = re.compile(
    r"""(?P<space>[ \t\r\f\v\u0085\u200e\u200f\u2028\u2029]+|//[^\n]*)
    |(?P<line>\n)
    |(?P<comment>/\*)
    |(?P<number>0[xX][0-9a-fA-F]*\.?[0-9a-fA-F]*(?:[pP][+-]?[0-9]+[fh]?)?[iu]?
        |(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+)(?:[eE][+-]?[0-9]+)?[fhiu]?)
    |(?P<name>[^\W\d]\w*(?:::[^\W\d]\w*)*)
    |(?P<sign><<=|<<|<=|>=|->|&&|\|\||==|!=|\+\+|--|[-+*/%&|^]=|[-+*/%&|^~!<>=.,;:@(){}\[\]])""",
    re.VERBOSE,
)
_COMMENT = re.compile(r"/\*|\*/|\n")


class Token(NamedTuple):
    """A token; kind is "name", "number", "sign", "open" or "close" (of a list of type arguments), or "end".

    joined  whether the next token follows without a space, as in `>>`
    """

    kind: str
    text: str
    line: int
    joined: bool = False


def tokens(text: str, where: str) -> list[Token]:
    """The tokens of a text. Raises InputError, with file and line, for invalid characters and for too many tokens."""
    result: list[Token] = []
    for token in _words(text, where):
        result.append(token)
        if len(result) > MAX_TOKENS:
            raise refuse(f"more than {MAX_TOKENS} words", "shorten the shader", f"{where}:{token.line}")
    _mark_lists(result)
    line = result[-1].line if result else 1
    return [*result, Token("end", "the end of the file", line)]


def _words(text: str, where: str) -> Iterator[Token]:
    at, line = 0, 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise refuse(f"unknown character {text[at]!r}", "WGSL does not use it", f"{where}:{line}")
        kind, at = str(match.lastgroup), match.end()
        if kind == "line":
            line += 1
        elif kind == "comment":
            at, more = _after_comment(text, at, f"{where}:{line}")
            line += more
        elif kind != "space":
            for word in (">", "=") if match[0] == ">=" else (match[0],):  # `>=` in `array<f32>=` closes a list
                yield Token(kind, word, line, at < len(text) and (text[at] in ">=" or word != match[0]))


def _after_comment(text: str, at: int, where: str) -> tuple[int, int]:
    """The position after a block comment, and the number of line ends in the comment; comments can be nested."""
    depth, lines = 1, 0
    while depth:
        match = _COMMENT.search(text, at)
        if match is None:
            raise refuse("a comment is not closed", "add */", where)
        depth += {"/*": 1, "*/": -1}.get(match[0], 0)
        lines += match[0] == "\n"
        at = match.end()
    return at, lines


def _mark_lists(result: list[Token]) -> None:
    """Mark the `<` and `>` that enclose lists of type arguments."""
    pending: list[tuple[int, int]] = []  # position of `<`, depth of brackets
    depth = 0
    for place, token in enumerate(result):
        text = token.text
        if text == "<" and place and result[place - 1].kind == "name":
            pending.append((place, depth))
        elif text == ">" and pending and pending[-1][1] == depth:
            start = pending.pop()[0]
            result[start] = result[start]._replace(kind="open")
            result[place] = token._replace(kind="close")
        elif text in ("(", "["):
            depth += 1
        elif text in (")", "]", "&&", "||"):
            while pending and pending[-1][1] >= depth:
                pending.pop()
            depth = max(0, depth - 1) if text in (")", "]") else depth
        elif text in (";", "{", ":") or (
            text == "=" and not (result[place - 1].text == ">" and result[place - 1].joined)
        ):
            pending.clear()
            depth = 0


class Words:
    """The tokens of a text, consumed one at a time."""

    def __init__(self, text: str, where: str) -> None:
        self.where, self.words, self.at, self.depth = where, tokens(text, where), 0, 0

    @property
    def word(self) -> Token:
        return self.words[self.at]

    def take(self) -> Token:
        word = self.words[self.at]
        self.at = min(self.at + 1, len(self.words) - 1)
        return word

    def error(self, expected: str) -> InputError:
        return refuse(f"'{self.word.text[:40]}' where {expected} is expected", "", f"{self.where}:{self.word.line}")

    def expect(self, text: str) -> Token:
        if self.word.text != text:
            raise self.error(f"'{text}'")
        return self.take()

    def accept(self, text: str) -> bool:
        if self.word.text != text or self.word.kind == "end":
            return False
        self.take()
        return True

    def name(self) -> str:
        if self.word.kind != "name":
            raise self.error("a name")
        return self.take().text

    def deeper(self) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            what = f"more than {MAX_NESTING} nested brackets or blocks"
            raise refuse(what, "name the parts with let", f"{self.where}:{self.word.line}")
