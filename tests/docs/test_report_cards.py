"""The public record: what is said of Mitsuba's plugins has a grade, a cause, and a program that shows it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from gonio import llvm

CARDS = Path(__file__).parents[2] / "docs/report-cards"
PROGRAMS = sorted((CARDS / "programs").glob("*.py"))
RESULTS = json.loads((CARDS / "cards.json").read_text())
FINDINGS = [one for result in RESULTS.values() for one in result.get("findings", [])]

# one process for all: Mitsuba starts once, and Gonio cannot be imported
RUN = """
import json, sys, traceback
sys.modules["gonio"] = None
ends = {}
for path in sys.argv[1:]:
    try:
        exec(compile(open(path).read(), path, "exec"), {"__name__": "__main__"})
        ends[path] = "no error"
    except BaseException as error:
        ends[path] = f"{type(error).__name__}: {error}"
print(json.dumps(ends))
"""


def test_every_verdict_on_a_plugin_has_a_grade_a_cause_and_a_program() -> None:
    assert len(FINDINGS) > 20 and {one["target"].split(":")[0] for one in FINDINGS} == {"mitsuba"}
    for one in FINDINGS:
        assert one["grade"] != "ungraded" and one["cause"] and (CARDS / one["program"]).is_file(), one
    assert {path.name for path in PROGRAMS} == {Path(one["program"]).name for one in FINDINGS}


@pytest.mark.slow
def test_every_program_shows_its_fault_without_gonio() -> None:
    made = {line.split("Mitsuba ")[1].split(",")[0] for path in PROGRAMS for line in path.read_text().splitlines()[:1]}
    assert len(made) == 1
    llvm.use()
    command = [sys.executable, "-c", RUN, *map(str, PROGRAMS)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": ""}, timeout=300)
    assert done.returncode == 0, done.stderr
    ends = json.loads(done.stdout.splitlines()[-1])
    mended = {Path(p).name: end for p, end in ends.items() if not end.startswith("AssertionError: ")}
    about = f"the cards are about Mitsuba {made.pop()}, this is {version('mitsuba')}: run docs/make_report_cards.py"
    assert mended == {}, about
