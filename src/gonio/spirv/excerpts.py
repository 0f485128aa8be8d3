"""Single functions from a shader file that does not compile by itself.

`#include <scene_forward_lights_inc.glsl#light_compute>` includes only the function with that name and its overloads,
because the BRDFs of engines are in files that also read the renderer's buffers.
"""

from __future__ import annotations

import re

from ..errors import InputError

_TOKEN = re.compile(r"//[^\n]*|/\*.*?\*/|[{};]", re.DOTALL)
_HEAD = r"^[ \t]*(?:(?:highp|mediump|lowp|precise|static|inline)[ \t]+)*\w+[ \t]+{name}[ \t]*\("


def functions_in(text: str, names: str, where: str) -> tuple[str, int]:
    """The definitions of functions, and the line of the first one.

    text   text of a GLSL or HLSL file
    names  names of the functions, separated by commas
    where  the file, for messages
    The lines between two definitions are blank, which preserves the line numbers in messages. Raises InputError for a
    name that the file does not define.
    """
    spans = sorted({span for name in names.split(",") for span in _definitions(text, name.strip(), where)})
    parts, at = [], spans[0][0]
    for start, end in spans:
        parts += ["\n" * text.count("\n", at, start), text[start:end]]
        at = end
    return "".join(parts), text.count("\n", 0, spans[0][0]) + 1


def _definitions(text: str, name: str, where: str) -> list[tuple[int, int]]:
    if not re.fullmatch(r"\w{1,64}", name):
        raise InputError(f"'{name[:64]}' is not a function name", where, "write #include <FILE.glsl#FUNCTION>")
    heads = re.finditer(_HEAD.format(name=name), text, re.MULTILINE)
    spans = [(head.start(), end) for head in heads if (end := _end(text, head.end()))]
    if not spans:
        raise InputError(f"no function '{name}' is defined here", where, "use the name as spelled in the file")
    return spans


def _end(text: str, start: int) -> int:
    """The position after the body of a function whose arguments begin at `start`; 0 if the body is missing or not
    closed."""
    braces = 0
    for token in _TOKEN.finditer(text, start):
        one = token[0]
        if one == ";" and not braces:
            return 0
        braces += (one == "{") - (one == "}")
        if one == "}" and braces <= 0:
            return token.end()
    return 0
