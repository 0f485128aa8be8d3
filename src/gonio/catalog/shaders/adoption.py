"""Write a first adapter for a shader, guessed from the names in it, and list the guesses."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from .adapter import Adapter
from .emitted import manifest_of
from .files import bounds, read
from .guesses import candidates
from .names import names_shader, options_in, parted
from .program import Program


class Adopted(NamedTuple):
    """An adapter as TOML text, and the guesses in it, one sentence each."""

    text: str
    guesses: tuple[str, ...]


def adopt(file: str | Path) -> Adopted:
    """Guess the adapter for a shader, whose name may contain options. Raises InputError if it cannot be read."""
    name, query = parted(str(file))
    path = Path(os.path.expanduser(name))
    if not names_shader(str(path)):
        hint = "give a .glsl, .frag, .hlsl, .slang, .wgsl, .spv or .brdf"
        raise InputError(f"'{name}' {'is not a shader file' if path.exists() else 'does not exist'}", "FILE", hint)
    if not path.is_file():
        raise InputError(f"'{name}' {'is not a file' if path.exists() else 'does not exist'}", "FILE")
    if (manifest := manifest_of(path)) is not None:
        raise InputError(f"'{path.name}' was written by gonio emit, and {manifest} is its adapter", "FILE", "use that")
    program = read(path, None, options=options_in(query))
    adapter = program.adapter
    lines = [
        f"# How Gonio reads {path.name}; see docs/shaders.md",
        f"function = {json.dumps(adapter.function)}",
        f"arguments = {json.dumps(list(adapter.arguments))}",
        f"cosine = {json.dumps(bool(adapter.cosine))}  # whether it includes |cos theta_i|",
    ]
    for key in ("pdf", "sample", "derive"):
        if getattr(adapter, key):
            lines.append(f"{key} = {json.dumps(getattr(adapter, key))}")
            lines.append(f"{key}_arguments = {json.dumps(list(getattr(adapter, f'{key}_arguments')))}")
    if adapter.includes:
        lines.append(f"includes = {json.dumps(list(adapter.includes))}")
    if adapter.defines:
        macros = ", ".join(f"{json.dumps(key)} = {json.dumps(value)}" for key, value in adapter.defines.items())
        lines.append(f"defines = {{ {macros} }}")
    for declared in program.parameters.values():
        low, high, default = bounds(declared)
        lines += [
            "",
            f"[parameters.{declared.name}]  # {declared.shape}",
            f"default = {_toml(default, declared.shape)}",
        ]
        lines += [f"low = {_number(low)}"] if abs(low) != float("inf") else []
        lines += [f"high = {_number(high)}"] if abs(high) != float("inf") else []
        lines.append(f"doc = {json.dumps(declared.uniform.doc)}")
    for name in program.samplers():
        about = adapter.textures.get(name, {})
        entries = {"file": "table.npy", "wrap": "clamp", "filter": "linear", **about}
        lines += ["", f"[textures.{name}]", *(f"{key} = {json.dumps(value)}" for key, value in entries.items())]
    return Adopted("\n".join(lines) + "\n", tuple(_guesses(program, adapter)))


def _toml(value: object, shape: str) -> str:
    if shape == "bool":
        return json.dumps(bool(value))
    if isinstance(value, tuple):
        return f"[{', '.join(map(_number, value))}]"
    return _number(value)


def _number(value: object) -> str:
    """A number with the digits of its float32 value, such as 0.8 instead of 0.800000011920929."""
    number = float(str(value))
    short = float(str(np.float32(number)))
    return f"{short if np.float32(number) == np.float64(number) else number}"


def _guesses(program: Program, adapter: Adapter) -> list[str]:
    meanings = dict(zip(program.argument_names("eval"), adapter.arguments, strict=True))
    listed = ", ".join(f"{name} = {meaning}" for name, meaning in meanings.items())
    guesses = [
        f"the BRDF is '{adapter.function}', because of its name and arguments: {listed}",
        f"the cosine is {'included' if adapter.cosine else 'not included'}; the file does not state it",
    ]
    others = [name for name in candidates(program.module) if name != adapter.function]
    if others:
        guesses.insert(1, f"other candidates: {', '.join(others)}; --adapter function=NAME selects one of them")
    for declared in program.parameters.values():
        if declared.uniform.default is None:
            low, high, default = bounds(declared)
            default = _toml(default, declared.shape)
            guesses.append(f"{declared.name}: default {default}, range {low:g} to {high:g}, because of its name")
    guesses += [f"texture {name}: add its file" for name in program.samplers() if name not in adapter.textures]
    return guesses
