"""Slang's compiler, from the wheel `slangpy`: its command, the text that it compiles, and its messages."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

from ..errors import InputError, MachineError

INSTALL = "pip install gonio[slang], or slangpy alone"
# directives with which the compiler itself reads files; #include is resolved earlier
_READS = re.compile(r"#\s*include\b|\b(?:__)?(?:import|include|implementing)\b")
_SKIPPED = re.compile(r'("(?:\\.|[^"\\\n])*")|//[^\n]*|/\*.*?(?:\*/|\Z)', re.DOTALL)
_LINE = re.compile(r"^([ \t]*#line \d+) (\d+)$", re.MULTILINE)
_MESSAGE = re.compile(r"^error\[\w+\]: (.*)\n +--> ([^\n]*?):(\d+)(?::\d+)?$", re.MULTILINE)
_DETAIL = re.compile(r"^ +\| +\^+ (.+)$", re.MULTILINE)


def library() -> str:
    """The path of the compiler's library. Raises MachineError if it is not installed."""
    package = importlib.util.find_spec("slangpy")
    for folder in (package.submodule_search_locations or []) if package else []:
        for name in ("libslang-compiler.so*", "libslang-compiler*.dylib", "slang-compiler*.dll"):
            if files := sorted(Path(folder).glob(name)):
                return str(files[0])
    raise MachineError("the Slang compiler slangpy is not installed", "shader", INSTALL)


def command(source: Path, output: Path) -> list[str]:
    """The command that compiles a text."""
    return [sys.executable, "-I", str(Path(__file__).with_name("slang_child.py")), library(), str(source), str(output)]


def program(text: str, calls: list[tuple[str, str, str]], name: str) -> str:
    """A text with an entry point that uses every function and stores the results in groupshared memory, because the
    compiler removes functions that have no effect.

    calls  (type of the result, declarations of arguments, call)
    Raises InputError for modules, which the compiler could read from any file.
    """
    code = _SKIPPED.sub(lambda match: '""' if match[1] else " ", re.sub(r"\\\r?\n", "", text))
    if (reads := _READS.search(code)) is not None:
        what = f"'{reads[0]}' is not supported"
        raise InputError(what, name, '#include "FILE" on a line of its own, from a folder of the adapter\'s `includes`')
    shared, body = [], []
    for place, (kind, arguments, call) in enumerate(calls):
        if kind == "void":
            outputs = re.findall(r"(\w+) (a\d+) =", arguments)  # arrays are not matched
            shared += [f"groupshared {one} gonio_{place}_{argument};" for one, argument in outputs]
            stores = " ".join(f"gonio_{place}_{argument} = {argument};" for _, argument in outputs)
            body.append(f"{{ {arguments} {call}; {stores} }}")
        else:
            shared.append(f"groupshared {kind} gonio_{place};")
            body.append(f"{{ {arguments} gonio_{place} = {call}; }}")
    entry = f'[shader("compute")] [numthreads(1, 1, 1)] void gonio_entry() {{ {" ".join(body)} }}'
    return "\n".join(['#line 1 "0"', _LINE.sub(r'\1 "\2"', text), *shared, entry, ""])


def messages(printed: str) -> list[tuple[str, str, str]]:
    """(number of the file, line, message) for each error."""
    errors = []
    for match in _MESSAGE.finditer(printed):
        detail = _DETAIL.search(printed, match.end())
        last = printed.find("\nerror[", match.end())
        near = detail is not None and (last < 0 or detail.start() < last)
        errors.append((match[2], match[3], detail[1].rstrip(".") if near and detail else match[1]))
    return errors
