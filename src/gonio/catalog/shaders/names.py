"""Strings that name shaders, and the options in them. Every material's string is tested, so no reader must be loaded.

After a question mark, such a string may add entries to the shader's adapter, as in a URL:
"my.glsl?function=f&defines.N=1". They are part of the shader's name, so that they reach worker processes, scenes and
results.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import parse_qsl, quote

from ...errors import InputError

SUFFIXES = (".glsl", ".frag", ".hlsl", ".slang", ".wgsl", ".spv", ".brdf")
_PLAIN = "/,[]:"  # characters that are not escaped in options
_WITH_OPTIONS = re.compile(
    rf"(.*(?:{'|'.join(map(re.escape, SUFFIXES))}))\?([^?()]*=[^?()]*)", re.DOTALL | re.IGNORECASE
)


def parted(text: str) -> tuple[str, str]:
    """The file and the options of a shader's name: ("my.glsl", "function=f"); "" for no options."""
    match = _WITH_OPTIONS.fullmatch(text.strip())
    return (match[1], match[2]) if match else (text.strip(), "")


def options_in(query: str) -> list[tuple[str, str]]:
    """The keys and values of "function=f&defines.N=1"."""
    return parse_qsl(query, keep_blank_values=True, max_num_fields=1000)


def with_options(text: str, options: Iterable[tuple[str, str]]) -> str:
    """A shader's name with options added to its own, each replacing an earlier one of the same key."""
    file, query = parted(text)
    every = {**dict(options_in(query)), **dict(options)}
    query = "&".join(f"{quote(key, _PLAIN)}={quote(value, _PLAIN)}" for key, value in every.items())
    return f"{file}?{query}" if query else file


def option(text: str, name: str, prefix: str = "") -> tuple[str, str]:
    """(key, value) of "KEY=VALUE", given for the command-line option `name`; a macro may have no value."""
    key, equals, value = text.partition("=")
    if not key.strip() or not (equals or prefix):
        example = "-D USE_SHEEN=1" if prefix else "--adapter function=BRDF"
        raise InputError(f"'{text}' given, NAME=VALUE expected", name, f"such as {example}")
    return prefix + key.strip(), value.strip() if equals else "1"


def head_in(text: str) -> str:
    """The shader's name, with its options, in a material's string: "my.glsl" in "my.glsl(roughness=0.3)"; else ""."""
    head = text.partition("(")[0]
    return next((one.strip() for one in (text, head) if names_shader(one)), "")


def file_in(text: str) -> Path | None:
    """The shader file that a material's string names, with or without settings and options; None if it names none."""
    head = head_in(text)
    return Path(os.path.expanduser(parted(head)[0])) if head else None


def names_shader(text: str) -> bool:
    """Whether a string names a shader, by its suffix; a .brdf also by its first word, since tables have that suffix."""
    file = parted(text)[0]
    suffix = Path(file).suffix.lower()
    if suffix not in SUFFIXES or "\0" in text:
        return False
    if suffix != ".brdf":
        return True
    try:
        with Path(os.path.expanduser(file)).open("rb") as opened:
            from . import explorer

            return explorer.is_explorer(opened.read(1 << 16).decode("utf-8", "replace"))
    except OSError:
        return False
