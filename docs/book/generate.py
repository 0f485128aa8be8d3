"""Generate pages from the code and write them to docs/reference, docs/gallery and docs/project, which git ignores.

Files whose text has not changed are not rewritten, so that Sphinx rebuilds only the changed pages. Parts whose inputs
have not changed are not generated again.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from . import api, bibliography, errors, families, gallery, models, project, strips, substances

ROOT = Path(__file__).parents[2]
Pages = dict[str, str | bytes]  # path relative to docs/ -> contents
SHOWN = "examples/all-models/*.py"  # the parameter values with which models are shown

PARTS: dict[str, tuple[Callable[[], Pages], tuple[str, ...]]] = {
    "reference/models": (models.pages, ("src/gonio/**/*.py", "docs/book/*.py", "docs/report-cards/cards.json", SHOWN)),
    "reference/live": (models.live, ("src/gonio/**/*.py", "src/gonio/viewer/static/*", "docs/book/models.py", SHOWN)),
    "reference/strips": (
        strips.pages,
        ("src/gonio/materials/**/*.py", "src/gonio/optics/**/*.py", "docs/book/strips.py", SHOWN),
    ),
    "reference/families": (families.pages, ("src/gonio/**/*.py", "docs/book/*.py")),
    "reference/substances": (substances.pages, ("src/gonio/optics/*", "src/gonio/catalog/**/*", "docs/book/*.py")),
    "reference/api": (api.pages, ("src/gonio/**/*.py", "docs/book/*.py")),
    "reference/errors": (errors.pages, ("src/gonio/**/*.py", "docs/book/*.py")),
    "reference/bibliography": (
        bibliography.pages,
        ("docs/references.bib", "docs/*.md", "src/gonio/**/*.py", "docs/book/*.py"),
    ),
    "gallery": (gallery.pages, ("examples/*/*.md", "examples/*/*.jpg", "docs/book/*.py")),
    "project": (project.pages, ("CONTRIBUTING.md", "CHANGELOG.md", "docs/book/*.py")),
}


def write_all(docs: Path) -> None:
    """Generate every part whose inputs have changed; GONIO_BOOK=quick omits live pages and strips."""
    for folder, (make, inputs) in PARTS.items():
        if folder in ("reference/live", "reference/strips") and os.environ.get("GONIO_BOOK") == "quick":
            continue
        digest = _digest(inputs)
        stamp = docs / folder / ".made-from"
        if stamp.exists() and stamp.read_text() == digest:
            continue
        _write(docs / folder, {docs / path: contents for path, contents in make().items()})
        stamp.write_text(digest)


def _write(folder: Path, pages: dict[Path, str | bytes]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for old in _files(folder):
        if old not in pages and old.name != ".made-from":
            old.unlink()
    for path, contents in pages.items():
        data = contents.encode() if isinstance(contents, str) else contents
        if not (path.exists() and path.read_bytes() == data):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file())


def _digest(patterns: Iterable[str]) -> str:
    total = hashlib.sha256()
    for pattern in patterns:
        for path in sorted(ROOT.glob(pattern)):
            if path.is_file():
                total.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return total.hexdigest()
