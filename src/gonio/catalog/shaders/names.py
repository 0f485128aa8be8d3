"""Strings that name shaders, and the options in these strings.

After a question mark, the string may add entries to the adapter of the shader, as in a URL:
"my.glsl?function=f&defines.N=1". Options are part of the shader's name, so they are passed on to worker processes,
scenes and results. The string of every material is tested by this module, so it must not load the readers.
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
    """Split the name of a shader into file and options, such as ("my.glsl", "function=f"); "" for no options."""
    match = _WITH_OPTIONS.fullmatch(text.strip())
    return (match[1], match[2]) if match else (text.strip(), "")


def options_in(query: str) -> list[tuple[str, str]]:
    """The keys and values in options such as "function=f&defines.N=1"."""
    return parse_qsl(query, keep_blank_values=True, max_num_fields=1000)


def with_options(text: str, options: Iterable[tuple[str, str]]) -> str:
    """The name of a shader with additional options, which replace its own options with the same keys."""
    file, query = parted(text)
    every = {**dict(options_in(query)), **dict(options)}
    query = "&".join(f"{quote(key, _PLAIN)}={quote(value, _PLAIN)}" for key, value in every.items())
    return f"{file}?{query}" if query else file


def option(text: str, name: str, prefix: str = "") -> tuple[str, str]:
    """Split "KEY=VALUE", given for the command-line option `name`, into key and value; a macro may have no value."""
    key, equals, value = text.partition("=")
    if not key.strip() or not (equals or prefix):
        example = "-D USE_SHEEN=1" if prefix else "--adapter function=BRDF"
        raise InputError(f"'{text}' given, NAME=VALUE expected", name, f"such as {example}")
    return prefix + key.strip(), value.strip() if equals else "1"


def head_in(text: str) -> str:
    """The name of the shader, with options, in the string of a material, such as "my.glsl" in "my.glsl(roughness=0.3)".

    The result is "" if the string names no shader.
    """
    head = text.partition("(")[0]
    return next((one.strip() for one in (text, head) if names_shader(one)), "")


def file_in(text: str) -> Path | None:
    """The shader file named by the string of a material, which may contain settings and options, or None."""
    head = head_in(text)
    return Path(os.path.expanduser(parted(head)[0])) if head else None


def names_shader(text: str) -> bool:
    """Whether a string names a shader, judging by the suffix.

    For a .brdf file, the first word in the file is checked too, because tables have the same suffix.
    """
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
