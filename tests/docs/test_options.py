"""docs/options.md: the table of all options is that of the code."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_table_of_options_is_up_to_date() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs/make_options.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
