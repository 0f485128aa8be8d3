"""The page's sliders: those of a material with many parameters stand under headings, with labels that are not cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from gonio.viewer import page, stage
from web_page import WIDE, Page

GROUPS = ["base", "specular", "transmission", "subsurface", "coat", "fuzz", "thin film"]


@pytest.mark.slow
@pytest.mark.browser
def test_the_sliders_of_openpbr_are_grouped_and_labeled_in_full(chrome: Any, tmp_path: Path) -> None:
    file = page.export(stage.of_targets(["openpbr"]), tmp_path / "page.html")
    tab = chrome.new_page(viewport=WIDE)
    opened = Page(tab, file)
    headings = tab.locator(".subhead").all_inner_texts()
    assert [heading for heading in headings if heading in GROUPS] == GROUPS
    names = tab.locator(".lil-name")
    assert not any("_" in name for name in names.all_inner_texts())
    cut = names.evaluate_all(
        "all => all.filter((name) => name.scrollWidth > name.clientWidth).map((name) => name.innerText)"
    )
    assert cut == []
    assert opened.problems == []
    tab.close()
