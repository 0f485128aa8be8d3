"""Include guards and conditions of a C-like text, with which a header is expanded only once."""

from __future__ import annotations

import re

_COMMENTS = r"(?:\s|//[^\n]*\n|/\*.*?\*/)*"
_GUARD = re.compile(rf"{_COMMENTS}#[ \t]*ifndef[ \t]+(\w+)[^\n]*\n{_COMMENTS}#[ \t]*define[ \t]+\1\b", re.DOTALL)
_ONCE = re.compile(rf"{_COMMENTS}#[ \t]*pragma[ \t]+once\b", re.DOTALL)
_LINE = re.compile(r"^[ \t]*#[ \t]*(if|ifdef|ifndef|elif|else|endif)\b([^\n]*)", re.MULTILINE)

Context = tuple[str, ...]  # the conditions under which a line is read, outermost first


def is_guarded(text: str) -> bool:
    """Whether a second copy of the text would have no effect because of an include guard or #pragma once."""
    return bool(_GUARD.match(text) or _ONCE.match(text))


def guarded(text: str, content: str, name: str) -> str:
    """The expansion of a text; #pragma once, which the compiler ignores, is replaced by a guard macro."""
    return f"#ifndef {name}\n#define {name}\n{content}\n#endif" if _ONCE.match(text) else content


def context(text: str, at: int) -> Context:
    """The conditions around a position in a text, except for the condition of its include guard."""
    guard = _GUARD.match(text)
    stack: list[str] = []
    for word, rest in _LINE.findall(text, guard.end() if guard else 0, at):
        if word.startswith("if"):
            stack.append(f"{word} {' '.join(rest.split())}")
        elif stack and word != "endif":
            stack[-1] += f"; {word} {' '.join(rest.split())}"
        elif stack:
            stack.pop()
    return tuple(stack)
