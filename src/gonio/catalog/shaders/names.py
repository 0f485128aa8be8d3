"""Which texts name a shader. This is asked of every material, so it must not load the readers."""

from __future__ import annotations

import os
from pathlib import Path

SUFFIXES = (".glsl", ".frag", ".hlsl", ".slang", ".wgsl", ".spv", ".brdf")


def file_in(text: str) -> Path | None:
    """The shader that a material's text names, with or without settings: "my.glsl", "my.glsl(roughness=0.3)"."""
    head = text.partition("(")[0]
    return next((Path(os.path.expanduser(one.strip())) for one in (text, head) if names_shader(one)), None)


def names_shader(text: str) -> bool:
    """Whether a text names a shader, by its suffix; a .brdf also by its first word, since tables have that suffix."""
    suffix = Path(text.strip()).suffix.lower()
    if suffix not in SUFFIXES or "\0" in text:
        return False
    if suffix != ".brdf":
        return True
    try:
        with Path(os.path.expanduser(text.strip())).open("rb") as file:
            from . import explorer

            return explorer.is_explorer(file.read(1 << 16).decode("utf-8", "replace"))
    except OSError:
        return False
