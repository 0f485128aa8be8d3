"""Syntax highlighting for listings without a declared language: commands and Python code."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

SHELL = re.compile(r"\s*(?:\$ |gonio |make |pip |python |pytest |\. \.venv|cd |git )")
PYTHON = re.compile(r"\s*(?:import |from |class |def |go\.|@|\w+ = )")


def color(app: Any, doctree: Any) -> None:
    """Handler of Sphinx's event doctree-read: guesses the language of each undeclared listing from its first line."""
    for block in doctree.findall(nodes.literal_block):
        if block.get("language", "text") in ("", "text", "none", "default"):
            first = block.astext().lstrip("\n").partition("\n")[0]
            block["language"] = "bash" if SHELL.match(first) else "python" if PYTHON.match(first) else "text"
            block["force"] = True  # highlight mixed listings as far as they can be parsed
