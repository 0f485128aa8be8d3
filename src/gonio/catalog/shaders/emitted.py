"""Shaders written by `gonio emit`, for which the manifest.json beside the shader replaces an adapter."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...errors import InputError

MAX_MANIFEST = 16 << 20  # maximum size in bytes; that of a module with all materials has 1 MB
_KINDS = {"alpha": "alpha", "angle": "angle"}  # kinds of parameters whose fields are vectors with another meaning


def manifest_of(shader: Path) -> Path | None:
    """The manifest of a shader; None if there is none."""
    file = shader.parent / "manifest.json"
    try:
        if not file.is_file() or file.stat().st_size > MAX_MANIFEST:
            return None
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    if f'"{shader.name}"' not in text:  # other programs also write files with this name
        return None
    return file if _loaded(file).get("shader") == shader.name else None


def content(file: Path, function: str = "") -> dict[str, Any]:
    """The content of an adapter for a shader, from its manifest; empty if the function is not the `eval` of a material.

    Raises InputError if the module contains several materials and no function is named, and for a damaged manifest.
    """
    manifest = _loaded(file)
    try:
        several = manifest.get("materials", [manifest])
        named = {one["functions"]["eval"]: one for one in several if "eval" in one["functions"]}
        chosen = named.get(function) if function else next(iter(named.values()), None)
        entries = {} if chosen is None else dict(_entries(chosen))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        what = f"not a manifest of `gonio emit`: {type(error).__name__} {error}"
        raise InputError(what[:200], str(file), "emit the shader again, or remove the manifest") from None
    if not function and len(named) != 1:
        hint = f"name its function: --adapter function={next(iter(named), 'NAME')}"
        raise InputError(f"{len(named)} materials, one expected: {', '.join(named) or 'no eval'}", str(file), hint)
    return entries


def _loaded(file: Path) -> dict[str, Any]:
    try:
        loaded = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        hint = "emit the shader again, or remove the manifest"
        raise InputError(f"not a manifest: {error}"[:200], str(file), hint) from None
    return loaded if isinstance(loaded, dict) else {}


def _entries(manifest: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    functions = manifest["functions"]
    yield "function", functions["eval"]
    yield "struct", manifest["struct"]
    yield "cosine", True
    yield "transmits", manifest["transmits"]
    yield "doc", str(manifest["doc"]).partition("\n")[0]
    if "derive" in functions:
        yield "derive", functions["derive"]
    if {"pdf", "sample"} <= set(functions):
        yield "pdf", functions["pdf"]
        yield "sample", functions["sample"]
    kinds = {one["path"]: one for one in manifest["parameters"]}
    yield "parameters", {field["name"]: _parameter(field, kinds[field["path"]]) for field in manifest["fields"]}
    yield "textures", {one["uniform"]: _texture(one) for one in manifest["textures"]}


def _parameter(field: Mapping[str, Any], described: Mapping[str, Any]) -> dict[str, Any]:
    """The adapter's entry for a field of the struct. A field on which tables depend keeps its value."""
    kind = "fixed" if described["fixed"] else _KINDS.get(described["kind"], "")
    result = {"default": field["value"] if kind == "fixed" else described["value"], "doc": described["doc"]}
    result |= {key: described[key] for key in ("low", "high") if described[key] is not None and kind != "fixed"}
    return {**result, "unit": described["unit"], **({"kind": kind} if kind else {})}


def _texture(texture: Mapping[str, Any]) -> dict[str, Any]:
    if texture["file_format"] != "raw":
        what = f"tables in the form '{texture['file_format']}' cannot be read"
        raise InputError(what, f"{texture['file']}", "write raw ones: gonio emit --tables raw")
    return {"file": texture["file"], "shape": [*reversed(texture["size"]), texture["channels"]]}
