"""What the pages name is there: files, modules, members of `gonio`, links."""

from __future__ import annotations

import importlib
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import pytest

ROOT = Path(__file__).parents[2]
PAGES = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "docs/course").glob("*.md"),
    *(ROOT / "examples").glob("*/*.md"),
]


def _quoted(page: Path) -> Iterator[str]:
    return iter(re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8")))


def _name(page: Path) -> str:
    return page.parent.name if page.parent.parent.name == "examples" else page.stem


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    files = [text for text in _quoted(page) if re.fullmatch(r"[\w.-]+/(?:[\w.-]+/)*[\w.-]+\.(?:py|ts|md)", text)]
    roots = (ROOT, ROOT / "src/gonio")
    assert [file for file in files if not any((root / file).exists() for root in roots)] == []


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_modules_and_names_that_a_page_names_are_there(page: Path) -> None:
    for text in _quoted(page):
        if re.fullmatch(r"gonio(\.\w+)+", text) and not NO_MODULES.match(text):
            assert _is_there(text), text
        if found := re.match(r"go\.(\w+)", text):
            assert hasattr(go, found[1]), text


# groups of entry points, and a function of the page's script
NO_MODULES = re.compile(
    r"gonio\.(models|distributions|maskings|fresnels|integrators|laws|languages|panels|verbs|formats|tables|surfaces|addPanel)"
)


def _is_there(dotted: str) -> bool:
    module, _, name = dotted.rpartition(".")
    return importlib.util.find_spec(dotted) is not None or hasattr(importlib.import_module(module), name)


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"`[^`\n]+`", "", page.read_text(encoding="utf-8"))  # a link in code is an example
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text)
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_the_map_names_what_is_in_the_file() -> None:
    """`FILE`: `NAME` on the map means that the file defines the name."""
    design = (ROOT / "docs/design.md").read_text(encoding="utf-8")
    pairs = re.findall(r"`([\w/]+\.py)`: `(\w+)`", design)
    assert len(pairs) > 5
    for file, name in pairs:
        text = (ROOT / "src/gonio" / file).read_text(encoding="utf-8")
        assert re.search(rf"^\s*(?:def|class) {name}\b", text, re.MULTILINE), f"{file}: {name}"
