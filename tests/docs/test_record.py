"""docs/record.json: figures and pictures that no test can make again are those that were last reviewed."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest

import pages

DOCS = Path(__file__).parents[2] / "docs"


def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_record", DOCS / "make_record.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RECORD = script()


def test_figures_and_pictures_are_as_recorded() -> None:
    stored = json.loads((DOCS / "record.json").read_text(encoding="utf-8"))
    changed = RECORD.differences(stored, RECORD.current())
    assert changed == [], (
        "measure or render again, then run: python docs/make_record.py PAGE (for a formula: docs/book/formulas.py)"
    )


def test_every_page_is_recorded_computed_or_a_translation() -> None:
    recorded = {*RECORD.pages(), *RECORD.written()}
    left = [page.relative_to(pages.ROOT).as_posix() for page in pages.PAGES if page not in recorded]
    left = [page for page in left if not page.startswith(RECORD.COMPUTED) and not page.endswith(".zh.md")]
    assert left == ["CHANGELOG.md", "CONTRIBUTING.md"]


@pytest.mark.parametrize(
    ("line", "changed"),
    [("wrong by 52 % at worst", "wrong by 53 % at worst"), ("E to 1.4e-7", "E to 1.4e-6"), ("twelve laws", "ten laws")],
)
def test_a_changed_number_is_named(line: str, changed: str, tmp_path: Path) -> None:
    found = []
    for text in (line, changed):
        page = tmp_path / "page.md"
        page.write_text(f"# Title\n\n## Section\n{text}\n", encoding="utf-8")
        found.append({"page.md": RECORD.figures(page)})
    (message,) = RECORD.differences(*found)
    assert message.startswith("page.md, Section: ")


def test_a_changed_scene_makes_its_picture_stale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RECORD, "ROOT", tmp_path)
    folder = tmp_path / "examples" / "ball"
    folder.mkdir(parents=True)
    (folder / "ball.png").write_bytes(b"a picture")
    (folder / "scene.json").write_text('{"radius": 1}')
    before = RECORD.digests(folder / "ball.png")
    (folder / "scene.json").write_text('{\n "radius": 1\n}')
    assert RECORD.digests(folder / "ball.png") == before
    (folder / "scene.json").write_text('{"radius": 2}')
    after = RECORD.digests(folder / "ball.png")
    assert {name for name in before if before[name] != after[name]} == {"scene.json"}
