"""A clone with nothing beside it passes its tests; data from elsewhere is read only where GONIO_SHARED names it."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BESIDE = re.compile(r"""/ *["']shared["'/]|["'/ ]\.\./shared""")


def test_no_program_looks_for_data_beside_the_checkout() -> None:
    folders = ("tests", "benchmarks", "docs", "examples", "src")
    files = [ROOT / "Makefile", *(file for folder in folders for file in (ROOT / folder).rglob("*.py"))]
    assert len(files) > 300
    found = [str(file) for file in files if file != Path(__file__) and BESIDE.search(file.read_text(encoding="utf-8"))]
    assert found == []


@pytest.mark.skipif(os.name == "nt", reason="a script of bash")
@pytest.mark.parametrize("beside", [False, True])
def test_ci_runs_make_test_as_a_user_does_then_what_needs_data(beside: bool, tmp_path: Path) -> None:
    checkout, told = tmp_path / "checkout", tmp_path / "told"
    for program in ("bin/make", "checkout/.venv/bin/python"):
        (tmp_path / program).parent.mkdir(parents=True)
        (tmp_path / program).write_text(f'#!/bin/sh\necho "${{GONIO_SHARED-unset}}" "$@" >> {told}\n')
        (tmp_path / program).chmod(0o755)
    (checkout / ".ci").mkdir()
    (checkout / ".ci/run").write_bytes((ROOT / ".ci/run").read_bytes())
    if beside:
        (tmp_path / "shared").mkdir()
    path = f"{tmp_path / 'bin'}:{os.environ['PATH']}"
    subprocess.run(["bash", checkout / ".ci/run"], check=True, env={"PATH": path, "GONIO_SHARED": "/elsewhere"})
    expected = ["unset test", "../shared -m pytest -m shared and not slow"]
    assert told.read_text().splitlines() == expected[: 1 + beside]
