"""docs/scenes.md: the keys of scenes are those of the schema, and its example renders."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import gonio as go

ROOT = Path(__file__).parents[2]


def test_the_page_of_scenes_is_up_to_date() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs/make_scenes.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_example_of_the_page_renders(tmp_path: Path) -> None:
    example = re.search(r"```json\n(.*?)```", (ROOT / "docs/scenes.md").read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    (tmp_path / "balls.json").write_text(example[1], encoding="utf-8")
    assert go.render(tmp_path / "balls.json", spp=1, size=(16, 9)).mean() > 0.05
