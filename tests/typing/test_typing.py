"""What editors and type checkers know of Gonio: pyright, in strict mode, reads a program that uses all of it."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import gonio as go
import pytest

HERE = Path(__file__).parent


@cache
def _reported() -> list[tuple[str, int, str, str]]:
    """(file, line, rule, message) of all that pyright says of the two programs."""
    if importlib.util.find_spec("pyright") is None:
        pytest.skip("NO TYPE CHECKER: pyright is not installed, no types are checked (pip install -e .[dev])")
    command = [sys.executable, "-m", "pyright", "-p", str(HERE), "--pythonpath", sys.executable, "--outputjson"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    try:
        said = json.loads(done.stdout)
    except ValueError:
        pytest.skip(f"NO TYPE CHECKER: pyright cannot run here, no types are checked: {done.stderr[-400:]}")
    assert said["summary"]["filesAnalyzed"] == 2
    return [
        (Path(one["file"]).name, one["range"]["start"]["line"] + 1, one.get("rule", one["severity"]), one["message"])
        for one in said["generalDiagnostics"]
    ]


@pytest.mark.slow
def test_a_program_that_uses_everything_is_clean_in_strict_mode():
    assert [one for one in _reported() if one[0] != "mistakes.py"] == []


def test_every_public_name_is_used_by_that_program():
    text = (HERE / "public_api.py").read_text()
    assert [name for name in go.__all__ if not re.search(rf"\b(go\.{name}|import {name})\b", text)] == []


@pytest.mark.slow
def test_each_mistake_is_reported_by_its_rule():
    lines = (HERE / "mistakes.py").read_text().splitlines()
    expected = {
        (number, rule)
        for number, line in enumerate(lines, 1)
        if "  # report" in line
        for rule in line.partition("  # ")[2].split(", ")
    }
    found = {(line, rule) for file, line, rule, _ in _reported() if file == "mistakes.py"}
    assert found == expected
