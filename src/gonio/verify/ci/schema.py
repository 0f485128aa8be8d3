"""The JSON Schema of report.json, stored next to this file."""

from __future__ import annotations

from pathlib import Path


def text() -> str:
    """The content of the schema file."""
    return Path(__file__).with_name("report.schema.json").read_text(encoding="utf-8")


__all__ = ["text"]
