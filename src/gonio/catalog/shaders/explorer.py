"""The .brdf files of Disney's BRDF Explorer: parameters, and a function `BRDF` in GLSL, which returns f without cosine.

analytic
::begin parameters
float roughness 0 1 0.5      # name, smallest, largest, default
color base 0.8 0.6 0.2          # name, red, green, blue
bool isotropic 0
::end parameters
::begin shader
vec3 BRDF( vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y ) { ... }
::end shader
"""

from __future__ import annotations

import math
import re

from ...errors import InputError
from .adapter import Adapter, Uniform

_TYPES = {"float": "float", "color": "vec3", "bool": "bool"}


def is_explorer(text: str) -> bool:
    """Whether the text of a .brdf file is a shader of the BRDF Explorer instead of a table, from its first word."""
    words = re.sub(r"#.*", "", text[: 1 << 16]).split(maxsplit=1)
    return bool(words) and words[0] == "analytic"


def read(text: str, where: str) -> tuple[str, Adapter]:
    """The GLSL, with the same line numbers as in the file, and the adapter.

    text   content of the .brdf file
    where  name of the file in errors
    Raises InputError, with file and line, if the file is damaged.
    """
    section, lines, parameters = "", [], {}
    declared: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*::(begin|end)\s+(\w+)", line)
        if mark:
            section = mark[2] if mark[1] == "begin" else ""
        shader = section == "shader" and not mark
        lines.append(line if shader else "")
        words = re.sub(r"#.*", "", line).split()
        if section == "parameters" and not mark and words:
            name, kind, uniform = _parameter(words, f"{where}:{number}")
            if name in parameters:
                raise InputError(f"two parameters named '{name}'", f"{where}:{number}", "remove one")
            parameters[name] = uniform
            declared.append(f"uniform {kind} {name};")
    if not any(line.strip() for line in lines):
        raise InputError("no shader in this file", where, "add ::begin shader ... ::end shader")
    lines[0] = " ".join(declared)
    arguments = ("light", "view", "normal", "tangent", "bitangent")
    adapter = Adapter("BRDF", arguments, cosine=False, language="glsl", parameters=parameters)
    return "\n".join(lines), adapter


def _parameter(words: list[str], where: str) -> tuple[str, str, Uniform]:
    kind = _TYPES.get(words[0])
    counts = {"float": 5, "color": 5, "bool": 3}
    if kind is None or len(words) < counts[words[0]] or not re.fullmatch(r"[A-Za-z_]\w*", words[1]):
        raise InputError(
            f"'{' '.join(words)[:60]}' declares no parameter",
            where,
            "write float NAME MIN MAX DEFAULT, color NAME R G B, or bool NAME 0|1",
        )
    try:
        numbers = [float(word) for word in words[2 : counts[words[0]]]]
    except ValueError:
        raise InputError(f"'{' '.join(words[2:])[:60]}' are not numbers", where) from None
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"'{' '.join(words[2:])[:60]}' is not finite", where)
    if words[0] == "float":
        low, high, default = numbers
        return words[1], kind, Uniform(default, min(low, default), max(high, default))
    if words[0] == "bool":
        return words[1], kind, Uniform(numbers[0] != 0.0)
    return words[1], kind, Uniform(tuple(numbers), min(0.0, *numbers), max(1.0, *numbers))
