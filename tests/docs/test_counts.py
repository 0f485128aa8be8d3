"""Counts that pages state in words are those of the code."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import gonio as go
import pytest
from gonio.viewer import families

import pages

ROOT = Path(__file__).parents[2]
NUMBERS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
WORDS = dict(enumerate(NUMBERS))
CHINESE = {11: "十一", 12: "十二"}


def count(kind: str) -> int:
    return len(families.families()[kind][0].all())


LAWS = count("law") - 1  # `shader` is judged only if it is named
PHONG = len(re.findall(r"^## \d\.", (ROOT / "docs/phong-limits.md").read_text(encoding="utf-8"), re.MULTILINE))


@pytest.mark.parametrize(
    ("page", "sentence"),
    [
        ("README.md", f"{WORDS[LAWS]} laws such as"),
        ("README.zh.md", f"{CHINESE[LAWS]}条定律"),
        ("docs/index.md", f"against {WORDS[LAWS]} laws"),
        ("docs/tour.md", f"# {WORDS[LAWS]} laws"),
        ("docs/verify.md", f"{WORDS[LAWS]} laws test"),
        ("docs/phong-limits.md", f"none of the {WORDS[PHONG]}"),
        ("examples/lab-sheet.ipynb", f"{WORDS[PHONG]} times over"),
        ("README.md", f"| {len(go.models())} models |"),
        ("README.zh.md", f"| {len(go.models())} 个模型 |"),
    ],
)
def test_a_count_is_that_of_the_code(page: str, sentence: str) -> None:
    text = " ".join((ROOT / page).read_text(encoding="utf-8").lower().split())
    assert sentence in text


def test_versions_are_those_that_the_package_needs_and_the_cards_judged() -> None:
    """Of Python and, to the last digit, of Mitsuba, on every page."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    python = project["requires-python"].removeprefix(">=")
    cards = (ROOT / "docs/report-cards/README.md").read_text(encoding="utf-8")
    mitsuba = re.findall(r"Mitsuba (\d+\.\d+\.\d+)", cards)[0]
    for page in [page for page in pages.PAGES if page.stem != "CHANGELOG"]:
        text = page.read_text(encoding="utf-8")
        assert set(re.findall(r"Python (3\.\d+)", text)) <= {python}, page
        assert set(re.findall(r"Mitsuba (\d+\.\d+\.\d+)", text)) <= {mitsuba}, page


def test_every_masking_term_is_in_the_conventions() -> None:
    text = (ROOT / "docs/conventions.md").read_text(encoding="utf-8")
    assert [name for name in families.families()["masking term"][0].all() if f"`{name}`" not in text] == []


def test_every_law_has_its_row() -> None:
    text = (ROOT / "docs/verify.md").read_text(encoding="utf-8")
    assert [name for name in families.families()["law"][0].all() if f"| `{name}` |" not in text] == []
