"""What the pages name is there: files, modules, members of `gonio`, links and the headings that they lead to."""

from __future__ import annotations

import difflib
import functools
import importlib
import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import pytest

import pages
from pages import PAGES, ROOT

FOLDERS = ("benchmarks", "docs", "examples", "src", "tests", "tools", "web")
SUFFIX = re.compile(r"[\w*]\.(?:bib|csv|exr|glsl|hdr|html|ipynb|jpg|js|json|md|obj|ply|png|py|svg|toml|ts|txt|webp)")
# the history names what was once there; cards of engines name files of the engines' packages
NOT_OURS = ("CHANGELOG", "report-cards/engines/")
OURS = [page for page in PAGES if not pages.name(page).startswith(NOT_OURS)]


def _quoted(page: Path) -> Iterator[str]:
    return iter(re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8")))


PICTURES = (".jpg", ".png", ".svg", ".webp")


@functools.cache
def _tree() -> tuple[set[str], str]:
    """Names of all files and folders; the text of the programs, which name the files that they write."""
    every = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if "node_modules" not in path.parts]
    programs = [path for path in every if path.suffix == ".py" and path.is_file()] + [ROOT / "Makefile"]
    return {path.name for path in every + list(ROOT.iterdir())}, "".join(
        path.read_text(encoding="utf-8") for path in programs if path != Path(__file__)
    )


def _is_file(text: str, page: Path, listed: str) -> bool:
    """A path of the repository exists; a file that a program or a listing of the page writes is named there."""
    if any((root / text).exists() or ("*" in text and list(root.glob(text))) for root in (ROOT, _PACKAGE, page.parent)):
        return True
    if "NAME" in text:
        return True
    if "/" in text and difflib.get_close_matches(text.partition("/")[0], FOLDERS, cutoff=0.75):
        return False
    names, programs = _tree()
    name = text.rstrip("/").rpartition("/")[2]
    return name in names or any(
        part in whole for part in (name, name.partition(".")[0]) for whole in (listed, programs)
    )


_PACKAGE = ROOT / "src/gonio"


@pytest.mark.parametrize("page", OURS, ids=pages.name)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    listed = "".join(f"{one.file} {one.text}" for one in pages.listings(text))
    listed += "".join(re.findall(r"^\| (?:hw4|lab2) \|.*$", text, re.MULTILINE))  # names of what students hand in
    paths = [one for one in _quoted(page) if re.fullmatch(r"[\w.*-]+(?:/[\w.*-]+)*/?", one)]
    files = [
        one
        for one in paths
        if SUFFIX.search(one) or ("/" in one and difflib.get_close_matches(one.partition("/")[0], FOLDERS, cutoff=0.75))
    ]
    assert [file for file in files if not _is_file(file, page, listed)] == []


@pytest.mark.parametrize("page", PAGES, ids=pages.name)
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


def _links(page: Path) -> Iterator[tuple[str, str]]:
    """File, empty for the page itself, and heading of every link and picture that leads into the repository."""
    text = re.sub(r"`[^`\n]+`", "", pages.without_listings(page.read_text(encoding="utf-8")))  # code is an example
    for markdown, html in re.findall(r"\]\(([^)\s]+)\)|(?:href|src)=\"([^\"]+)\"", text):
        if not re.match(r"[a-z]+:", markdown or html):
            file, _, heading = (markdown or html).partition("#")
            yield file, heading


@functools.cache
def _headings(page: Path) -> set[str]:
    """The anchors that GitHub and the book give to the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", pages.without_listings(page.read_text(encoding="utf-8")), re.MULTILINE)
    return {
        re.sub(r"[^\w\- ]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", head).lower()).replace(" ", "-")
        for head in heads
    }


@pytest.mark.parametrize("page", PAGES, ids=pages.name)
def test_links_lead_somewhere(page: Path) -> None:
    broken = []
    for file, heading in _links(page):
        target = page.parent / file if file else page
        if not target.exists() or (heading and target.is_file() and heading not in _headings(target)):
            broken.append(f"{file}#{heading}")
    assert broken == []


def test_every_picture_is_shown_by_a_page_or_read_by_a_scene() -> None:
    """A link that leads to another picture leaves its own without a page."""
    shown = {(page.parent / file).resolve() for page in PAGES for file, _ in _links(page) if file}
    pictures = [
        path for folder in ("docs", "examples") for path in (ROOT / folder).rglob("*.*") if path.suffix in PICTURES
    ]
    copies = tuple((ROOT / "docs" / copy).as_posix() for copy in pages.COPIES)
    own = [path for path in pictures if not path.as_posix().startswith(copies)]
    own = [path for path in own if not (path.parent / "calibration.json").exists()]  # photographs, taken as a folder
    left = [path for path in own if path.resolve() not in shown and path.name not in _beside(path.parent)]
    assert [path.name for path in left] == []


@functools.cache
def _beside(folder: Path) -> str:
    """The scenes and programs of a folder."""
    return "".join(one.read_text(encoding="utf-8") for one in folder.iterdir() if one.suffix in (".json", ".py"))


def test_the_map_names_what_is_in_the_file() -> None:
    """`FILE`: `NAME` on the map means that the file defines the name."""
    design = (ROOT / "docs/design.md").read_text(encoding="utf-8")
    pairs = re.findall(r"`([\w/]+\.py)`: `(\w+)`", design)
    assert len(pairs) > 5
    for file, name in pairs:
        text = (ROOT / "src/gonio" / file).read_text(encoding="utf-8")
        assert re.search(rf"^\s*(?:def|class) {name}\b", text, re.MULTILINE), f"{file}: {name}"
