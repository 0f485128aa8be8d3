"""Pages in two languages state the same numbers and the same code: only words are translated."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENGLISH = [page.with_name(page.name.replace(".zh.md", ".md")) for page in sorted(ROOT.glob("docs/**/*.zh.md"))]
ENGLISH += [ROOT / "README.md"]
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)*(?:e-?\d+)?")
THOUSANDS = re.compile(r"(?<=\d)[ ,](?=\d{3}\b)")
COUNTED = re.compile(r"(作业|实验|提高项)([一二三四五六七八九])")  # homework 4, Lab 2, bonus 1
CHINESE = "〇一二三四五六七八九"


def numbers(text: str) -> Counter[str]:
    """Every number of a page, in prose, formulas, tables and the comments of listings."""
    digits = COUNTED.sub(lambda found: f" {CHINESE.index(found[2])}", text)
    return Counter(NUMBER.findall(THOUSANDS.sub("", digits)))


def code(text: str) -> set[str]:
    """What stands in backquotes within prose; comments of listings are prose, and may quote or not."""
    prose = re.sub(r"^```.*?^```$|^    [^\n]*$", "", text, flags=re.DOTALL | re.MULTILINE)
    return set(re.findall(r"`([^`\n]+)`", prose))


@pytest.mark.parametrize("page", ENGLISH, ids=lambda page: page.stem)
@pytest.mark.parametrize("part", [numbers, code], ids=["numbers", "code"])
def test_both_languages_have_the_same(page: Path, part: object) -> None:
    english, chinese = (part(one.read_text(encoding="utf-8")) for one in (page, page.with_suffix(".zh.md")))  # type: ignore[operator]
    assert english == chinese
