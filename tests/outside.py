"""A package of somebody else's, in a temporary folder: what it brings must work as Gonio's own members do."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def install(folder: Path, name: str, text: str, points: dict[str, str]) -> None:
    """Write a package of one module, `text`, as pip would install it; `points` is group -> "NAME = MODULE:THING"."""
    information = folder / f"{name}-1.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
    (information / "entry_points.txt").write_text("".join(f"[{group}]\n{point}\n" for group, point in points.items()))
    (folder / f"{name}.py").write_text(text)


def gonio(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process that has the folder's packages installed."""
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "gonio.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
