"""Mutations of shader text: an operator, a constant, two arguments or a term are changed in one place."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

OPERATORS = {
    "+": "-*", "-": "+*", "*": "/+", "/": "*", "<": ">", ">": "<", "<=": ">=", ">=": "<=", "&&": ("||",),
    "||": ("&&",), "==": ("!=",), "!=": ("==",),
}  # fmt: skip
FACTORS = (0.5, 1.01, 1.00001)
_OPERATOR = re.compile(r"(?<=[\w)\]] )(\+|-|\*|/|<=|>=|<|>|==|!=|&&|\|\|)(?= [\w(-])")
_CONSTANT = re.compile(r"(?<![\w.])\d+\.\d+(?:e-?\d+)?")
_CALL = re.compile(r"\b(?!if\b|for\b|return\b|fn\b|while\b)[a-zA-Z_]\w*\(")
_TERM = re.compile(r"(?<=[\w)\]])\s+[-+*]\s+(?=[\w(-])")


class Mutation(NamedTuple):
    """A changed text, with the place and what it said before."""

    kind: str
    line: int
    before: str
    after: str
    text: str


def mutations(text: str, count: int, seed: int) -> list[Mutation]:
    """So many different mutations, a quarter of each kind."""
    random = np.random.default_rng(seed)
    code = re.sub(r"//[^\n]*", lambda comment: " " * len(comment[0]), text)
    code = re.sub(r"struct \w+ \{.*?\}", lambda struct: " " * len(struct[0]), code, flags=re.DOTALL)
    chosen: dict[str, Mutation] = {}
    kinds = list(KINDS)
    places = {kind: list(KINDS[kind](code)) for kind in kinds}
    for _ in range(100 * count):
        if len(chosen) == count:
            break
        kind = kinds[len(chosen) % len(kinds)]
        start, end, others = places[kind][random.integers(len(places[kind]))]
        other = str(others[random.integers(len(others))])
        changed = text[:start] + other + text[end:]
        line = text.count("\n", 0, start) + 1
        chosen.setdefault(changed, Mutation(kind, line, text[start:end], other, changed))
    return list(chosen.values())


Places = Iterator[tuple[int, int, list[str]]]  # start, end, what may stand there instead


def _operators(code: str) -> Places:
    for match in _OPERATOR.finditer(code):
        yield *match.span(), list(OPERATORS[match[0]])


def _constants(code: str) -> Places:
    for match in _CONSTANT.finditer(code):
        number = float(match[0])
        changed = [number * factor for factor in FACTORS] if number else [0.01]
        yield *match.span(), [text if "." in (text := f"{one:.8g}") else _with_point(text) for one in changed]


def _with_point(text: str) -> str:
    """A number in the form that all languages read: 1e-05 as 1.0e-05."""
    head, e, power = text.partition("e")
    return f"{head}.0{e}{power}"


def _swaps(code: str) -> Places:
    for match in _CALL.finditer(code):
        parts = _arguments(code, match.end())
        for (a, b), (c, d) in itertools.pairwise(parts):
            one, other = code[a:b], code[c:d]
            declares = re.match(r"\w+ \w+$|\w+: ", one)
            if one != other and not declares:
                yield a, d, [other + code[b:c] + one]


def _dropped(code: str) -> Places:
    for match in _TERM.finditer(code):
        end = _end_of_term(code, match.end())
        if end > match.end():
            yield match.start(), end, [""]


def _arguments(code: str, start: int) -> list[tuple[int, int]]:
    """The places of the arguments of a call whose bracket opens before `start`, without spaces around them."""
    parts, depth, first = [], 0, start
    for place in range(start, len(code)):
        letter = code[place]
        if depth == 0 and letter in ",)":
            inside = code[first:place]
            parts.append((first + len(inside) - len(inside.lstrip()), first + len(inside.rstrip())))
            first = place + 1
            if letter == ")":
                return [part for part in parts if part[1] > part[0]]
        depth += (letter in "([") - (letter in ")]")
        if letter in ";{":
            break
    return []


def _end_of_term(code: str, start: int) -> int:
    """Where the operand that starts here ends: before a space, comma or bracket of its own level."""
    depth = 0
    for place in range(start, len(code)):
        letter = code[place]
        if depth == 0 and letter in " ,;)]\n":
            return place
        depth += (letter in "([") - (letter in ")]")
    return start


KINDS: dict[str, Callable[[str], Places]] = {
    "operator": _operators, "constant": _constants, "arguments": _swaps, "term": _dropped,
}  # fmt: skip
