"""Fixtures of the page's tests: one browser, one exported file, one tab, put back before each test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage
from web_page import COARSE, WIDE, Page

import browser


@pytest.fixture(scope="module")
def chrome() -> Iterator[Any]:
    with browser.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def homework_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return page_file.export(stage.homework(), tmp_path_factory.mktemp("page") / "page.html")


@pytest.fixture(scope="module")
def homework_page(chrome: Any, homework_file: Path) -> Iterator[Page]:
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    yield Page(tab, homework_file)
    tab.close()


@pytest.fixture
def page(homework_page: Page) -> Iterator[Page]:
    homework_page.reset()
    homework_page.problems.clear()
    yield homework_page
    assert homework_page.problems == []
