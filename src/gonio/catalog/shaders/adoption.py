"""The first adapter of a shader, by looking at its names, and a list of the guesses in it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError
from .adapter import Adapter
from .files import bounds, read
from .names import names_shader
from .program import Program


class Adopted(NamedTuple):
    """An adapter as TOML, and what was guessed, one sentence each."""

    text: str
    guesses: tuple[str, ...]


def adopt(file: str | Path) -> Adopted:
    """The adapter of a shader without one. Raises InputError for files that cannot be read."""
    path = Path(os.path.expanduser(file))
    if not names_shader(str(path)) or not path.is_file():
        raise InputError(f"'{file}' is no shader", "FILE", "a .glsl, .frag, .hlsl, .slang, .wgsl, .spv or .brdf")
    program = read(path, None)
    adapter = program.adapter
    lines = [
        f"# How Gonio reads {path.name}; see docs/shaders.md",
        f"function = {json.dumps(adapter.function)}",
        f"arguments = {json.dumps(list(adapter.arguments))}",
        f"cosine = {json.dumps(bool(adapter.cosine))}  # whether it includes |cos theta_i|",
    ]
    for name in ("pdf", "sample"):
        if getattr(adapter, name):
            lines.append(f"{name} = {json.dumps(getattr(adapter, name))}")
            lines.append(f"{name}_arguments = {json.dumps(list(getattr(adapter, f'{name}_arguments')))}")
    for declared in program.parameters.values():
        low, high, default = bounds(declared)
        lines += [
            "",
            f"[parameters.{declared.name}]  # {declared.shape}",
            f"default = {_toml(default, declared.shape)}",
        ]
        lines += [f"low = {low}"] if abs(low) != float("inf") else []
        lines += [f"high = {high}"] if abs(high) != float("inf") else []
        lines.append(f"doc = {json.dumps(declared.uniform.doc)}")
    for name in program.samplers():
        lines += ["", f"[textures.{name}]", 'file = "table.npy"', 'wrap = "clamp"', 'filter = "linear"']
    return Adopted("\n".join(lines) + "\n", tuple(_guesses(program, adapter)))


def _toml(value: object, shape: str) -> str:
    if shape == "bool":
        return json.dumps(bool(value))
    return json.dumps(list(value)) if isinstance(value, tuple) else f"{float(str(value))}"


def _guesses(program: Program, adapter: Adapter) -> list[str]:
    meanings = dict(zip(program.argument_names("eval"), adapter.arguments, strict=True))
    listed = ", ".join(f"{name} = {meaning}" for name, meaning in meanings.items())
    guesses = [
        f"the BRDF is '{adapter.function}', by its name and arguments: {listed}",
        f"the cosine is {'included' if adapter.cosine else 'not included'}, which the file does not say",
    ]
    for declared in program.parameters.values():
        if declared.uniform.default is None:
            low, high, default = bounds(declared)
            guesses.append(f"{declared.name}: default {default}, range {low:g} to {high:g}, by its name")
    guesses += [f"texture {name}: give its file" for name in program.samplers()]
    return guesses
