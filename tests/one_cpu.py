"""Programs on a machine of one processor, as small virtual machines are: Dr.Jit has no thread beside its own there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SECONDS = 120  # after which a program is taken to hang


def run(
    program: str, *arguments: object, folder: Path | None = None, seconds: float = SECONDS
) -> subprocess.CompletedProcess[str]:
    """The program of that text, bound to one processor. Raises subprocess.TimeoutExpired where it hangs."""
    bound = "import os\nif hasattr(os, 'sched_setaffinity'): os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])\n"
    return subprocess.run(
        [sys.executable, "-c", bound + program, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=seconds,
        cwd=folder,
        env={**os.environ, "MALLOC_CHECK_": "3"},
    )
