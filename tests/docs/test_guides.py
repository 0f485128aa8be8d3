"""The guides do what they say: their files are written, their commands and programs run in the order of the page."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from gonio import cli

ROOT = Path(__file__).parents[2]
GUIDES = sorted((ROOT / "docs/guides").glob("*.md"))
STEP = re.compile(r"^```(\w+) ?(\S*)\n(.*?)^```$|^    (gonio [^\n]*)$", re.DOTALL | re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_a_guide_does_what_it_says(
    guide: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    steps = STEP.findall(guide.read_text(encoding="utf-8"))
    assert len(steps) >= 3
    for language, file, block, command in steps:
        if file:
            Path(file).write_text(block)
        elif command:
            words = shlex.split(command, comments=True)[1:]
            assert cli.run(words) == 0, (command, capsys.readouterr().err)
            named = [words[i + 1] for i, word in enumerate(words) if word == "-o"]
            assert all(Path(name).exists() for name in named), command
        elif language == "python":
            done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
