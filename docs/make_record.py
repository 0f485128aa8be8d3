"""Write docs/record.json: the numbers that pages state and the pictures that they show, as they were last reviewed.

    python docs/make_record.py --check       print what differs from the record; exit code 1 if anything does
    python docs/make_record.py PATH ...      after a review: record these pages and pictures, or those of a folder

Most numbers in the documentation take minutes, a GPU or another program to measure, and most pictures need a renderer,
so that no test can reproduce them. The record holds, by page and section, every number that the page states, and for
each picture a digest of it and of the scene that it shows. If a number, picture or scene changes, tests fail until
somebody has measured or rendered again and has recorded it here; the changed line then shows in a review which number
it was. Pages that a test recomputes, or compares with the program that computes them, are not in the record.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from book import formulas

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "docs/record.json"

# recomputed and compared by tests: make_options.py, make_scenes.py, make_pages.py, make_engine_cards.py, make_errata.py
COMPUTED = ("docs/options.md", "docs/scenes.md", "docs/models/", "docs/report-cards/engines/", "docs/errata.md")
# copies made when the book is built, and translations, which a test compares with the English pages
COPIES = ("docs/reference/", "docs/gallery/", "docs/project/")
# README's tables of pictures and models are made by make_pages.py
TABLES = re.compile(r"<!-- (\w+) -->.*?<!-- /\1 -->", re.DOTALL)
WORDS = (
    "two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen"
)
WORDS += " nineteen twenty thirty forty fifty hundred thousand million billion half twice third quarter"
NUMBER = re.compile(
    rf"(?<![A-Za-z_\d])-?\.?\d+(?:[.,]\d+)*(?:e[+-]?\d+)?|\b(?:{'|'.join(WORDS.split())})\b", re.IGNORECASE
)
# written by programs that take minutes or need third-party files; recorded as a whole
WRITTEN = (
    "docs/phong-limits.md",  # make_phong_limits.py
    "docs/published-fits.md",  # make_published_fits.py
    "docs/published-fits/cards.json",
    "docs/rgl-fits.md",  # make_rgl_fits.py
    "docs/rgl-fits/fits.json",
    "docs/report-cards/*.*",  # make_report_cards.py
    "docs/report-cards/programs/*.py",
    "docs/thin-film.md",  # make_thin_film.py
)
PICTURES = (".png", ".jpg", ".svg", ".webp")
SOURCES = (".json", ".ply", ".obj", ".hdr", ".glsl", ".toml", ".gonio")


def written() -> list[Path]:
    """The files that are recorded as a whole."""
    return sorted(path for pattern in WRITTEN for path in ROOT.glob(pattern))


def pages() -> Iterator[Path]:
    """The pages written by hand, whose numbers no test recomputes."""
    whole = {*written()}
    for page in sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*/*.md")]):
        if page not in whole and not _name(page).startswith(COMPUTED + COPIES) and not page.name.endswith(".zh.md"):
            yield page


def pictures() -> Iterator[Path]:
    """The pictures of the pages and of the gallery, and the files that the gallery's scenes read."""
    for folder in ("docs", "examples"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in PICTURES and not _name(path).startswith(COMPUTED + COPIES):
                yield path


def figures(page: Path) -> dict[str, str]:
    """The numbers of each section in order, in digits or words, including those of listings and tables."""
    found: dict[str, list[str]] = {}
    heading, fenced = "", False
    for line in TABLES.sub("", page.read_text(encoding="utf-8")).splitlines():
        fenced ^= line.startswith("```")
        if line.startswith("#") and not fenced:
            heading = line.lstrip("# ")
        found.setdefault(heading, []).extend(number.lower() for number in NUMBER.findall(line))
    return {heading: " ".join(numbers) for heading, numbers in found.items() if numbers}


def digests(file: Path) -> dict[str, str]:
    """Digests of the file and, in the gallery, of the files in its folder that it shows; JSON is compared by value."""
    shown = [file]
    if file.is_relative_to(ROOT / "examples"):
        shown += [path for path in sorted(file.parent.iterdir()) if path.suffix in SOURCES]
    return {path.name: _digest(path) for path in shown}


def set_formulas() -> dict[str, str]:
    """Digests of each model's formulas as the book typesets them: tests evaluate some expressions, but no LaTeX."""
    names = sorted(formulas.RUN.keys() | formulas.SET.keys())
    return {name: _short("\n".join(formulas.of_model(name)).encode()) for name in names}


def _digest(path: Path) -> str:
    data = path.read_bytes()
    if path.suffix == ".json":
        data = json.dumps(json.loads(data), sort_keys=True).encode()
    elif path.suffix in (".glsl", ".md", ".obj", ".ply", ".py", ".svg", ".toml"):
        data = data.replace(b"\r\n", b"\n")
    return _short(data)


def _short(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:12]


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def current() -> dict[str, dict[str, str]]:
    """The record of the current state, by page or picture."""
    whole = {_name(one): digests(one) for one in [*pictures(), *written()]}
    return {_name(page): figures(page) for page in pages()} | whole | {"docs/book/formulas.py": set_formulas()}


def differences(stored: dict[str, dict[str, str]], now: dict[str, dict[str, str]]) -> list[str]:
    """One line per section or file that differs from the record."""
    lines = []
    for name in sorted(stored.keys() | now.keys()):
        old, new = stored.get(name, {}), now.get(name, {})
        for part in sorted(old.keys() | new.keys()):
            if old.get(part) != new.get(part):
                lines.append(f"{name}, {part}: {_change(old.get(part, ''), new.get(part, ''))}")
    return lines


def _change(old: str, new: str) -> str:
    """The first number that differs, with its recorded value."""
    before, after = old.split(), new.split()
    at = next((i for i, pair in enumerate(zip(before, after, strict=False)) if pair[0] != pair[1]), None)
    if at is None:
        at = min(len(before), len(after))
    return f"{' '.join(after[at : at + 3]) or 'nothing'}, recorded as {' '.join(before[at : at + 3]) or 'nothing'}"


def _below(word: str, known: set[str]) -> set[str]:
    """The recorded names of a file, or of all files of a folder."""
    path = Path(word).resolve()
    inside = _name(path) if path.is_relative_to(ROOT) else ""
    return {name for name in known if inside in (name, ".") or name.startswith(f"{inside}/")}


def main() -> int:
    """Check or write the record; returns the exit code."""
    now = current()
    stored: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    if sys.argv[1:] == ["--check"]:
        lines = differences(stored, now)
        hint = "measure or render again, then python docs/make_record.py PATH"
        print("\n".join([*lines, hint] if lines else [f"{_name(RECORD)} is up to date"]))
        return 1 if lines else 0
    known = stored.keys() | now.keys()
    chosen = {name for word in sys.argv[1:] for name in _below(word, known)}
    if not chosen:
        print("name pages or pictures, or a folder with some: python docs/make_record.py PATH ...", file=sys.stderr)
        return 2
    kept = {name: now.get(name, {}) if name in chosen else stored.get(name, {}) for name in known}
    kept = {name: parts for name, parts in sorted(kept.items()) if parts}
    RECORD.write_text(json.dumps(kept, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"{len(kept)} pages and pictures")
    return 0


if __name__ == "__main__":
    sys.exit(main())
