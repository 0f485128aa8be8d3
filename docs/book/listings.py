"""Colors for listings that name no language: commands, and the Python that stands beside them."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

SHELL = re.compile(r"\s*(?:\$ |gonio |make |pip |python |pytest |\. \.venv|cd |git )")
PYTHON = re.compile(r"\s*(?:import |from |class |def |go\.|@|\w+ = )")


def color(app: Any, doctree: Any) -> None:
    """Sphinx's doctree-read: the language of each listing that has none, by its first line."""
    for block in doctree.findall(nodes.literal_block):
        if block.get("language", "text") in ("", "text", "none", "default"):
            first = block.astext().lstrip("\n").partition("\n")[0]
            block["language"] = "bash" if SHELL.match(first) else "python" if PYTHON.match(first) else "text"
            block["force"] = True  # mixed listings are colored as far as they can be read
