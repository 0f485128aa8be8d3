"""One family of errors and warnings, each with what happened, where, and what to do about it.

Every message that a user can cause is a `GonioError`: the command line prints it in three lines and
exits with `code`, Python users catch one class.
"""

from __future__ import annotations

import re

_ENDLESS = re.compile(r"\d{50,}")  # far beyond the 17 that a double keeps


def printable(text: str) -> str:
    """The text with what no encoding has, such as bytes of a file's name that are no UTF-8, written as escapes.

    Of a number that fills the screen its beginning is left.
    """
    readable = text.encode("utf-8", "backslashreplace").decode()
    return _ENDLESS.sub(lambda number: f"{number[0][:20]}... ({len(number[0])} digits)", readable)


class GonioError(Exception):
    """Something the user can put right.

    what   what is wrong, with the value that was given and what was expected
    where  file and JSON pointer, option, or argument; empty where there is none
    hint   what to do about it
    """

    code = 2  # exit code of the command line: 2 is bad usage or input

    def __init__(self, what: str, where: str = "", hint: str = "") -> None:
        self.what, self.where, self.hint = map(printable, (what, where, hint))
        super().__init__(self.what, self.where, self.hint)

    def __str__(self) -> str:
        lines = [f"{self.where}: {self.what}" if self.where else self.what]
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)


class InputError(GonioError, ValueError):
    """A scene, parameter, option or file that cannot be used as it stands."""


class MachineError(GonioError):
    """The machine lacks something: no LLVM, no GPU, a full disk."""

    code = 3


class GonioWarning(UserWarning):
    """Odd but usable input; the text says what is assumed."""


def did_you_mean(name: str, known: list[str] | tuple[str, ...]) -> str:
    """A hint that names the nearest known spelling, or lists what is known."""
    from difflib import get_close_matches

    near = get_close_matches(name, known, n=1, cutoff=0.55)
    if near:
        return f"did you mean '{near[0]}'?"
    return "known: " + ", ".join(sorted(known))
