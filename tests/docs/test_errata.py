"""docs/errata.md: the figures are those that the script computes, and every thread has one."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_errata", DOCS / "make_errata.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_errata"] = module  # its class of a material is looked up there
    spec.loader.exec_module(module)
    return module


ERRATA = script()
PAGE = (DOCS / "errata.md").read_text(encoding="utf-8")


def test_every_thread_has_an_address_and_a_figure() -> None:
    sections = PAGE.split("\n## ")[1:]
    assert [section.partition("\n")[0] for section in sections] == list(ERRATA.THREADS)
    for section in sections:
        assert re.search(r"\(https://github\.com/[\w./-]+/issues/\d+\)", section) and "**Computed**" in section


@pytest.mark.slow
@pytest.mark.parametrize("title", ERRATA.THREADS)
def test_the_figures_of_a_thread_are_computed(title: str) -> None:
    assert ERRATA.section(title) in PAGE


@pytest.mark.parametrize("title", ["Adding diffuse and specular lobes", "Thin films and transmitted light"])
def test_figures_that_are_computed_at_once(title: str) -> None:
    assert ERRATA.section(title) in PAGE
