"""Errors and warnings. The message of an error states the problem, its location, and a remedy.

Every error that a user can cause is a `GonioError`, so a Python program needs to catch only one class. The command line
prints the error in three lines and exits with `code`.
"""

from __future__ import annotations

import os
import re

_ENDLESS = re.compile(r"\d{50,}")  # a double has 17 significant digits


def printable(text: str) -> str:
    """The text with characters that cannot be encoded, such as invalid UTF-8 in a file name, written as escapes.

    Numbers with very many digits are shortened.
    """
    return _ENDLESS.sub(lambda number: f"{number[0][:20]}... ({len(number[0])} digits)", encodable(text))


def encodable(text: str) -> str:
    """The text with characters that no encoding has, such as invalid UTF-8 in a file name, written as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


class GonioError(Exception):
    """An error that the user can correct.

    what   the problem: the given value, and the expected one
    where  the location of the problem: a file and JSON pointer, an option, or an argument; may be empty
    hint   advice to the user
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
    """Raised if a scene, parameter, option or file cannot be used as given."""


class MachineError(GonioError):
    """Raised if this machine lacks a resource, such as LLVM, a GPU or disk space."""

    code = 3


class GonioWarning(UserWarning):
    """Issued for unusual but usable input; the message states what is assumed."""


def did_you_mean(name: str, known: list[str] | tuple[str, ...]) -> str:
    """A hint that suggests the closest known name, or lists the known names."""
    from difflib import get_close_matches

    near = get_close_matches(name, known, n=1, cutoff=0.55)
    if near:
        return f"did you mean '{near[0]}'?"
    return "known: " + ", ".join(sorted(known))


# --------------------------------------------------------------------------- errors in user code

_OWN = os.path.dirname(__file__)
_LIBRARIES = (os.path.dirname(os.__file__), f"{os.sep}site-packages{os.sep}", f"{os.sep}dist-packages{os.sep}")
_IN_LOOP = "encountered an exception (see above)"  # Dr.Jit's text for any exception raised while it records a loop


def user_line(error: BaseException) -> str:
    """FILE:LINE of the innermost traceback frame in user code that Gonio called; "" if there is none.

    Code of Gonio and of libraries, and the program that calls Gonio, do not count as user code.
    """
    cause: BaseException | None = error
    visited: list[BaseException] = []
    while cause is not None and cause not in visited:
        visited.append(cause)
        within, line = False, ""
        place = cause.__traceback__
        while place is not None:
            file = place.tb_frame.f_code.co_filename
            if file.startswith(_OWN):
                within = True
            elif within and not file.startswith("<") and not any(library in file for library in _LIBRARIES):
                line = f"{file}:{place.tb_lineno}"
            place = place.tb_next
        if line:
            return line
        cause = cause.__cause__ or cause.__context__
    return ""


def summary(error: BaseException) -> str:
    """The exception's type and the first line of its message."""
    text = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def in_user_code(error: BaseException) -> InputError | None:
    """An InputError that states the line of user code that raised an exception; None if no user code was called."""
    line = user_line(error)
    return (
        InputError(summary(error), line, "correct it there: formulas use the functions of gonio.ops") if line else None
    )


def out_of_loop(error: BaseException) -> BaseException:
    """The original exception if Dr.Jit replaced it with a generic one while recording a loop; else the error itself."""
    cause: BaseException | None = error
    while isinstance(cause, RuntimeError) and _IN_LOOP in str(cause):
        cause = cause.__cause__ or cause.__context__
    if cause is None or cause is error or isinstance(cause, GonioError):
        return cause or error
    return in_user_code(cause) or cause
