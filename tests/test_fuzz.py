"""Every reader takes what was once found to break it, and a few inputs more; `make fuzz` reads thousands."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzz import run
from fuzz.targets import TARGETS

RENDERING = ("checkpoint", "scene-folder", "file-name", "environment")
FEW = 3  # spoilt inputs a reader, beside what was found before


@pytest.mark.long
def test_what_was_found_and_a_few_spoilt_inputs_more_are_survived(tmp_path: Path) -> None:
    """In a process of their own, which a find may bring down."""
    targets = [target for name, target in TARGETS.items() if name not in ("self-test", *RENDERING)]
    known = max(len(run.corpus(target)) for target in targets)
    assert run.run(targets, seed=7, count=known + FEW, finds=tmp_path) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", RENDERING)
def test_readers_that_load_scenes_survive_in_a_process_each(name: str, tmp_path: Path) -> None:
    assert run.run([TARGETS[name]], seed=7, count=len(run.corpus(TARGETS[name])) + FEW, finds=tmp_path) == {}


@pytest.mark.slow
def test_a_reader_that_breaks_is_found_out(tmp_path: Path) -> None:
    found = run.run([TARGETS["self-test"]], seed=1, count=60, finds=tmp_path)
    text = "\n".join(found)
    for expected in ("ZeroDivisionError", "SIGSEGV", " MB"):
        assert expected in text
    saved = b" ".join(path.read_bytes() for path in (tmp_path / "self-test").iterdir())
    assert b"divide" in saved and b"crash" in saved and b"memory" in saved
