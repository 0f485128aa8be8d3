"""The JSON Schema of a shader's manifest.json, stored next to this file."""

from __future__ import annotations

from pathlib import Path


def text() -> str:
    """The schema's text."""
    return Path(__file__).with_name("manifest.schema.json").read_text(encoding="utf-8")
